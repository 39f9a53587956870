//! When shadows are found anew: not before the Sun has moved far enough against the craft.

use glam::DVec3;

use super::SunView;
use crate::environment::TickLoad;

/// The box that casts shadows, how finely it is looked at, and the direction that it was last looked at from.
#[derive(Debug, Clone, PartialEq)]
pub struct Redraw {
    /// Lower and upper corner of what casts shadows [m].
    pub bounds: [DVec3; 2],
    /// Texels each way.
    pub resolution: u32,
    /// Angle of the Sun against the craft after which shadows are found anew [rad].
    pub angle: f64,
    /// Direction of the Sun that they were last found for, body frame.
    pub found_for: Option<DVec3>,
}

impl Redraw {
    /// The Sun's view where shadows must be found anew for a load; `None` where the last ones still hold, or where it is
    /// dark. A tick has one direction: the mean of its sunlight.
    pub fn view(&mut self, load: &TickLoad) -> Option<SunView> {
        let light: DVec3 = load.sun.iter().map(|sample| sample.direction * sample.flux).sum();
        let sun = light.try_normalize()?;
        if self.found_for.is_some_and(|last| last.angle_between(sun) <= self.angle) {
            return None;
        }
        self.found_for = Some(sun);
        Some(SunView::new(sun, self.bounds, self.resolution))
    }
}
