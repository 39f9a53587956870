//! The reference solution of networks: Radau IIA of order 5 with dense matrices, step-size control, and switches to a
//! nanosecond. It shares only the types of a network with the tested code.

use isotherm::internals::{HeatTable, Network, NodeKind, Schedule};

const SIGMA: f64 = 5.670374419e-8;
/// Error allowed in one step [K].
const LOCAL: f64 = 2e-10;

/// Rows at the output times, and switches: time, thermostat, state, and rate of the sensor [K/s].
pub struct Solution {
    pub rows: Vec<Vec<f64>>,
    pub switches: Vec<(f64, usize, bool, f64)>,
}

/// Heat of a table at `t`. At a jump `after` selects the value after it.
fn table(table: &HeatTable, t: f64, after: bool) -> f64 {
    let (times, powers) = (&table.times, &table.powers);
    let next = times.iter().position(|time| if after { *time > t } else { *time >= t });
    match next {
        None => powers[powers.len() - 1],
        Some(0) => powers[0],
        Some(next) => {
            let share = (t - times[next - 1]) / (times[next] - times[next - 1]);
            powers[next - 1] * (1.0 - share) + powers[next] * share
        }
    }
}

/// A dense matrix, factored with partial pivoting.
struct Dense {
    size: usize,
    values: Vec<f64>,
    pivots: Vec<usize>,
}

impl Dense {
    fn factor(size: usize, mut values: Vec<f64>) -> Self {
        let mut pivots = Vec::with_capacity(size);
        for k in 0..size {
            let pivot = (k..size).max_by(|a, b| values[a * size + k].abs().total_cmp(&values[b * size + k].abs()));
            let pivot = pivot.expect("a row");
            pivots.push(pivot);
            for j in 0..size {
                values.swap(k * size + j, pivot * size + j);
            }
            assert!(values[k * size + k] != 0.0, "the exact solution met a singular matrix");
            let (above, below) = values.split_at_mut((k + 1) * size);
            let row = &above[k * size..];
            for other in below.chunks_mut(size) {
                let factor = other[k] / row[k];
                other[k] = factor;
                if factor != 0.0 {
                    for j in k + 1..size {
                        other[j] -= factor * row[j];
                    }
                }
            }
        }
        Self { size, values, pivots }
    }

    fn solve(&self, right: &mut [f64]) {
        for k in 0..self.size {
            right.swap(k, self.pivots[k]);
        }
        for i in 0..self.size {
            let sum: f64 = (0..i).map(|j| self.values[i * self.size + j] * right[j]).sum();
            right[i] -= sum;
        }
        for i in (0..self.size).rev() {
            let sum: f64 = (i + 1..self.size).map(|j| self.values[i * self.size + j] * right[j]).sum();
            right[i] = (right[i] - sum) / self.values[i * self.size + i];
        }
    }
}

/// Butcher's matrix and times of Radau IIA of order 5 (Hairer & Wanner, Solving ODEs II, table IV.5.6).
fn radau() -> ([[f64; 3]; 3], [f64; 3]) {
    let s = 6.0_f64.sqrt();
    (
        [
            [(88.0 - 7.0 * s) / 360.0, (296.0 - 169.0 * s) / 1800.0, (-2.0 + 3.0 * s) / 225.0],
            [(296.0 + 169.0 * s) / 1800.0, (88.0 + 7.0 * s) / 360.0, (-2.0 - 3.0 * s) / 225.0],
            [(16.0 - s) / 36.0, (16.0 + s) / 36.0, 1.0 / 9.0],
        ],
        [(4.0 - s) / 10.0, (4.0 + s) / 10.0, 1.0],
    )
}

struct Solver<'a> {
    network: &'a Network,
    schedule: &'a Schedule,
    on: Vec<bool>,
    /// Nodes except boundaries.
    nodes: Vec<usize>,
    /// Factors for two steps of length `.0`.
    factors: Vec<(f64, Dense)>,
    /// Start and end of the current piece.
    piece: [f64; 2],
}

impl Solver<'_> {
    fn heat(&self, t: f64, now: &[f64]) -> Vec<f64> {
        let network = self.network;
        let mut out = vec![0.0; now.len()];
        let four = |t: f64| t * t * t * t;
        for (node, out) in out.iter_mut().enumerate() {
            *out = -network.emissive_areas[node] * SIGMA * (four(now[node]) - four(network.space_temperature));
        }
        for conductor in &network.linear {
            let [a, b] = conductor.nodes.map(|node| node as usize);
            out[a] += conductor.conductance * (now[b] - now[a]);
            out[b] += conductor.conductance * (now[a] - now[b]);
        }
        for conductor in &network.radiative {
            let [a, b] = conductor.nodes.map(|node| node as usize);
            let flow = conductor.exchange_area * SIGMA * (four(now[b]) - four(now[a]));
            out[a] += flow;
            out[b] -= flow;
        }
        for (node, heat) in &self.schedule.heat {
            // Within a piece every table is a line between its limits at both ends.
            let [start, end] = self.piece;
            let share = (t - start) / (end - start);
            out[*node as usize] += (1.0 - share) * table(heat, start, true) + share * table(heat, end, false);
        }
        for (thermostat, on) in self.schedule.thermostats.iter().zip(&self.on) {
            out[thermostat.node as usize] += if *on { thermostat.power } else { 0.0 };
        }
        out
    }

    /// d heat / dT of the nodes except boundaries.
    fn jacobian(&self, now: &[f64]) -> Vec<f64> {
        let size = self.nodes.len();
        let row: Vec<Option<usize>> = (0..now.len()).map(|node| self.nodes.iter().position(|n| *n == node)).collect();
        let mut matrix = vec![0.0; size * size];
        let mut add = |a: usize, b: usize, value: f64| {
            if let (Some(a), Some(b)) = (row[a], row[b]) {
                matrix[a * size + b] += value;
            }
        };
        let slope = |node: usize| 4.0 * SIGMA * now[node].powi(3);
        for node in 0..now.len() {
            add(node, node, -self.network.emissive_areas[node] * slope(node));
        }
        let linear = self.network.linear.iter().map(|c| (c.nodes, [c.conductance; 2]));
        let radiative = self.network.radiative.iter().map(|c| {
            let slopes = c.nodes.map(|node| c.exchange_area * slope(node as usize));
            (c.nodes, slopes)
        });
        for (nodes, [from_a, from_b]) in linear.chain(radiative) {
            let [a, b] = nodes.map(|node| node as usize);
            add(a, a, -from_a);
            add(b, a, from_a);
            add(b, b, -from_b);
            add(a, b, from_b);
        }
        matrix
    }

    fn mass(&self, node: usize) -> f64 {
        if self.network.kinds[node] == NodeKind::Diffusive { self.network.capacitances[node] } else { 0.0 }
    }

    /// Temperatures of arithmetic nodes at `t`, by Newton's method with step halving.
    fn balance(&self, t: f64, now: &mut [f64]) {
        let sought: Vec<usize> =
            (0..now.len()).filter(|node| self.network.kinds[*node] == NodeKind::Arithmetic).collect();
        if sought.is_empty() {
            return;
        }
        let size = self.nodes.len();
        let places: Vec<usize> =
            sought.iter().map(|node| self.nodes.iter().position(|n| n == node).expect("a node")).collect();
        for _ in 0..500 {
            let heat = self.heat(t, now);
            let jacobian = self.jacobian(now);
            let jacobian = &jacobian;
            let matrix: Vec<f64> =
                places.iter().flat_map(|a| places.iter().map(move |b| -jacobian[a * size + b])).collect();
            let mut change: Vec<f64> = sought.iter().map(|node| heat[*node]).collect();
            Dense::factor(sought.len(), matrix).solve(&mut change);
            let mut largest = 0.0_f64;
            for (node, change) in sought.iter().zip(&change) {
                let limited = change.clamp(-0.5 * now[*node], now[*node] + 10.0);
                largest = largest.max(limited.abs());
                now[*node] += limited;
            }
            if largest < 1e-12 * 300.0 {
                return;
            }
        }
        panic!("the exact solution found no balance");
    }

    /// One step: the values at its three stages. The last is its end. `None` if Newton's method fails.
    fn step(&mut self, t: f64, h: f64, start: &[f64]) -> Option<[Vec<f64>; 3]> {
        for fresh in [false, true] {
            if fresh || !self.factors.iter().any(|(of, _)| *of == h) {
                let factors = self.matrix(h, start);
                self.factors.retain(|(of, _)| *of != h);
                if self.factors.len() > 4 {
                    self.factors.remove(0);
                }
                self.factors.push((h, factors));
            }
            if let Some(found) = self.newton(t, h, start) {
                return Some(found);
            }
        }
        None
    }

    fn matrix(&self, h: f64, now: &[f64]) -> Dense {
        let (a, _) = radau();
        let (size, jacobian) = (self.nodes.len(), self.jacobian(now));
        let full = 3 * size;
        let mut values = vec![0.0; full * full];
        for (i, a) in a.iter().enumerate() {
            for (j, a) in a.iter().enumerate() {
                for r in 0..size {
                    // A row without mass is the balance at the time of the stage.
                    let massive = self.mass(self.nodes[r]) > 0.0;
                    for c in 0..size {
                        let value = &mut values[(i * size + r) * full + j * size + c];
                        if massive {
                            *value = -h * a * jacobian[r * size + c] / self.mass(self.nodes[r]);
                        } else if i == j {
                            *value = -jacobian[r * size + c];
                        }
                    }
                    if i == j && massive {
                        values[(i * size + r) * full + j * size + r] += 1.0;
                    }
                }
            }
        }
        Dense::factor(full, values)
    }

    fn newton(&self, t: f64, h: f64, start: &[f64]) -> Option<[Vec<f64>; 3]> {
        let (a, c) = radau();
        let size = self.nodes.len();
        let (_, factors) = self.factors.iter().find(|(of, _)| *of == h)?;
        let mut stages = [start.to_vec(), start.to_vec(), start.to_vec()];
        let mut last = f64::INFINITY;
        for _ in 0..40 {
            let heats: Vec<Vec<f64>> = (0..3).map(|i| self.heat(t + c[i] * h, &stages[i])).collect();
            let mut right = vec![0.0; 3 * size];
            for i in 0..3 {
                for (r, node) in self.nodes.iter().enumerate() {
                    let mass = self.mass(*node);
                    right[i * size + r] = if mass > 0.0 {
                        let sum: f64 = (0..3).map(|j| a[i][j] * heats[j][*node]).sum();
                        start[*node] - stages[i][*node] + h / mass * sum
                    } else {
                        heats[i][*node]
                    };
                }
            }
            factors.solve(&mut right);
            let largest = right.iter().fold(0.0_f64, |largest, change| largest.max(change.abs()));
            if !largest.is_finite() || largest > 0.5 * last && largest > 1e-11 {
                return None;
            }
            for i in 0..3 {
                for (r, node) in self.nodes.iter().enumerate() {
                    stages[i][*node] += right[i * size + r];
                }
            }
            if stages.iter().flatten().any(|kelvin| *kelvin < 0.0) {
                return None;
            }
            if largest < 2e-12 {
                return Some(stages);
            }
            if largest >= 0.5 * last {
                return Some(stages);
            }
            last = largest;
        }
        None
    }

    fn past(&self, thermostat: usize, now: &[f64]) -> f64 {
        let own = &self.schedule.thermostats[thermostat];
        let sensed = now[own.sensor as usize];
        if self.on[thermostat] { sensed - own.off_above } else { own.on_below - sensed }
    }

    /// The first thermostat that crosses a threshold on the way through `points`.
    fn crossing(&self, points: &[&[f64]]) -> Option<usize> {
        (0..self.on.len()).find(|thermostat| {
            points
                .windows(2)
                .any(|pair| self.past(*thermostat, pair[0]) <= 0.0 && self.past(*thermostat, pair[1]) > 0.0)
        })
    }
}

/// Solves the network from time 0 to its last output time.
pub fn solve(network: &Network, schedule: &Schedule) -> Solution {
    let mut breaks: Vec<f64> = schedule.heat.iter().flat_map(|(_, table)| table.times.clone()).collect();
    breaks.extend(&schedule.times);
    breaks.retain(|time| *time > 0.0 && *time <= *schedule.times.last().expect("a time"));
    breaks.sort_by(f64::total_cmp);
    breaks.dedup();
    let mut solver = Solver {
        network,
        schedule,
        on: schedule.thermostats.iter().map(|thermostat| thermostat.initially_on).collect(),
        nodes: (0..network.len()).filter(|node| network.kinds[*node] != NodeKind::Boundary).collect(),
        factors: Vec::new(),
        piece: [0.0, breaks.first().copied().unwrap_or(1.0)],
    };
    let mut now = network.temperatures.clone();
    let mut solution = Solution { rows: Vec::new(), switches: Vec::new() };
    solver.balance(0.0, &mut now);
    if schedule.times[0] == 0.0 {
        solution.rows.push(now.clone());
    }
    let mut t = 0.0;
    let mut h = 1e-3;
    for end in breaks {
        solver.piece = [t, end];
        settle(&mut solver, t, &mut now, &mut solution);
        while t < end {
            let left = end - t;
            let mut used = h;
            if used >= left * 0.999_999 {
                used = left;
            }
            let whole = solver.step(t, used, &now);
            let half = solver.step(t, 0.5 * used, &now);
            let other = half.as_ref().and_then(|half| solver.step(t + 0.5 * used, 0.5 * used, &half[2]));
            let (Some(whole), Some(half), Some(other)) = (whole, half, other) else {
                h = 0.25 * used;
                assert!(h > 1e-16, "the exact solution found no step at {t}");
                continue;
            };
            let error = whole[2].iter().zip(&other[2]).fold(0.0_f64, |worst, (a, b)| worst.max((a - b).abs())) / 31.0;
            if error > LOCAL {
                h = 0.5 * used;
                assert!(h > 1e-16, "the exact solution found no step at {t}");
                continue;
            }
            let points: Vec<&[f64]> = std::iter::once(&now).chain(&half).chain(&other).map(Vec::as_slice).collect();
            if let Some(thermostat) = solver.crossing(&points) {
                if used > 1e-9 {
                    // Approaches the switch: the step before it is accepted as soon as it contains no switch.
                    h = if used > 1.0 { 0.5 * used } else { 0.25 * used };
                    continue;
                }
                let at = t + used;
                let sensor = schedule.thermostats[thermostat].sensor as usize;
                let rate = (other[2][sensor] - now[sensor]) / used;
                t = at;
                now.clone_from(&other[2]);
                solver.on[thermostat] = !solver.on[thermostat];
                solution.switches.push((at, thermostat, solver.on[thermostat], rate));
                assert!(solution.switches.len() < 20_000, "too many switches");
                solver.factors.clear();
                settle(&mut solver, t, &mut now, &mut solution);
                h = 1e-4;
                continue;
            }
            t = if used == left { end } else { t + used };
            now.clone_from(&other[2]);
            if error < LOCAL / 80.0 && used == h {
                h *= 2.0;
            }
        }
        if schedule.times.contains(&end) {
            solution.rows.push(now.clone());
        }
    }
    solution
}

/// Arithmetic nodes jump at once. A sensor among them may switch its thermostat.
fn settle(solver: &mut Solver, t: f64, now: &mut [f64], solution: &mut Solution) {
    for _ in 0..100 {
        let before = now.to_owned();
        solver.balance(t, now);
        let Some(thermostat) = (t > 0.0).then(|| solver.crossing(&[&before, now])).flatten() else { return };
        solver.on[thermostat] = !solver.on[thermostat];
        solution.switches.push((t, thermostat, solver.on[thermostat], f64::INFINITY));
    }
    panic!("the exact solution chatters");
}
