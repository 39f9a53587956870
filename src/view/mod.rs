//! A page to look at a scene. The program sends images as numbers over a WebSocket, and the page colours and reads them.
//!
//! [`http`] answers the browser. [`worker`] is the thread that owns the simulation: it steps, draws and answers each page in turn. All pages share one
//! time, and each has a camera of its own. [`warm_up`] tells pages of the warm-up, and [`player`] moves the simulation forward and back. `docs/view.md` has the messages.

pub(crate) mod browser;
pub(crate) mod camera;
pub(crate) mod compare;
pub(crate) mod drawing;
pub(crate) mod hello;
pub(crate) mod http;
pub(crate) mod kept;
pub(crate) mod packet;
pub(crate) mod player;
pub(crate) mod probe_place;
pub(crate) mod request;
pub(crate) mod session;
pub(crate) mod sigma;
pub(crate) mod warm_up;
pub(crate) mod worker;
