//! The server: simulators in other programs drive scenes and fetch images in the protocols that they speak already, or temperatures.
//!
//! [`listen`] accepts connections and runs each on a thread of its own. A protocol ([`vizard`], [`surrender`], [`telemetry`]) is a thin adapter: it reads requests,
//! moves a [`craft`] and answers with a [`picture`] or with numbers. [`scenes`] says which names lead to which scene files: no client can name another file. [`connection`]
//! bounds how long a client may take and how much it may send, and [`sessions`] who gives way and who computes.

pub(crate) mod connection;
pub(crate) mod course;
pub(crate) mod craft;
pub(crate) mod error;
pub(crate) mod listen;
pub(crate) mod log;
pub(crate) mod picture;
pub(crate) mod scenes;
pub(crate) mod sessions;
pub(crate) mod surrender;
pub(crate) mod telemetry;
pub(crate) mod vizard;
