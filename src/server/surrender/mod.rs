//! What Airbus' client of SurRender 8 sends: hashes in Qt's serialisation over TCP.
//!
//! [`values`] reads and writes them, [`stage`] holds camera and objects, [`calls`] says which calls do something, and [`session`] answers them.
//! `docs/serve.md` says what a script sees.

pub mod calls;
pub mod session;
pub mod stage;
pub mod values;

pub use session::talk;

/// The port that scripts connect to by default.
pub const PORT: u16 = 5151;
