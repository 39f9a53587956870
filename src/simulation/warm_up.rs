//! The warm-up: brings engine and check to the state at time 0.

use std::sync::atomic::{AtomicBool, Ordering};

use super::check::Check;
use super::engine::{Engine, EngineError};
use super::forward::forward;
use super::keep::{Keep, KeepNothing};
use super::orbit_end::{BaseOrbit, Displacement, OrbitEnd, PassRun, with_halvings};
use super::orbits::{Orbits, Periodic};
use super::parts::Passing;
use super::prepare::Prepared;
use super::state::BetweenSteps;
use crate::gpu::host_heap::give_back_freed_memory;
use crate::gpu::layout::FUSED_STEPS;
use crate::scene::Initial;
use crate::trace::{span, timed};

/// Steps of a warm-up after which its state may be saved: a multiple of the steps of a dispatch, or fewer with a network, whose steps take longer.
const STEPS_AT_ONCE: [u32; 2] = [4 * FUSED_STEPS as u32, 4];

/// The saved state of a warm-up.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct WarmUpState {
    pub(crate) state: BetweenSteps,
    /// Of a periodic warm-up, the orbits so far.
    pub(crate) orbits: Option<Orbits>,
}

/// Brings the engine, and the check where there is one, to the state at time 0. Returns the result of a periodic warm-up.
///
/// # Errors
/// A call that fails.
pub fn start(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    check: Option<&mut Check>,
    stop: &AtomicBool,
    progress: &mut dyn FnMut(),
) -> Result<Option<Periodic>, EngineError> {
    WarmUp { prepared, engine, check, stop, progress, keep: &mut KeepNothing }.run(None)
}

/// Brings the engine to the periodic state at time 0, from a state near it at time 0. A scene that asks for no periodic state has its usual warm-up.
///
/// # Errors
/// A call that fails.
pub(crate) fn start_near(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    near: &BetweenSteps,
    stop: &AtomicBool,
    progress: &mut dyn FnMut(),
) -> Result<Option<Periodic>, EngineError> {
    let saved = prepared
        .scene
        .time
        .periodic
        .map(|tolerance| WarmUpState { state: near.clone(), orbits: Some(Orbits::new(tolerance, false)) });
    WarmUp { prepared, engine, check: None, stop, progress, keep: &mut KeepNothing }.run(saved.as_ref())
}

/// Takes an engine at its periodic state at time 0 through one more orbit. Returns `None` where it was stopped.
///
/// # Errors
/// A call that fails.
pub(crate) fn pass_base_orbit(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    stop: &AtomicBool,
) -> Result<Option<BaseOrbit>, EngineError> {
    let (state, start) = (BetweenSteps::capture(0, engine, None)?, OrbitEnd::new(engine)?);
    let (_, halvings) = with_halvings(engine, |engine| {
        let (progress, keep): (&mut dyn FnMut(), &mut dyn Keep<EngineError>) = (&mut || (), &mut KeepNothing);
        WarmUp { prepared, engine, check: None, stop, progress, keep }.orbit(false)
    })?;
    let end = OrbitEnd::new(engine)?;
    Ok((!stop.load(Ordering::Relaxed)).then_some(BaseOrbit { state, start, end, halvings, run_mean: None }))
}

/// Brings the engine of a scene with other values to time 0, as far from the scene as it is as these values make it. A network and structures begin moved by
/// so many times a displacement. Where the orbit of the scene as it is was its run, `pass` makes each orbit. Returns `None` where the state of the scene as it is does not fit: a
/// network may take another plan with other values.
///
/// # Errors
/// A call that fails, or an error of `pass`.
pub(crate) fn start_beside<E: From<EngineError>>(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    (base, shift): (&BaseOrbit, Option<(&Displacement, f64)>),
    (tolerance, stop): (f64, &AtomicBool),
    pass: PassRun<'_, E>,
) -> Result<Option<Periodic>, E> {
    if base.restore(engine, shift).is_err() {
        return Ok(None);
    }
    let (progress, keep): (&mut dyn FnMut(), &mut dyn Keep<E>) = (&mut || (), &mut KeepNothing);
    let mut warm_up = WarmUp { prepared, engine, check: None, stop, progress, keep };
    let went = warm_up.pass_orbits(tolerance, Some(&Orbits::new(tolerance, false)), Some((base, pass)))?;
    give_back_freed_memory();
    Ok(went)
}

/// A warm-up of an engine and its check.
pub(crate) struct WarmUp<'a, E> {
    pub(crate) prepared: &'a Prepared,
    pub(crate) engine: &'a mut dyn Engine,
    pub(crate) check: Option<&'a mut Check>,
    /// Ends the warm-up.
    pub(crate) stop: &'a AtomicBool,
    /// Is called for each step, or for each orbit of a periodic warm-up.
    pub(crate) progress: &'a mut dyn FnMut(),
    /// Takes states on the way, the last one where the warm-up is stopped.
    pub(crate) keep: &'a mut dyn Keep<E>,
}

impl<E: From<EngineError>> WarmUp<'_, E> {
    /// Warms up, from the state of an earlier part of the run where there is one. Returns the result of a periodic warm-up.
    ///
    /// # Errors
    /// A call that fails, or the error of `keep`.
    pub(crate) fn run(&mut self, earlier: Option<&WarmUpState>) -> Result<Option<Periodic>, E> {
        match earlier {
            Some(saved) => saved.state.restore(self.engine, self.check.as_deref_mut())?,
            None => self.settle()?,
        }
        let went = match self.prepared.scene.time.periodic {
            Some(tolerance) => self.pass_orbits(tolerance, earlier.and_then(|saved| saved.orbits.as_ref()), None)?,
            None => {
                self.pass(earlier.map_or(0, |saved| saved.state.next))?;
                None
            }
        };
        if let Some(check) = self.check.as_deref_mut() {
            let _starts = span("starting the check");
            if let Some(temperatures) = self.engine.network_temperatures()?
                && let Some(network) = self.engine.network()
            {
                check.start_network(&temperatures, network.on());
            }
            check.begin_halves(self.engine)?;
        }
        Ok(went)
    }

    /// Brings every node to the scene's initial state.
    fn settle(&mut self) -> Result<(), EngineError> {
        let _settles = span("settling");
        match self.prepared.scene.initial {
            Initial::Balance => {
                let from = self.time(0);
                let load = timed("finding the loads", || self.prepared.loads.step_load(from, from));
                self.engine.settle(&load, from)?;
                if let Some(check) = self.check.as_deref_mut() {
                    check.settle(&load, from);
                }
            }
            Initial::Temperature(temperature) => {
                self.engine.settle_at(temperature, self.prepared.nodes.vertex_of_node.len())?;
                if let Some(check) = self.check.as_deref_mut() {
                    check.settle_at(temperature);
                }
            }
        }
        Ok(())
    }

    /// Time at which a step begins [s].
    fn time(&self, number: u32) -> f64 {
        self.prepared.scene.time.warm_up_step * (f64::from(number) - f64::from(self.prepared.warm_up_steps()))
    }

    /// Passes through a fixed number of steps, from `first` on.
    fn pass(&mut self, first: u32) -> Result<(), E> {
        (0..first).for_each(|_| (self.progress)());
        let _warms_up = span("warm-up");
        let steps = self.prepared.warm_up_steps();
        let at_once = STEPS_AT_ONCE[usize::from(self.prepared.network.is_some())];
        let length = self.prepared.scene.time.warm_up_step / self.prepared.scene.time.step;
        let mut done = first;
        while done < steps {
            let end = done.saturating_add(at_once).min(steps);
            let passing: Vec<_> = (done..end)
                .map(|number| Passing { start: self.time(number), end: self.time(number + 1), steps: length })
                .collect();
            let mut count = 0;
            let mut told = || {
                count += 1;
                (self.progress)();
            };
            let check = self.check.as_deref_mut();
            let went = forward(self.prepared, self.engine, check, passing, self.stop, &mut told)?;
            done += count;
            if !went || (done < steps && self.keep.wants(done)) {
                self.engine.wait()?;
                self.keep.take(done, None, self.engine, self.check.as_deref_mut())?;
                self.keep.save()?;
            }
            if !went {
                return Ok(());
            }
        }
        Ok(())
    }
}
