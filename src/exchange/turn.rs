//! How far joints have turned.

use glam::{DAffine3, DQuat};

/// Largest turn of a joint between poses [rad]. A way counts as a turn about the origin, over a metre at least.
pub(crate) fn turned(before: &[DAffine3], now: &[DAffine3]) -> f64 {
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
