//! The temperature service: a client says where the craft is, and gets temperatures, heat flows and the push of light. A request is a line of JSON, and so is its
//! answer.
//!
//! [`request`] reads lines, and [`session`] answers them. `docs/telemetry.md` is the reference for clients.

pub(crate) mod request;
pub(crate) mod session;

/// The port of the protocol.
pub(crate) const PORT: u16 = 5577;
