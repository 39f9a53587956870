//! The protocol of Airbus' client of SurRender 8: hashes in Qt's serialisation over TCP.
//!
//! [`values`] reads and writes them, [`stage`] holds camera and objects, [`calls`] says which calls do something, and [`session`] answers them.
//! `docs/serve.md` describes the behaviour for a script.

pub(crate) mod calls;
pub(crate) mod session;
pub(crate) mod stage;
pub(crate) mod values;

pub use session::talk_surrender;

/// The port that scripts connect to by default.
pub(crate) const PORT: u16 = 5151;
