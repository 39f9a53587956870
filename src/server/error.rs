//! Why the server does not start, why a connection ends, and why a request has no image.

use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;

use crate::environment::placements::PlaceError;
use crate::environment::scene_time::TimeError;
use crate::host::OverBudget;
use crate::simulation::facade_error::SimulationError;
use crate::simulation::prepare_error::PrepareError;

/// Why the server does not start.
#[derive(Debug, thiserror::Error)]
pub enum ServerError {
    /// Other machines can reach the address.
    #[error(
        "{0} can be reached from other machines, and the protocol has no authentication: whoever reaches it may use this program; --allow-remote \
         listens there all the same"
    )]
    Remote(SocketAddr),
    /// The system does not listen at the address.
    #[error("can not listen at {0}: {1}")]
    Listen(SocketAddr, io::Error),
    /// Two scenes have the same name.
    #[error("the name '{name}' means both {one} and {other}; write NAME=PATH", one = one.display(), other = other.display())]
    Twice {
        /// The name.
        name: String,
        /// A scene file.
        one: PathBuf,
        /// Another one.
        other: PathBuf,
    },
    /// A scene can not be used.
    #[error(transparent)]
    Scene(#[from] PrepareError),
    /// The scene has no sensor, which the chosen picture needs.
    #[error("the scene {0} has no section [sensor], whose numbers --picture sensor shows")]
    NoSensor(PathBuf),
    /// The file of the log can not be written.
    #[error("can not write the log {}: {}", .0.display(), .1)]
    Log(PathBuf, io::Error),
}

/// Why a connection ends.
#[derive(Debug, thiserror::Error)]
pub enum ConnectionEnd {
    /// The client has closed it.
    #[error("the client has closed the connection")]
    Closed,
    /// The server stops.
    #[error("the server stops")]
    Stopped,
    /// The session was idle, and another client needs its place.
    #[error("it was idle, and another client takes its place")]
    GaveWay,
    /// The client sends or takes too slowly.
    #[error("nothing came within {0} s")]
    TimeOut(u64),
    /// The bytes are none of the protocol.
    #[error("malformed: {0}")]
    Malformed(String),
    /// The system ends it.
    #[error("{0}")]
    Io(#[from] io::Error),
}

/// Why a request is refused. The connection goes on.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Refusal {
    #[error("{0}")]
    Reason(String),
    /// The simulation does not do it.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// A place of the craft can not be used.
    #[error(transparent)]
    Place(#[from] PlaceError),
    /// A number that is no time.
    #[error(transparent)]
    Time(#[from] TimeError),
    /// The memory does not suffice.
    #[error(transparent)]
    Memory(#[from] OverBudget),
    /// The call took too long, or nobody waits for it any more.
    #[error("the call was stopped, because it took too long or nobody waits for it")]
    Stopped,
}

impl Refusal {
    pub(crate) fn because(reason: impl Into<String>) -> Self {
        Self::Reason(reason.into())
    }
}
