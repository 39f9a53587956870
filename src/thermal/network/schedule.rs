//! Schedule of a network: heat tables, thermostats and output times.

/// Heat of a node over time: linear between points and constant beyond them. Two points of one time are a jump.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatTable {
    /// Times [s], which do not decrease.
    pub times: Vec<f64>,
    /// Heat at each [W].
    pub powers: Vec<f64>,
}

impl HeatTable {
    /// Mean heat from `from` to `to` [s], which is later [W].
    pub(crate) fn mean(&self, from: f64, to: f64) -> f64 {
        let mut ends: Vec<f64> = self.times.iter().copied().filter(|time| *time > from && *time < to).collect();
        ends.push(to);
        let mut begin = from;
        let energy = ends.into_iter().map(|end| {
            let (power, slope) = self.after(begin);
            let span = end - begin;
            begin = end;
            span * (power + 0.5 * slope * span)
        });
        energy.sum::<f64>() / (to - from)
    }

    /// Constant heat.
    pub fn constant(power: f64) -> Self {
        Self { times: vec![0.0], powers: vec![power] }
    }

    /// Heat just before `t` [s]: another one than just after it at a jump [W].
    pub(crate) fn before(&self, t: f64) -> f64 {
        let next = self.times.partition_point(|time| *time < t);
        let (Some(last), Some(first)) = (self.powers.last(), self.powers.first()) else { return 0.0 };
        if next == 0 {
            return *first;
        }
        if next == self.times.len() {
            return *last;
        }
        let [from, to] = [next - 1, next].map(|at| (self.times[at], self.powers[at]));
        from.1 + (to.1 - from.1) * (t - from.0) / (to.0 - from.0)
    }

    pub(crate) fn sum(tables: &[&Self]) -> Self {
        if let [alone] = tables {
            return (*alone).clone();
        }
        let mut breaks: Vec<f64> = tables.iter().flat_map(|table| table.times.iter().copied()).collect();
        breaks.sort_unstable_by(f64::total_cmp);
        breaks.dedup();
        let mut sum = Self { times: Vec::new(), powers: Vec::new() };
        for time in breaks {
            let before: f64 = tables.iter().map(|table| table.before(time)).sum();
            let after: f64 = tables.iter().map(|table| table.after(time).0).sum();
            if tables.iter().any(|table| table.before(time) != table.after(time).0) {
                sum.times.push(time);
                sum.powers.push(before);
            }
            sum.times.push(time);
            sum.powers.push(after);
        }
        sum
    }

    /// Heat [W] and its slope [W/s] just after `t` [s].
    pub fn after(&self, t: f64) -> (f64, f64) {
        let next = self.times.partition_point(|time| *time <= t);
        let (Some(last), Some(first)) = (self.powers.last(), self.powers.first()) else { return (0.0, 0.0) };
        if next == 0 {
            return (*first, 0.0);
        }
        if next == self.times.len() {
            return (*last, 0.0);
        }
        let slope = (self.powers[next] - self.powers[next - 1]) / (self.times[next] - self.times[next - 1]);
        (self.powers[next - 1] + slope * (t - self.times[next - 1]), slope)
    }
}

/// A heater with hysteresis, which turns on when its sensor falls through `on_below`, and off when it rises through `off_above`.
#[derive(Debug, Clone, PartialEq)]
pub struct Thermostat {
    /// Number of the heated node.
    pub node: u32,
    /// Number of the sensor node.
    pub sensor: u32,
    /// Heat while on [W].
    pub power: f64,
    /// Threshold [K].
    pub on_below: f64,
    /// Threshold [K], above `on_below`.
    pub off_above: f64,
    /// State at time 0. A sensor changes it by crossing a threshold, so one that begins beyond its threshold waits for that.
    pub initially_on: bool,
}

impl Thermostat {
    /// Whether the heater of a scene is on at time 0, with its sensor at `sensed` [K]. Below the band it is on, above it off.
    pub(crate) fn begins_on(&self, sensed: f64) -> bool {
        sensed < self.on_below || (self.initially_on && sensed <= self.off_above)
    }

    /// Why the thermostat can not go on where it makes a number of `switches` within a time [s], with advice.
    pub(crate) fn chatter(&self, switches: u32, within: f64) -> String {
        let Self { on_below, off_above, power, .. } = self;
        format!(
            "switches {switches} times within {within:.1e} s: its band from {on_below} to {off_above} K ({:.3e} K) can not hold with \
             {power} W; widen the band, lower the power, or sense a node that stores more heat",
            off_above - on_below
        )
    }

    /// Distance of `sensed` [K] beyond the threshold that switches a heater in the state `on` [K].
    pub(super) fn past(&self, on: bool, sensed: f64) -> f64 {
        if on { sensed - self.off_above } else { self.on_below - sensed }
    }
}

/// Heat, thermostats and output times of a network.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Schedule {
    /// Constant heat of every node [W]. Empty where there is none.
    pub constant: Vec<f64>,
    /// Additional heat by tables: pairs of node number and table.
    pub heat: Vec<(u32, HeatTable)>,
    /// Thermostats.
    pub thermostats: Vec<Thermostat>,
    /// Nodes heated by each thermostat, with their shares of its power. A thermostat beyond the end of the list heats its own node.
    pub spread: Vec<Vec<(u32, f64)>>,
    /// Output times [s], ascending, none below 0.
    pub times: Vec<f64>,
}

impl Schedule {
    /// All heat of each of `nodes` nodes, thermostats left out. `None` where there is none.
    pub(crate) fn heat_of_nodes(&self, nodes: usize) -> Vec<Option<HeatTable>> {
        let mut tables: Vec<Vec<HeatTable>> = vec![Vec::new(); nodes];
        for (node, power) in self.constant.iter().enumerate().filter(|(_, power)| **power != 0.0) {
            tables[node].push(HeatTable::constant(*power));
        }
        for (node, table) in &self.heat {
            tables[*node as usize].push(table.clone());
        }
        let sum =
            |tables: Vec<HeatTable>| (!tables.is_empty()).then(|| HeatTable::sum(&tables.iter().collect::<Vec<_>>()));
        tables.into_iter().map(sum).collect()
    }

    /// The sensors in the order of the thermostats, in which a stepper reports them.
    pub fn sensors(&self) -> Vec<u32> {
        self.thermostats.iter().map(|thermostat| thermostat.sensor).collect()
    }

    /// Fewest sub-steps of an integration: one for each stretch between output times and breaks of the heat.
    pub(crate) fn fewest_sub_steps(&self) -> u64 {
        let end = self.times.last().copied().unwrap_or(0.0);
        let breaks = self.breaks();
        let mut ends: Vec<f64> =
            self.times.iter().chain(&breaks).copied().filter(|time| *time > 0.0 && *time <= end).collect();
        ends.sort_unstable_by(f64::total_cmp);
        ends.dedup();
        ends.len() as u64
    }

    /// Times after 0 at which the heat has a break [s], ascending.
    pub(super) fn breaks(&self) -> Vec<f64> {
        let all = self.heat.iter().flat_map(|(_, table)| table.times.iter().copied());
        let mut breaks: Vec<f64> = all.filter(|time| *time > 0.0).collect();
        breaks.sort_unstable_by(f64::total_cmp);
        breaks.dedup();
        breaks
    }

    /// Power [W] and slope [W/s] of the heat of `nodes` nodes just after `t` [s], with the heaters in the states `on`.
    pub(super) fn heat_after(&self, nodes: usize, t: f64, on: &[bool]) -> (Vec<f64>, Vec<f64>) {
        let (mut power, mut slope) = (self.constant.clone(), vec![0.0; nodes]);
        power.resize(nodes, 0.0);
        for (node, table) in &self.heat {
            let (added, change) = table.after(t);
            power[*node as usize] += added;
            slope[*node as usize] += change;
        }
        for (number, thermostat) in self.thermostats.iter().enumerate().filter(|(number, _)| on[*number]) {
            let alone = [(thermostat.node, 1.0)];
            for (node, share) in self.spread.get(number).map_or(&alone[..], Vec::as_slice) {
                power[*node as usize] += share * thermostat.power;
            }
        }
        (power, slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heat_is_linear_between_points_and_jumps_where_a_time_is_repeated() {
        let table = HeatTable { times: vec![10.0, 20.0, 20.0, 30.0], powers: vec![1.0, 3.0, 7.0, 6.0] };
        assert_eq!(table.after(0.0), (1.0, 0.0));
        assert_eq!(table.after(10.0), (1.0, 0.2));
        assert_eq!(table.after(15.0), (2.0, 0.2));
        assert_eq!(table.after(20.0), (7.0, -0.1));
        assert_eq!(table.after(30.0), (6.0, 0.0));
        assert_eq!(table.after(99.0), (6.0, 0.0));
    }

    #[test]
    fn the_mean_heat_counts_slopes_and_jumps() {
        let table = HeatTable { times: vec![10.0, 20.0, 20.0, 30.0], powers: vec![1.0, 3.0, 7.0, 6.0] };
        for (from, to, mean) in [(0.0, 5.0, 1.0), (5.0, 15.0, 1.25), (15.0, 25.0, 4.625), (30.0, 40.0, 6.0)] {
            assert!((table.mean(from, to) - mean).abs() < 1e-12, "{from} to {to}: {}", table.mean(from, to));
        }
    }

    #[test]
    fn a_sum_of_tables_has_the_heat_and_the_jumps_of_all() {
        let jumps = HeatTable { times: vec![10.0, 20.0, 20.0, 30.0], powers: vec![1.0, 3.0, 7.0, 6.0] };
        let slopes = HeatTable { times: vec![0.0, 25.0], powers: vec![0.0, 5.0] };
        let sum = HeatTable::sum(&[&jumps, &slopes, &HeatTable::constant(2.0)]);
        for at in [-5.0, 0.0, 3.0, 10.0, 15.0, 20.0, 22.0, 25.0, 28.0, 30.0, 40.0] {
            let each = [&jumps, &slopes].map(|table| table.after(at).0);
            assert!((sum.after(at).0 - (each[0] + each[1] + 2.0)).abs() < 1e-12, "after {at}");
            let each = [&jumps, &slopes].map(|table| table.before(at));
            assert!((sum.before(at) - (each[0] + each[1] + 2.0)).abs() < 1e-12, "before {at}");
        }
        assert_eq!([sum.before(20.0), sum.after(20.0).0], [9.0, 13.0], "the jump stays");
        assert_eq!(HeatTable::sum(&[&jumps]), jumps);
    }

    #[test]
    fn constant_heat_and_tables_add_up() {
        let table = HeatTable { times: vec![0.0, 10.0], powers: vec![1.0, 3.0] };
        let schedule = Schedule { constant: vec![5.0, 7.0], heat: vec![(1, table.clone())], ..Schedule::default() };
        assert_eq!(schedule.heat_after(3, 5.0, &[]), (vec![5.0, 9.0, 0.0], vec![0.0, 0.2, 0.0]));
        let without = Schedule { heat: vec![(1, table)], ..Schedule::default() };
        assert_eq!(without.heat_after(3, 5.0, &[]), (vec![0.0, 2.0, 0.0], vec![0.0, 0.2, 0.0]));
    }
}
