//! What Airbus' SurRender client sends.

use super::connection::Connection;
use super::error::End;
use super::listen::Server;

/// The port that scripts connect to by default.
pub const PORT: u16 = 5151;

/// Serves a client up to its end.
pub fn talk(_: &Server, _: &mut Connection, _: &str) -> End {
    End::Closed
}
