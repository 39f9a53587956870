//! What was found for poses of the joints, kept for when they come back.

use glam::{DAffine3, DQuat};

use crate::saved::{Saved, SavedError};

/// A turn below this is rounding [rad].
const STILL: f64 = 1e-9;
/// Most poses that are kept. The oldest makes room.
const MOST: usize = 64;

/// Findings for poses of the joints. One holds for all poses within an angle of its own.
#[derive(Debug, Clone)]
pub(super) struct Posed<T> {
    angle: f64,
    /// Poses and what was found for them. After a restart it is found anew when it is needed.
    known: Vec<(Vec<DAffine3>, Option<T>)>,
    now: usize,
}

impl<T> Posed<T> {
    /// Nothing is found yet. Findings hold within `angle` [rad].
    pub fn new(angle: f64) -> Self {
        Self { angle, known: Vec::new(), now: 0 }
    }

    /// Finds what holds for poses, by `find` where nothing known does. Returns it where it is not what held before.
    ///
    /// # Errors
    /// Those of `find`.
    pub fn turn<E>(
        &mut self,
        poses: &[DAffine3],
        find: impl FnOnce(&[DAffine3]) -> Result<T, E>,
    ) -> Result<Option<&T>, E> {
        let limit = self.angle.max(STILL);
        let held = self.known.get(self.now).is_some_and(|(own, found)| found.is_some() && turned(own, poses) <= limit);
        if held {
            return Ok(None);
        }
        let turns = self.known.iter().map(|(own, _)| turned(own, poses)).enumerate();
        let nearest = turns.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, turn)| *turn <= limit);
        self.now = match nearest {
            Some((place, _)) => place,
            None => {
                if self.known.len() >= MOST {
                    self.known.remove(0);
                }
                self.known.push((poses.to_vec(), None));
                self.known.len() - 1
            }
        };
        let (own, found) = &mut self.known[self.now];
        if found.is_none() {
            *found = Some(find(own)?);
        }
        Ok(found.as_ref())
    }

    /// What holds now.
    pub fn found(&self) -> Option<&T> {
        self.known.get(self.now)?.1.as_ref()
    }

    /// The poses, without what was found for them.
    pub fn save(&self) -> Saved {
        let mut saved = Saved::default();
        saved.put("count", &[self.known.len() as u64, self.now as u64]);
        for (number, (poses, _)) in self.known.iter().enumerate() {
            saved.put(format!("pose.{number}"), &poses.iter().map(DAffine3::to_cols_array).collect::<Vec<_>>());
        }
        saved
    }

    /// Takes what `save` gave, and finds what held then.
    ///
    /// # Errors
    /// Lists of another kind, or those of `find`.
    pub fn restore<E: From<SavedError>>(
        &mut self,
        saved: &Saved,
        find: impl FnOnce(&[DAffine3]) -> Result<T, E>,
    ) -> Result<Option<&T>, E> {
        let [count, now] = saved.array::<u64, 2>("count")?;
        self.known.clear();
        for number in 0..count.min(MOST as u64) {
            let poses: Vec<[f64; 12]> = saved.list(&format!("pose.{number}"))?;
            self.known.push((poses.iter().map(DAffine3::from_cols_array).collect(), None));
        }
        self.now = now as usize;
        match self.known.get_mut(self.now) {
            Some((poses, found)) => Ok(Some(found.insert(find(poses)?))),
            None => Ok(None),
        }
    }
}

/// Largest turn of a joint between poses [rad]. A way counts as a turn about the origin, over a metre at least.
fn turned(before: &[DAffine3], now: &[DAffine3]) -> f64 {
    if before.len() != now.len() {
        return f64::INFINITY;
    }
    let turn = |(a, b): (&DAffine3, &DAffine3)| {
        let turn = DQuat::from_mat3(&(a.matrix3.transpose() * b.matrix3)).normalize();
        let angle = 2.0 * turn.xyz().length().atan2(turn.w.abs());
        angle.max(a.translation.distance(b.translation) / (1.0 + a.translation.length()))
    };
    before.iter().zip(now).map(turn).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;

    #[test]
    fn what_was_found_holds_within_its_angle_and_when_the_pose_comes_back() {
        let mut posed = Posed::new(0.1);
        let mut count = 0;
        let mut anew = Vec::new();
        for angle in [0.0, 0.05, 0.2, 0.25, 0.02, 0.21, 0.4] {
            let poses = [DAffine3::IDENTITY, DAffine3::from_rotation_z(angle)];
            let Ok(found) = posed.turn(&poses, |_| {
                count += 1;
                Ok::<_, Infallible>(count)
            });
            anew.push(found.copied());
        }
        assert_eq!(anew, [Some(1), None, Some(2), None, Some(1), Some(2), Some(3)]);
        let saved = posed.save();
        let mut again = Posed::new(0.1);
        let restored = again.restore(&saved, |poses| Ok::<_, SavedError>(poses[1].matrix3.x_axis.y));
        assert!(restored.expect("a saved state").is_some_and(|sine| (sine - 0.4f64.sin()).abs() < 1e-12));
        assert!(turned(&[], &[DAffine3::IDENTITY]).is_infinite());
    }
}
