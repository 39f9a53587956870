//! The whole network of a scene in f64, beside the run.

use std::collections::HashMap;
use std::sync::Arc;

use crate::environment::StepLoad;
use crate::environment::shadow::Shadows;
use crate::saved::Saved;
use crate::simulation::engine::EngineError;
use crate::simulation::network::{NetworkRun, SceneNetwork};
use crate::simulation::prepare::Prepared;
use crate::thermal::incident::{IncidentFunction, incident};
use crate::thermal::reference::Reference;

/// The network in f64, with the loads of all its nodes.
pub(super) struct NetworkCheck {
    pub run: NetworkRun,
    pub loads: Reference<IncidentFunction>,
    pub shadows: Option<Shadows>,
    pub slots: Vec<usize>,
    /// Temperatures of the sample's network nodes [K], by slot.
    pub temperatures: HashMap<usize, f64>,
    /// Whether it waits for the state of the device at time 0.
    pub waits: bool,
    pub failed: Option<String>,
}

impl NetworkCheck {
    /// A network that is not yet started. `slots` are its drawn nodes.
    pub fn new(prepared: &Prepared, scene: &Arc<SceneNetwork>, slots: Vec<usize>) -> Self {
        let loads = slots.iter().map(|slot| prepared.nodes.reference_node(*slot)).collect();
        Self {
            run: NetworkRun::tight(scene),
            loads: Reference::new(loads, prepared.materials.clone(), incident as IncidentFunction)
                .with_joints(joints(prepared, &slots)),
            shadows: prepared.shadows(slots.iter().copied()),
            slots,
            temperatures: HashMap::new(),
            waits: false,
            failed: None,
        }
    }

    /// Heat of every network node under a load [W].
    pub fn heat(&mut self, load: &StepLoad) -> Vec<f64> {
        self.loads.find_shadows(&mut self.shadows, load);
        let absorbed: HashMap<usize, f64> = self.slots.iter().copied().zip(self.loads.absorbed(load)).collect();
        self.run.scene().heat(|slot| absorbed[&slot])
    }

    /// Advances under a load from `start` [s] for `length` [s].
    pub fn step(&mut self, load: &StepLoad, start: f64, length: f64) {
        let heat = self.heat(load);
        let done = self.run.step(heat, start, length);
        self.after(done);
    }

    /// The state between two steps.
    ///
    /// # Errors
    /// A call that fails.
    pub fn save(&mut self) -> Result<Saved, EngineError> {
        let mut saved = Saved::default();
        saved.put_all("run", self.run.save());
        saved.put_all("loads", self.loads.save());
        if let Some(shadows) = &self.shadows {
            saved.put_all("shadows", shadows.save());
        }
        let mut known: Vec<(u64, f64)> = self.temperatures.iter().map(|(slot, t)| (*slot as u64, *t)).collect();
        known.sort_unstable_by_key(|(slot, _)| *slot);
        saved.put("slots", &known.iter().map(|(slot, _)| *slot).collect::<Vec<_>>());
        saved.put("temperatures", &known.iter().map(|(_, temperature)| *temperature).collect::<Vec<_>>());
        saved.put_flags("waits", &[self.waits]);
        if let Some(reason) = &self.failed {
            saved.put_text("failed", reason);
        }
        Ok(saved)
    }

    /// Takes what `save` gave.
    ///
    /// # Errors
    /// A state of another scene.
    pub fn restore(&mut self, saved: &Saved) -> Result<(), EngineError> {
        self.run.restore(&saved.part("run"), usize::MAX)?;
        self.loads.restore(&saved.part("loads"))?;
        if let Some(shadows) = &mut self.shadows {
            shadows.restore(&saved.part("shadows"))?;
        }
        let slots: Vec<u64> = saved.list("slots")?;
        let temperatures: Vec<f64> = saved.list_of("temperatures", slots.len())?;
        self.temperatures = slots.into_iter().map(|slot| slot as usize).zip(temperatures).collect();
        self.waits = saved.flags("waits")?.first() == Some(&true);
        self.failed = if saved.has("failed") { Some(saved.text("failed")?) } else { None };
        Ok(())
    }

    /// Takes the temperatures after a call, or why it failed.
    pub fn after(&mut self, done: Result<(), EngineError>) {
        match done {
            Ok(()) => self.take_temperatures(),
            Err(error) => self.failed = Some(error.to_string()),
        }
    }

    /// Takes the temperatures of the network.
    pub fn take_temperatures(&mut self) {
        let known = &mut self.temperatures;
        self.run.scene().scatter(&self.run.temperatures(), |slot, temperature| {
            known.insert(slot, temperature);
        });
    }
}

/// Joints of some nodes. Empty where nothing moves.
pub(super) fn joints(prepared: &Prepared, slots: &[usize]) -> Vec<u32> {
    match prepared.joints() {
        1 => Vec::new(),
        _ => prepared.joints_of(slots.iter().copied()),
    }
}
