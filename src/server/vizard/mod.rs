//! The protocol between Basilisk's `vizInterface` and its visualiser, Vizard: ZeroMQ requests, protobuf messages, images back as PNG.
//!
//! [`zmtp`] is the transport, [`messages`] the schema, [`frames`] the geometry, [`unserved`] tells fields without effect, [`world`] takes states of craft, planet and Sun out of a message, and
//! [`session`] answers requests. `docs/serve.md` lists the duties of a script.

pub(crate) mod frames;
pub(crate) mod messages;
pub(crate) mod session;
pub(crate) mod unserved;
pub(crate) mod world;
pub(crate) mod zmtp;

pub use session::talk_vizard;

/// The port that scripts connect to by default.
pub(crate) const PORT: u16 = 5556;
