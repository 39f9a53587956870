//! Where the craft and its joints are, as something outside says.

use glam::{DQuat, DVec3};

use super::Simulation;
use crate::environment::placements::PlacementSample;
use crate::environment::scene_time::SceneTime;
use crate::environment::state::SLACK;
use crate::simulation::facade_error::SimulationError;

/// Where a craft is at a time, as something outside says. What is `None` is that of the scene's own orbit and attitude at this time.
///
/// All vectors are in the scene's inertial frame: GCRF on a trajectory, otherwise X to orbit noon and Z along the orbit normal.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Placement {
    /// Time since the start [s].
    pub time: f64,
    /// The craft from the planet's centre [m].
    pub position: Option<DVec3>,
    /// Its velocity [m/s], for the axes of the orbit frame.
    pub velocity: Option<DVec3>,
    /// The Sun from the planet's centre [m].
    pub sun: Option<DVec3>,
    /// Rotates body vectors into the inertial frame.
    pub inertial_from_body: Option<DQuat>,
}

impl Simulation {
    /// Says where the craft is from now on, instead of the scene's own orbit and attitude. Places come in order of time, and [`Simulation::step_to`] goes at
    /// most to the last one. Between two places, positions follow the arc round the planet, and attitudes the shorter arc.
    ///
    /// # Errors
    /// A value that is not finite, a position inside the planet, or a time that is not later than that of the last place.
    pub fn place(&mut self, placement: Placement) -> Result<(), SimulationError> {
        let place = self.filled(placement)?;
        let mut loads = self.prepared.loads.clone();
        let mut now = self.time;
        if !self.placed && !self.begun {
            now = place.time;
        } else if !self.placed && place.time > now + SLACK {
            // The way to the first place begins where the scene is.
            loads.place(self.filled(Placement { time: now, ..Placement::default() })?, now)?;
        } else if !self.placed && place.time < now - SLACK {
            return Err(SimulationError::Time { time: place.time, now });
        }
        loads.place(place, now)?;
        self.prepared.loads = loads;
        (self.placed, self.time) = (true, now);
        Ok(())
    }

    /// A placement with what the scene's own orbit and attitude say.
    fn filled(&self, placement: Placement) -> Result<PlacementSample, SimulationError> {
        let Placement { time, position, velocity, sun, inertial_from_body } = placement;
        SceneTime::new(time)?;
        let (model, mut own) = (self.own.sky_model(), None);
        if position.is_none() || sun.is_none() || inertial_from_body.is_none() {
            model.check(time, time).map_err(|error| self.sky_error(error))?;
            own = model.point(time);
        }
        let attitude = || DQuat::from_mat3(&model.sky(time).body_from_inertial.transpose()).normalize();
        Ok(PlacementSample {
            time,
            position: position.or(own.map(|point| point.position)).unwrap_or(DVec3::NAN),
            velocity,
            sun: sun.or(own.map(|point| point.sun)).unwrap_or(DVec3::NAN),
            inertial_from_body: inertial_from_body.unwrap_or_else(attitude),
        })
    }

    /// Holds a joint at a position [rad or m] from the present time on, whatever its rate. Names are those of glTF nodes ([`Simulation::joints`]).
    ///
    /// # Errors
    /// There is no such joint, it plays an animation, or the position lies outside its limits.
    pub fn set_joint(&mut self, name: &str, position: f64) -> Result<(), SimulationError> {
        self.prepared.loads.set_joint(name, position, self.time)?;
        self.turned = true;
        Ok(())
    }

    /// Checks positions of joints [rad or m] by their names, without a change.
    ///
    /// # Errors
    /// As for [`Simulation::set_joint`].
    pub(crate) fn check_joints<'a>(
        &self,
        mut positions: impl Iterator<Item = (&'a String, &'a f64)>,
    ) -> Result<(), SimulationError> {
        let joints = self.prepared.loads.joints();
        Ok(positions.try_for_each(|(name, position)| joints.held(name, *position).map(|_| ()))?)
    }

    /// Name and present position of each joint [rad or m].
    pub fn joints(&self) -> Vec<(String, f64)> {
        let names = self.prepared.loads.joints().joints().iter().map(|joint| joint.name.clone());
        names.zip(self.prepared.loads.joints_at(self.time).0).collect()
    }
}
