//! Integrates a network over its schedule. The error estimate sets the sub-step, the stiffness sets the method. Sub-steps end at every change of heat,
//! output time and switch.

use super::reference::ReferenceStepper;
use super::rkl2::stages_for;
use super::schedule::Schedule;
use super::stepper::StepMethod;
use super::switches::{Pace, SWITCH_TIME, SensorTrace};
use super::{Network, NodeKind};

mod rejected;
mod switching;
mod terms;

pub use terms::{ControlError, IntegrationSettings, Integrator, Series};
pub(crate) use terms::{Leg, MethodUse, ONE_PASS_TOLERANCE, Switch};

/// Greatest number of RKL2 stages before TR-BDF2 is cheaper, and the number below which RKL2 is used again.
const MOST_STAGES: [u32; 2] = [41, 25];
/// These numbers for the accurate integrator. At a tenth of the tolerance RKL2 is as accurate where it needs few stages.
const MOST_STAGES_ACCURATE: [u32; 2] = [15, 9];
/// Greatest error of one sub-step as a share of the tolerance, at the default tolerance or below. Errors of a slow node add up over its time constant.
const SHARE: f64 = 7.5e-3;
/// The tolerance from which this share grows as its square root [K], and the greatest share. With a method of order 2 the errors of sub-steps that err by E
/// add up to a number in proportion to E^(2/3), so that their sum is then in proportion to the tolerance.
const GROWS_FROM: f64 = 5e-3;
const MOST_SHARE: f64 = 0.1;
/// This share for a network with thermostats in a run of at most [`SHORT_RUN`]. A thermostat turns kelvins into seconds. In a longer run the share falls in
/// proportion to the length, because errors of switching times add up from cycle to cycle.
const SHARE_THERMOSTAT: f64 = 1e-5;
const SHORT_RUN: f64 = 2e4;
/// Greatest error of Euler over the whole schedule as a share of the tolerance.
const EULER_SHARE: f64 = 0.1;
/// Most sub-steps of Euler in one try.
const MOST_EULER: u32 = 16;
/// Safety factor on the fastest rate, because temperatures change within a try.
const RATE_MARGIN: f64 = 1.1;
/// Number of tries after which the fastest rate is computed again.
const RATE_AGE: u32 = 8;
/// Temperature of an arithmetic node [K] below which its radiation is negligible.
const NO_HEAT: f64 = 0.01;
/// Share of such a node's heat loss that f32 may lose.
const OPEN_SHARE: f64 = 1e-3;
/// Rate of a conductor that explains why no sub-step was good [1/s]. The nodes of such a conductor equalise within a thousand of the shortest
/// sub-steps, which the first sub-steps must resolve.
pub(crate) const STIFFEST: f64 = 1e15;

/// Least estimate of an error that is not rounding [K]: ten times the residual of Newton's method.
const FLOOR: f64 = 1e-9;

/// Most sub-steps of a stepper, over all its integrations: hours of the smallest network.
pub(crate) const MOST_SUB_STEPS: u64 = 10_000_000_000;

/// Integrates from time 0 to the last output time. `stepper` holds the network at its start and reports the schedule's sensors. `watch` receives the time
/// reached and returns whether to continue.
///
/// # Errors
/// See [`ControlError`].
pub fn integrate(
    stepper: &mut ReferenceStepper,
    network: &Network,
    schedule: &Schedule,
    settings: &IntegrationSettings,
    watch: impl FnMut(f64) -> bool,
) -> Result<Series, ControlError> {
    let (series, ended) = integrate_leg(stepper, network, schedule, settings, Leg::whole(schedule), watch);
    ended.map(|()| series)
}

/// [`integrate`] for one leg. With an error it also returns what was computed before: the rows and switches until then.
pub(crate) fn integrate_leg(
    stepper: &mut ReferenceStepper,
    network: &Network,
    schedule: &Schedule,
    settings: &IntegrationSettings,
    leg: Leg,
    watch: impl FnMut(f64) -> bool,
) -> (Series, Result<(), ControlError>) {
    let on: Vec<bool> = schedule.thermostats.iter().map(|thermostat| thermostat.initially_on).collect();
    let duration = leg.horizon.max(1e-9);
    let share = if schedule.thermostats.is_empty() || !leg.tight_switches {
        share_of(settings.tolerance)
    } else {
        SHARE_THERMOSTAT * (SHORT_RUN / duration).min(1.0)
    };
    let mut control = Control {
        stepper,
        network,
        schedule,
        integrator: settings.integrator,
        limit: (settings.tolerance * share).max(FLOOR),
        euler_rate: EULER_SHARE * settings.tolerance / duration,
        watch,
        heat: PresentHeat::default(),
        thermostats: ThermostatRun { sensed: Vec::new(), paces: vec![Pace::default(); on.len()], on },
        step: leg.step,
        rate: 0.0,
        rate_age: RATE_AGE,
        implicit: settings.integrator == Integrator::Accurate,
        euler_pause: 0,
        series: Series::default(),
    };
    let ended = control.run();
    control.series.counts = control.stepper.counts();
    control.series.on = control.thermostats.on;
    control.series.step = control.step;
    (control.series, ended)
}

/// Greatest error of one sub-step as a share of a tolerance [K].
fn share_of(tolerance: f64) -> f64 {
    (SHARE * (tolerance / GROWS_FROM).sqrt()).clamp(SHARE, MOST_SHARE)
}

struct Control<'a, W> {
    stepper: &'a mut ReferenceStepper,
    network: &'a Network,
    schedule: &'a Schedule,
    integrator: Integrator,
    /// Greatest error of a sub-step [K].
    limit: f64,
    /// Greatest error of Euler per second [K/s].
    euler_rate: f64,
    watch: W,
    heat: PresentHeat,
    thermostats: ThermostatRun,
    /// Sub-step proposed by the last estimate.
    step: f64,
    /// Bound of the fastest rate, with its safety factor.
    rate: f64,
    rate_age: u32,
    implicit: bool,
    /// Number of tries for which Euler is not tried.
    euler_pause: u32,
    series: Series,
}

/// The heat of tables and heaters.
#[derive(Default)]
struct PresentHeat {
    /// Power [W] and slope [W/s] of every node at the time when the heat was set.
    terms: [Vec<f64>; 2],
    /// Time at which the heat was set [s].
    set_at: f64,
    /// Time since then [s]. A separate variable resolves the sub-steps of a fast node late in a long run.
    since: f64,
}

struct ThermostatRun {
    /// Present values of the sensors.
    sensed: Vec<f64>,
    on: Vec<bool>,
    /// How fast each thermostat switches.
    paces: Vec<Pace>,
}

#[derive(Clone, Copy)]
struct PlannedTry {
    method: StepMethod,
    step: f64,
    count: u32,
}

impl<W: FnMut(f64) -> bool> Control<'_, W> {
    fn run(&mut self) -> Result<(), ControlError> {
        let breaks = self.schedule.breaks();
        let mut breaks = breaks.iter().copied().peekable();
        self.start()?;
        for time in &self.schedule.times {
            while let Some(at) = breaks.next_if(|at| at < time) {
                self.advance(at)?;
                self.set_heat(at)?;
            }
            self.advance(*time)?;
            self.check_balance()?;
            let row = self.stepper.temperatures();
            self.series.rows.push(row);
        }
        Ok(())
    }

    /// Sets the heat of time 0 and balances the arithmetic nodes with it. The sensors start at these temperatures.
    fn start(&mut self) -> Result<(), ControlError> {
        self.put_heat(0.0)?;
        self.thermostats.sensed = self.sense();
        Ok(())
    }

    fn now(&self) -> f64 {
        self.heat.set_at + self.heat.since
    }

    /// Sets the heat of tables and heaters from `time` on, which is the present time.
    fn put_heat(&mut self, time: f64) -> Result<(), ControlError> {
        let (power, slope) = self.schedule.heat_after(self.network.len(), time, &self.thermostats.on);
        self.stepper.set_heat(&power, &slope);
        self.heat.set_at = time;
        self.heat.since = 0.0;
        self.rate_age = RATE_AGE;
        self.euler_pause = 0;
        let is_balanced = self.stepper.balance(0.0);
        self.heat.terms = [power, slope];
        if is_balanced {
            return self.check_balance();
        }
        let temperatures = self.stepper.temperatures();
        let open = self.open_heat(&temperatures);
        let node = self.arithmetic().max_by(|a, b| open[*a].abs().total_cmp(&open[*b].abs())).unwrap_or(0);
        Err(ControlError::Unbalanced { time, node })
    }

    /// Fails where an arithmetic node at 0 K loses more heat than it receives.
    fn check_balance(&mut self) -> Result<(), ControlError> {
        let power = |node: usize| self.heat.terms[0][node] + self.heat.terms[1][node] * self.heat.since;
        if !self.arithmetic().any(|node| power(node) < 0.0) {
            return Ok(());
        }
        let temperatures = self.stepper.temperatures();
        let open = self.open_heat(&temperatures);
        let mut cold = self.arithmetic().filter(|node| temperatures[*node] < NO_HEAT);
        match cold.find(|node| power(*node) < 0.0 && open[*node] < OPEN_SHARE * power(*node)) {
            Some(node) => Err(ControlError::Unbalanced { time: self.now(), node }),
            None => Ok(()),
        }
    }

    fn arithmetic(&self) -> impl Iterator<Item = usize> {
        let kinds = &self.network.kinds;
        (0..kinds.len()).filter(|node| kinds[*node] == NodeKind::Arithmetic)
    }

    /// Net heat into every node at present [W]. 0 is a balance.
    fn open_heat(&self, temperatures: &[f64]) -> Vec<f64> {
        let mut heat = vec![0.0; temperatures.len()];
        self.network.exchanged_heat(temperatures, &mut heat);
        for ((heat, power), slope) in heat.iter_mut().zip(&self.heat.terms[0]).zip(&self.heat.terms[1]) {
            *heat += power + slope * self.heat.since;
        }
        heat
    }

    /// Integrates to `end`, which is not before the present time.
    fn advance(&mut self, end: f64) -> Result<(), ControlError> {
        // A switch sets the heat anew, and the time restarts from there.
        while self.heat.since < end - self.heat.set_at {
            let now = self.now();
            if !(self.watch)(now) {
                return Err(ControlError::Stopped);
            }
            if self.stepper.counts().sub_steps >= MOST_SUB_STEPS {
                return Err(ControlError::TooLong { time: now, step: self.step });
            }
            self.forward(end - self.heat.set_at)?;
        }
        Ok(())
    }

    /// Makes one try towards `end` [s] since the heat was set, and keeps or rejects it.
    fn forward(&mut self, end: f64) -> Result<(), ControlError> {
        if self.rate_age >= RATE_AGE {
            let temperatures = self.stepper.temperatures();
            let rate = self.network.fastest_rate(&temperatures);
            let [slow, fast] = self.series.rates.unwrap_or([rate; 2]);
            self.series.rates = Some([slow.min(rate), fast.max(rate)]);
            self.rate = RATE_MARGIN * rate;
            self.rate_age = 0;
        }
        self.rate_age += 1;
        if self.step.is_infinite() {
            self.step = if self.rate > 0.0 { 1.0 / self.rate } else { end - self.heat.since };
        }
        let plan = self.plan(end - self.heat.since);
        let t = self.heat.since;
        let attempt = self.stepper.attempt(plan.method, t, plan.step, plan.count);
        if attempt.error.is_nan() || attempt.error > self.allowed(plan) {
            return self.reject(plan, attempt.error);
        }
        let trace = SensorTrace { start: &self.thermostats.sensed, rest: &attempt.sensed };
        let thermostats = &self.schedule.thermostats;
        let crossing = trace.first_crossing(thermostats, &self.thermostats.on);
        let rows = crossing.unwrap_or(plan.count as usize + 1);
        if trace.may_hide_crossing(thermostats, &self.thermostats.on, rows) && plan.step > SWITCH_TIME {
            self.step = 0.5 * plan.step;
            self.series.rejected += 1;
            return Ok(());
        }
        match crossing {
            None => {
                let last = attempt.sensed.len() - self.thermostats.sensed.len();
                self.thermostats.sensed.copy_from_slice(&attempt.sensed[last..]);
                self.keep(plan, end);
                self.adapt(plan, attempt.error, end);
                Ok(())
            }
            Some(row) => {
                let before = trace.row(row - 1).to_vec();
                let after = trace.row(row).to_vec();
                if row > 1 {
                    let plan = PlannedTry { count: row as u32 - 1, ..plan };
                    self.stepper.attempt(plan.method, t, plan.step, plan.count);
                    self.thermostats.sensed = before;
                    self.keep(plan, end);
                }
                self.locate(plan, after)
            }
        }
    }

    /// Largest estimate with which a try is kept [K].
    fn allowed(&self, plan: PlannedTry) -> f64 {
        match plan.method {
            StepMethod::Euler => self.limit.min(self.euler_rate * plan.step),
            StepMethod::Rkl2 { .. } | StepMethod::TrBdf2 => self.limit,
        }
    }

    /// Plans a try over at most `remaining` [s].
    fn plan(&mut self, remaining: f64) -> PlannedTry {
        // Thermostats need a value between the ends to detect a reversal.
        let least: f64 = if self.schedule.thermostats.is_empty() { 1.0 } else { 2.0 };
        let stable = (remaining * self.rate).ceil().max(least);
        let euler = self.integrator != Integrator::Accurate && self.euler_pause == 0;
        if euler && stable <= f64::from(MOST_EULER) {
            return PlannedTry { method: StepMethod::Euler, step: remaining / stable, count: stable as u32 };
        }
        let whole = (remaining / self.step).ceil().max(1.0);
        let (step, count) = if whole <= least {
            (remaining / least, least)
        } else if whole <= 2.0 * least {
            // Two equal tries rather than a long one and a short one.
            (remaining / whole, (0.5 * whole).ceil())
        } else {
            (self.step, least)
        };
        let stages = stages_for(step * self.rate);
        let most = if self.integrator == Integrator::Accurate { MOST_STAGES_ACCURATE } else { MOST_STAGES };
        self.implicit = stages > most[usize::from(self.implicit)];
        let method = if self.implicit { StepMethod::TrBdf2 } else { StepMethod::Rkl2 { stages } };
        PlannedTry { method, step, count: count as u32 }
    }

    /// Keeps the last try. The time is then `end` [s] since the heat was set, where the plan reaches that.
    fn keep(&mut self, plan: PlannedTry, end: f64) {
        self.stepper.keep();
        let span = plan.step * f64::from(plan.count);
        let then = self.heat.since + span;
        self.heat.since = if (then - end).abs() <= 1e-9 * span { end } else { then.min(end) };
        self.euler_pause = self.euler_pause.saturating_sub(1);
        let (place, stages) = match plan.method {
            StepMethod::Euler => (0, 1),
            StepMethod::Rkl2 { stages } => (1, stages),
            StepMethod::TrBdf2 => (2, 2),
        };
        let fresh = MethodUse { sub_steps: 0, time: 0.0, range: [plan.step; 2], stages: [stages; 2] };
        let used = self.series.uses[place].get_or_insert(fresh);
        used.sub_steps += u64::from(plan.count);
        used.time += span;
        used.range = [used.range[0].min(plan.step), used.range[1].max(plan.step)];
        used.stages = [used.stages[0].min(stages), used.stages[1].max(stages)];
    }

    /// The next sub-step after a kept try.
    fn adapt(&mut self, plan: PlannedTry, error: f64, end: f64) {
        if plan.method == StepMethod::Euler {
            return;
        }
        let factor = (0.85 * (self.limit / error.max(1e-300)).cbrt()).clamp(0.3, 5.0);
        // A sub-step shortened by a break does not limit the next one.
        let cut = self.heat.since >= end && plan.step < self.step;
        self.step = if cut { self.step.max(plan.step * factor) } else { plan.step * factor };
        self.series.first_step.get_or_insert(self.step);
    }
}

#[cfg(test)]
mod tests {
    use super::super::reference::ReferenceStepper;
    use super::super::stepper::WorkCounts;
    use super::super::{LinearConductor, NodeKind};
    use super::*;

    /// A stepper that is 200 sub-steps short of the bound. What it computed until then is kept.
    #[test]
    fn an_integration_ends_at_the_bound_on_sub_steps() {
        let network = Network {
            space_temperature: 0.0,
            kinds: vec![NodeKind::Diffusive, NodeKind::Boundary],
            capacitances: vec![1.0, 0.0],
            emissive_areas: vec![0.0; 2],
            temperatures: vec![200.0, 300.0],
            linear: vec![LinearConductor { nodes: [0, 1], conductance: 1.0 }],
            radiative: Vec::new(),
        };
        let schedule = Schedule { times: (0..1000).map(f64::from).collect(), ..Schedule::default() };
        let ended = |left: u64| {
            let mut stepper = ReferenceStepper::new(network.clone(), &[]);
            stepper.set_counts(WorkCounts { sub_steps: MOST_SUB_STEPS - left, ..WorkCounts::default() });
            let (settings, leg) = (IntegrationSettings::of(Integrator::Default), Leg::whole(&schedule));
            integrate_leg(&mut stepper, &network, &schedule, &settings, leg, |_| true)
        };
        let (series, end) = ended(200);
        assert!(matches!(end, Err(ControlError::TooLong { .. })), "{end:?}");
        assert!((2..999).contains(&series.rows.len()), "{} rows", series.rows.len());
        let (whole, end) = ended(MOST_SUB_STEPS);
        assert!(end.is_ok() && whole.rows.len() == 1000);
        assert_eq!(whole.rows[..series.rows.len()], series.rows);
    }
}
