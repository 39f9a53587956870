//! Integrates a network through its schedule: sub-steps by the estimate of their error, methods by stiffness, breaks at
//! every heat time, output time and switch.

use std::fmt;

use super::Network;
use super::rkl2::stages_for;
use super::schedule::Schedule;
use super::stepper::{Method, Stepper, WorkCounts};
use super::switches::{Trace, crossed, straight_crossing};

/// Which methods may be chosen, and how tight the default tolerance is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Integrator {
    /// Euler where it is allowed and good enough, RKL2 otherwise, TR-BDF2 where RKL2 would need too many stages.
    #[default]
    Default,
    /// As the default at ten times its tolerance, with Euler wherever it is stable and good enough.
    Cheap,
    /// TR-BDF2 at a tenth of the default's tolerance; RKL2 at that tolerance where few stages do.
    Accurate,
}

impl Integrator {
    /// Tolerance where none is given [K].
    pub fn tolerance(self) -> f64 {
        match self {
            Self::Default => 5e-3,
            Self::Cheap => 5e-2,
            Self::Accurate => 5e-4,
        }
    }
}

/// How to integrate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Which methods.
    pub integrator: Integrator,
    /// Aim for the error that sub-steps add up to [K].
    pub tolerance: f64,
    /// Estimates below this are rounding [K]: no sub-step is asked to err by less.
    pub floor: f64,
}

/// The floor in f64 [K]: ten times what Newton's method leaves.
pub const FLOOR: f64 = 1e-9;

impl Settings {
    /// The integrator at its own tolerance, in f64.
    pub fn of(integrator: Integrator) -> Self {
        Self { integrator, tolerance: integrator.tolerance(), floor: FLOOR }
    }
}

/// A thermostat that switched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Switch {
    /// [s].
    pub time: f64,
    /// Number of the thermostat.
    pub thermostat: usize,
    /// Its state from then on.
    pub on: bool,
}

/// How much of the time a method took, and in what sub-steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Use {
    /// Kept sub-steps.
    pub sub_steps: u64,
    /// Time they cover [s].
    pub time: f64,
    /// Shortest and longest [s].
    pub range: [f64; 2],
    /// Fewest and most stages of a sub-step.
    pub stages: [u32; 2],
}

/// What an integration leaves.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series {
    /// Temperatures [K] of all nodes at every output time.
    pub rows: Vec<Vec<f64>>,
    /// Switching events in the order of time.
    pub switches: Vec<Switch>,
    /// Use of Euler, RKL2 and TR-BDF2.
    pub uses: [Option<Use>; 3],
    /// Slowest and fastest bound of the relaxation rate [1/s] that was met.
    pub rates: Option<[f64; 2]>,
    /// Tries that were taken back.
    pub rejected: u64,
    /// All work.
    pub counts: WorkCounts,
    /// States of the thermostats at the end.
    pub on: Vec<bool>,
    /// Sub-step that the last estimate proposes [s].
    pub step: f64,
    /// The same of the first estimate by which sub-steps were chosen: where parts in a row begin with jumps of their heat
    /// of like size, the next may begin with it.
    pub first_step: Option<f64>,
}

/// Where an integration stands that is one of many in a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    /// Time over which errors add up [s].
    pub horizon: f64,
    /// First sub-step to try [s].
    pub step: f64,
    /// Whether thermostats tighten the sub-steps, so that their switching times hold over a long run.
    pub tight_switches: bool,
}

/// Why an integration ends early.
#[derive(Debug, Clone, PartialEq)]
pub enum ControlError<E> {
    /// The stepper failed.
    Stepper(E),
    /// Arithmetic nodes have no balance.
    Unbalanced {
        /// [s].
        time: f64,
        /// The node whose balance is furthest from closing.
        node: usize,
    },
    /// No sub-step is short enough.
    NoStep {
        /// [s].
        time: f64,
        /// The coldest node, which most likely runs out of heat.
        node: usize,
        /// Its temperature [K].
        temperature: f64,
    },
    /// A node is hotter than the stepper holds.
    TooHot {
        /// [s].
        time: f64,
        /// The node.
        node: usize,
        /// Its temperature [K].
        temperature: f64,
    },
    /// A thermostat switches without end.
    Chatter {
        /// [s].
        time: f64,
        /// Number of the thermostat.
        thermostat: usize,
    },
    /// The caller asked to stop.
    Stopped,
}

impl<E> From<E> for ControlError<E> {
    fn from(error: E) -> Self {
        Self::Stepper(error)
    }
}

/// Most stages of RKL2 before TR-BDF2 is cheaper, and how many to fall to before RKL2 is tried again.
const MOST_STAGES: [u32; 2] = [41, 25];
/// The same of the accurate integrator: at a tenth of the tolerance RKL2 is as accurate where it needs few stages.
const MOST_STAGES_ACCURATE: [u32; 2] = [15, 9];
/// Share of the tolerance that one sub-step may err by: errors of a slow node add up over its time constant.
const SHARE: f64 = 5e-3;
/// The same where a thermostat turns kelvins into seconds, in a run of at most [`SHORT_RUN`]; in a longer one it falls as
/// the length grows, because errors of switching times add up from cycle to cycle.
const SHARE_THERMOSTAT: f64 = 1e-5;
/// [s].
const SHORT_RUN: f64 = 2e4;
/// Share of the tolerance that Euler may add over the whole schedule.
const EULER_SHARE: f64 = 0.1;
/// Most sub-steps of one try.
const MOST_FUSED: u32 = 16;
/// Safety on the fastest rate, which temperatures change within a try.
const RATE_MARGIN: f64 = 1.1;
/// Tries after which the fastest rate is asked for again.
const RATE_AGE: u32 = 8;
/// How closely a switch is located [s].
const SWITCH_TIME: f64 = 1e-7;
/// Switches of one thermostat within [`SWITCH_TIME`] of each other that are no longer believed.
const MOST_AT_ONCE: u32 = 6;
/// Switches of all thermostats after which the run is given up.
const MOST_SWITCHES: usize = 100_000;
/// Share of the hottest temperature of a stepper from which on a failed try is taken to have passed it.
const NEARLY_HOTTEST: f64 = 0.999;
/// Sub-step that is no longer believed to help [s].
const SHORTEST: f64 = 1e-18;

/// Integrates from time 0 to the last output time. `stepper` holds the network at its start and reports the schedule's
/// sensors; `watch` is told the time reached and says whether to go on.
///
/// # Errors
/// See [`ControlError`].
pub fn integrate<S: Stepper>(
    stepper: &mut S,
    network: &Network,
    schedule: &Schedule,
    settings: &Settings,
    watch: impl FnMut(f64) -> bool,
) -> Result<Series, ControlError<S::Error>> {
    let horizon = schedule.times.last().copied().unwrap_or(1.0);
    integrate_part(
        stepper,
        network,
        schedule,
        settings,
        Part { horizon, step: f64::INFINITY, tight_switches: true },
        watch,
    )
}

/// As [`integrate`], for one of many parts in a row.
///
/// # Errors
/// See [`ControlError`].
pub fn integrate_part<S: Stepper>(
    stepper: &mut S,
    network: &Network,
    schedule: &Schedule,
    settings: &Settings,
    part: Part,
    watch: impl FnMut(f64) -> bool,
) -> Result<Series, ControlError<S::Error>> {
    let on: Vec<bool> = schedule.thermostats.iter().map(|thermostat| thermostat.initially_on).collect();
    let duration = part.horizon.max(1e-9);
    let share = if schedule.thermostats.is_empty() || !part.tight_switches {
        SHARE
    } else {
        SHARE_THERMOSTAT * (SHORT_RUN / duration).min(1.0)
    };
    let mut control = Control {
        stepper,
        network,
        schedule,
        integrator: settings.integrator,
        limit: (settings.tolerance * share).max(settings.floor),
        euler_rate: EULER_SHARE * settings.tolerance / duration,
        watch,
        heat_set: 0.0,
        since: 0.0,
        sensed: Vec::new(),
        quick: vec![(f64::NEG_INFINITY, 0); on.len()],
        on,
        step: part.step,
        fused: 1,
        rate: 0.0,
        rate_age: RATE_AGE,
        implicit: settings.integrator == Integrator::Accurate,
        euler_pause: 0,
        series: Series::default(),
    };
    control.run()?;
    control.series.counts = control.stepper.counts();
    control.series.on = control.on;
    control.series.step = control.step;
    Ok(control.series)
}

struct Control<'a, S: Stepper, W> {
    stepper: &'a mut S,
    network: &'a Network,
    schedule: &'a Schedule,
    integrator: Integrator,
    /// Error that a sub-step may add [K].
    limit: f64,
    /// Error that Euler may add in a second [K/s].
    euler_rate: f64,
    watch: W,
    /// When the heat was set [s].
    heat_set: f64,
    /// Time since then [s]: apart, so that it resolves the sub-steps of a fast node late in a long run.
    since: f64,
    /// The sensors now.
    sensed: Vec<f64>,
    on: Vec<bool>,
    /// Last switch of each thermostat, and how many came close upon each other.
    quick: Vec<(f64, u32)>,
    /// Sub-step that the last estimate proposes.
    step: f64,
    fused: u32,
    /// Bound of the fastest rate, with its margin.
    rate: f64,
    rate_age: u32,
    implicit: bool,
    /// Tries for which Euler is left alone.
    euler_pause: u32,
    series: Series,
}

/// A try that has been planned.
#[derive(Clone, Copy)]
struct Plan {
    method: Method,
    step: f64,
    count: u32,
}

impl<S: Stepper, W: FnMut(f64) -> bool> Control<'_, S, W> {
    fn run(&mut self) -> Result<(), ControlError<S::Error>> {
        let breaks = self.schedule.breaks();
        let mut breaks = breaks.iter().copied().peekable();
        self.start()?;
        for time in &self.schedule.times {
            while let Some(at) = breaks.next_if(|at| at < time) {
                self.advance(at)?;
                self.set_heat(at)?;
            }
            self.advance(*time)?;
            let row = self.stepper.temperatures()?;
            self.series.rows.push(row);
        }
        Ok(())
    }

    /// Sets the heat of time 0, at which arithmetic nodes balance; what they jump to is where the sensors start.
    fn start(&mut self) -> Result<(), ControlError<S::Error>> {
        self.put_heat(0.0)?;
        self.sensed = self.sense()?;
        Ok(())
    }

    fn now(&self) -> f64 {
        self.heat_set + self.since
    }

    /// The heat from `time` on, which is now, as tables and heaters have it.
    fn put_heat(&mut self, time: f64) -> Result<(), ControlError<S::Error>> {
        let (power, slope) = self.schedule.heat_after(self.network.len(), time, &self.on);
        self.stepper.set_heat(&power, &slope)?;
        self.heat_set = time;
        self.since = 0.0;
        self.rate_age = RATE_AGE;
        self.euler_pause = 0;
        self.fused = 1;
        if self.stepper.balance(0.0)? {
            return Ok(());
        }
        let temperatures = self.stepper.temperatures()?;
        let mut heat = vec![0.0; temperatures.len()];
        self.network.exchanged_heat(&temperatures, &mut heat);
        let arithmetic = (0..heat.len()).filter(|node| self.network.kinds[*node] == super::NodeKind::Arithmetic);
        let open = |node: &usize| (heat[*node] + power[*node]).abs();
        let node = arithmetic.max_by(|a, b| open(a).total_cmp(&open(b))).unwrap_or(0);
        Err(ControlError::Unbalanced { time, node })
    }

    fn sense(&mut self) -> Result<Vec<f64>, ControlError<S::Error>> {
        if self.schedule.thermostats.is_empty() {
            return Ok(Vec::new());
        }
        let temperatures = self.stepper.temperatures()?;
        Ok(self.schedule.thermostats.iter().map(|thermostat| temperatures[thermostat.sensor as usize]).collect())
    }

    /// Sets the heat anew; where that makes arithmetic sensors jump over a threshold, switches, until none does.
    fn set_heat(&mut self, time: f64) -> Result<(), ControlError<S::Error>> {
        loop {
            self.put_heat(time)?;
            let after = self.sense()?;
            let before = std::mem::replace(&mut self.sensed, after);
            let at = crossed(&self.schedule.thermostats, &self.on, &before, &self.sensed);
            if at.is_empty() {
                return Ok(());
            }
            self.switch(&at)?;
        }
    }

    fn switch(&mut self, at: &[usize]) -> Result<(), ControlError<S::Error>> {
        let time = self.now();
        for &thermostat in at {
            self.on[thermostat] = !self.on[thermostat];
            let switch = Switch { time, thermostat, on: self.on[thermostat] };
            self.series.switches.push(switch);
            let (last, close) = &mut self.quick[thermostat];
            *close = if time - *last <= SWITCH_TIME { *close + 1 } else { 0 };
            *last = time;
            if *close > MOST_AT_ONCE || self.series.switches.len() > MOST_SWITCHES {
                return Err(ControlError::Chatter { time, thermostat });
            }
        }
        Ok(())
    }

    /// Integrates to `end`, at or after now.
    fn advance(&mut self, end: f64) -> Result<(), ControlError<S::Error>> {
        // A switch sets the heat anew, and with it the time that is counted from.
        while self.since < end - self.heat_set {
            let now = self.now();
            if !(self.watch)(now) {
                return Err(ControlError::Stopped);
            }
            self.forward(end - self.heat_set)?;
        }
        Ok(())
    }

    /// One try, and what it leads to, towards `end` [s] since the heat was set.
    fn forward(&mut self, end: f64) -> Result<(), ControlError<S::Error>> {
        if self.rate_age >= RATE_AGE {
            let temperatures = self.stepper.temperatures()?;
            let rate = self.network.fastest_rate(&temperatures);
            let [slow, fast] = self.series.rates.unwrap_or([rate; 2]);
            self.series.rates = Some([slow.min(rate), fast.max(rate)]);
            self.rate = RATE_MARGIN * rate;
            self.rate_age = 0;
        }
        self.rate_age += 1;
        if self.step.is_infinite() {
            self.step = if self.rate > 0.0 { 1.0 / self.rate } else { end - self.since };
        }
        let plan = self.plan(end - self.since);
        let t = self.since;
        let attempt = self.stepper.attempt(plan.method, t, plan.step, plan.count)?;
        if attempt.error.is_nan() || attempt.error > self.allowed(plan) {
            return self.reject(plan, attempt.error);
        }
        let trace = Trace { start: &self.sensed, rest: &attempt.sensed };
        let thermostats = &self.schedule.thermostats;
        let crossing = trace.first_crossing(thermostats, &self.on);
        let rows = crossing.unwrap_or(plan.count as usize + 1);
        if trace.may_hide_crossing(thermostats, &self.on, rows) && plan.step > SWITCH_TIME {
            self.step = 0.5 * plan.step;
            self.series.rejected += 1;
            return Ok(());
        }
        match crossing {
            None => {
                let last = attempt.sensed.len() - self.sensed.len();
                self.sensed.copy_from_slice(&attempt.sensed[last..]);
                self.keep(plan, end)?;
                self.adapt(plan, attempt.error, end);
                Ok(())
            }
            Some(row) => {
                let before = trace.row(row - 1).to_vec();
                let after = trace.row(row).to_vec();
                if row > 1 {
                    let plan = Plan { count: row as u32 - 1, ..plan };
                    self.stepper.attempt(plan.method, t, plan.step, plan.count)?;
                    self.sensed = before;
                    self.keep(plan, end)?;
                }
                self.locate(plan, after)
            }
        }
    }

    /// Largest estimate with which a try is kept [K].
    fn allowed(&self, plan: Plan) -> f64 {
        match plan.method {
            Method::Euler => self.limit.min(self.euler_rate * plan.step),
            Method::Rkl2 { .. } | Method::TrBdf2 => self.limit,
        }
    }

    /// What to try over at most `remaining` [s].
    fn plan(&mut self, remaining: f64) -> Plan {
        // Thermostats need a value between the ends, to see what turns back.
        let least: f64 = if self.schedule.thermostats.is_empty() { 1.0 } else { 2.0 };
        let stable = (remaining * self.rate).ceil().max(least);
        let euler = self.integrator != Integrator::Accurate && self.euler_pause == 0;
        if euler && stable <= f64::from(MOST_FUSED) {
            return Plan { method: Method::Euler, step: remaining / stable, count: stable as u32 };
        }
        let fused = f64::from(self.fused).max(least);
        let whole = (remaining / self.step).ceil().max(1.0);
        let (step, count) = if whole <= fused {
            let count = whole.max(least);
            (remaining / count, count)
        } else if whole <= 2.0 * fused {
            // Two tries of one length rather than a long one and a stub.
            (remaining / whole, (0.5 * whole).ceil())
        } else {
            (self.step, fused)
        };
        let stages = stages_for(step * self.rate);
        let most = if self.integrator == Integrator::Accurate { MOST_STAGES_ACCURATE } else { MOST_STAGES };
        self.implicit = stages > most[usize::from(self.implicit)];
        let method = if self.implicit { Method::TrBdf2 } else { Method::Rkl2 { stages } };
        Plan { method, step, count: count as u32 }
    }

    fn reject(&mut self, plan: Plan, error: f64) -> Result<(), ControlError<S::Error>> {
        self.series.rejected += 1;
        self.rate_age = RATE_AGE;
        if plan.method == Method::Euler {
            self.euler_pause = 64;
            return Ok(());
        }
        let factor = if error.is_finite() { (0.8 * (self.limit / error).cbrt()).clamp(0.05, 0.8) } else { 0.1 };
        self.step = plan.step * factor;
        self.fused = 1;
        if !error.is_finite() {
            self.check_hottest()?;
        }
        if self.since + self.step > self.since && self.step > SHORTEST {
            return Ok(());
        }
        let temperatures = self.stepper.temperatures()?;
        let coldest = temperatures.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1));
        let (node, temperature) = coldest.map_or((0, 0.0), |(node, temperature)| (node, *temperature));
        Err(ControlError::NoStep { time: self.now(), node, temperature })
    }

    /// Ends where a node is about to leave the range, which ever shorter sub-steps would only approach.
    fn check_hottest(&mut self) -> Result<(), ControlError<S::Error>> {
        let most = NEARLY_HOTTEST * self.stepper.hottest();
        let temperatures = self.stepper.temperatures()?;
        match temperatures.iter().position(|temperature| *temperature > most) {
            Some(node) => Err(ControlError::TooHot { time: self.now(), node, temperature: temperatures[node] }),
            None => Ok(()),
        }
    }

    /// Keeps the last try, after which it is `end` [s] since the heat was set where the plan reaches that.
    fn keep(&mut self, plan: Plan, end: f64) -> Result<(), ControlError<S::Error>> {
        self.stepper.keep()?;
        let span = plan.step * f64::from(plan.count);
        let then = self.since + span;
        self.since = if (then - end).abs() <= 1e-9 * span { end } else { then.min(end) };
        self.euler_pause = self.euler_pause.saturating_sub(1);
        let (place, stages) = match plan.method {
            Method::Euler => (0, 1),
            Method::Rkl2 { stages } => (1, stages),
            Method::TrBdf2 => (2, 2),
        };
        let fresh = Use { sub_steps: 0, time: 0.0, range: [plan.step; 2], stages: [stages; 2] };
        let used = self.series.uses[place].get_or_insert(fresh);
        used.sub_steps += u64::from(plan.count);
        used.time += span;
        used.range = [used.range[0].min(plan.step), used.range[1].max(plan.step)];
        used.stages = [used.stages[0].min(stages), used.stages[1].max(stages)];
        Ok(())
    }

    /// The next sub-step after a try that was kept.
    fn adapt(&mut self, plan: Plan, error: f64, end: f64) {
        if plan.method == Method::Euler {
            return;
        }
        let factor = (0.85 * (self.limit / error.max(1e-300)).cbrt()).clamp(0.3, 5.0);
        // A sub-step cut short by a break says little against the one before it.
        let cut = self.since >= end && plan.step < self.step;
        self.step = if cut { self.step.max(plan.step * factor) } else { plan.step * factor };
        self.series.first_step.get_or_insert(self.step);
        self.fused = if factor < 1.3 { (2 * self.fused).min(MOST_FUSED) } else { 1.max(self.fused / 2) };
    }

    /// Finds the first switch in the coming sub-step, at whose end the sensors are at `after`, and takes it.
    fn locate(&mut self, plan: Plan, after: Vec<f64>) -> Result<(), ControlError<S::Error>> {
        let thermostats = &self.schedule.thermostats;
        let t = self.since;
        let (mut low, mut high) = (0.0, plan.step);
        let (mut before, mut after) = (self.sensed.clone(), after);
        let mut last_was_high = None;
        let mut tries = 0;
        let mut at_high = false;
        loop {
            let narrow = high - low <= SWITCH_TIME || high - low <= 1e-13 * (self.since + high);
            if narrow && at_high {
                break;
            }
            let at = crossed(thermostats, &self.on, &before, &after);
            let straight = straight_crossing(thermostats, &self.on, &at, &before, &after);
            let width = high - low;
            // A straight line leaves one end where it is: each second time on one side, and each fourth time in any
            // case, the try goes beyond it or to the middle.
            let nudge = 0.4 * SWITCH_TIME / width;
            let share = match last_was_high {
                _ if narrow => 1.0,
                _ if tries % 4 == 3 => 0.5,
                Some(true) => straight - nudge.max(0.02 * straight.min(1.0 - straight)),
                _ => straight + nudge.max(0.02 * straight.min(1.0 - straight)),
            };
            let trial = if narrow { high } else { low + width * share.clamp(0.001, 0.999) };
            let method = self.method_for(plan.method, trial);
            let attempt = self.stepper.attempt(method, t, trial, 1)?;
            tries += 1;
            let is_high = !crossed(thermostats, &self.on, &self.sensed, &attempt.sensed).is_empty();
            at_high = is_high || narrow;
            if is_high || narrow {
                (high, after) = (trial, attempt.sensed);
            } else {
                (low, before) = (trial, attempt.sensed);
            }
            last_was_high = Some(is_high);
        }
        let at = crossed(thermostats, &self.on, &self.sensed, &after);
        let plan = Plan { method: self.method_for(plan.method, high), step: high, count: 1 };
        self.sensed = after;
        self.keep(plan, self.since + high)?;
        self.switch(&at)?;
        self.set_heat(self.now())
    }

    /// The same method with the stages that a shorter sub-step needs.
    fn method_for(&self, method: Method, step: f64) -> Method {
        match method {
            Method::Rkl2 { .. } => Method::Rkl2 { stages: stages_for(step * self.rate) },
            Method::Euler | Method::TrBdf2 => method,
        }
    }
}

impl fmt::Display for Integrator {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Self::Default => "default",
            Self::Cheap => "cheap",
            Self::Accurate => "accurate",
        })
    }
}
