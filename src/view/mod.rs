//! A page to look at a scene. The program sends images as numbers over a WebSocket, and the page colours and reads them.
//!
//! [`http`] answers the browser. [`worker`] is the thread that owns the simulation: it steps, draws and answers each page in turn. All pages share one
//! time, and each has a camera of its own. [`player`] moves the simulation forward and back. `docs/view.md` has the messages.

pub mod browser;
pub mod camera;
pub mod compare;
pub mod drawing;
pub mod hello;
pub mod http;
pub mod kept;
pub mod packet;
pub mod player;
pub mod request;
pub mod session;
pub mod worker;
