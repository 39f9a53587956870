//! The schema of the messages: the fields that are used. Other fields are skipped.
//!
//! The schema is written from measurements of the messages of Basilisk 2.12.1 (`docs/serve.md`). The messages are proto3, so a number that is zero is
//! absent.

use prost::Message;

#[derive(Clone, PartialEq, Message)]
pub(crate) struct MessageTime {
    /// Number of the simulation's step, from 1.
    #[prost(int64, tag = "1")]
    pub(crate) frame: i64,
    /// Time since the start [ns].
    #[prost(double, tag = "2")]
    pub(crate) elapsed: f64,
}

/// Date of the start, UTC.
#[derive(Clone, PartialEq, Message)]
pub(crate) struct Epoch {
    #[prost(int32, tag = "1")]
    pub(crate) year: i32,
    /// Month, from 1.
    #[prost(int32, tag = "2")]
    pub(crate) month: i32,
    #[prost(int32, tag = "3")]
    pub(crate) day: i32,
    #[prost(int32, tag = "4")]
    pub(crate) hours: i32,
    #[prost(int32, tag = "5")]
    pub(crate) minutes: i32,
    #[prost(double, tag = "6")]
    pub(crate) seconds: f64,
}

/// A planet, a moon or the Sun.
#[derive(Clone, PartialEq, Message)]
pub(crate) struct Body {
    /// Name, such as `earth` or `sun`.
    #[prost(string, tag = "1")]
    pub(crate) name: String,
    /// Position [m], inertial axes.
    #[prost(double, repeated, tag = "2")]
    pub(crate) position: Vec<f64>,
    /// Velocity [m/s].
    #[prost(double, repeated, tag = "3")]
    pub(crate) velocity: Vec<f64>,
    /// Gravitational parameter [km3/s2].
    #[prost(double, tag = "5")]
    pub(crate) mu: f64,
    /// Equatorial radius [km].
    #[prost(double, tag = "6")]
    pub(crate) radius: f64,
}

/// A spacecraft, or a part of one.
#[derive(Clone, PartialEq, Message)]
pub(crate) struct Spacecraft {
    /// Name: the script's `ModelTag`.
    #[prost(string, tag = "1")]
    pub(crate) name: String,
    /// Position of the body frame's origin [m].
    #[prost(double, repeated, tag = "2")]
    pub(crate) position: Vec<f64>,
    /// Velocity [m/s].
    #[prost(double, repeated, tag = "3")]
    pub(crate) velocity: Vec<f64>,
    /// Modified Rodrigues parameters from the inertial axes to the body axes.
    #[prost(double, repeated, tag = "4")]
    pub(crate) rotation: Vec<f64>,
    /// Name of the craft of which this is a part.
    #[prost(string, tag = "19")]
    pub(crate) parent: String,
}

#[derive(Clone, PartialEq, Message)]
pub(crate) struct MessageCamera {
    /// Number by which an image is asked for.
    #[prost(int64, tag = "1")]
    pub(crate) id: i64,
    /// Name of the craft that carries it.
    #[prost(string, tag = "2")]
    pub(crate) parent: String,
    /// Vertical field of view, edge to edge [deg].
    #[prost(double, tag = "3")]
    pub(crate) field_of_view: f64,
    /// Width and height [px].
    #[prost(int64, repeated, tag = "4")]
    pub(crate) resolution: Vec<i64>,
    /// Position in the body frame of the craft that carries it [m].
    #[prost(double, repeated, tag = "7")]
    pub position: Vec<f64>,
    /// Modified Rodrigues parameters from the body axes to the visualiser's camera axes.
    #[prost(double, repeated, tag = "8")]
    pub(crate) direction: Vec<f64>,
    /// 0 for a picture, 1 for depth.
    #[prost(int32, tag = "16")]
    pub(crate) render_mode: i32,
    /// Near and far plane of the picture of depth [m].
    #[prost(double, repeated, tag = "17")]
    pub(crate) depth_planes: Vec<f64>,
}

/// A model that the script names for some craft.
#[derive(Clone, PartialEq, Message)]
pub(crate) struct CustomModel {
    /// Any text: here the name of a scene.
    #[prost(string, tag = "1")]
    pub(crate) path: String,
    #[prost(string, repeated, tag = "2")]
    pub(crate) bodies: Vec<String>,
    /// Place of the model's origin in the craft's body frame [m].
    #[prost(double, repeated, tag = "3")]
    pub(crate) offset: Vec<f64>,
    /// Turns of the model about the craft's x, y and z [deg].
    #[prost(double, repeated, tag = "4")]
    pub(crate) rotation: Vec<f64>,
    /// Scale along the craft's x, y and z.
    #[prost(double, repeated, tag = "5")]
    pub(crate) scale: Vec<f64>,
}

/// Settings of the visualiser.
#[derive(Clone, PartialEq, Message)]
pub(crate) struct Settings {
    #[prost(message, repeated, tag = "12")]
    pub(crate) models: Vec<CustomModel>,
}

/// Settings of a run under way.
#[derive(Clone, PartialEq, Message)]
pub(crate) struct LiveSettings {
    /// Whether the run ends with this message.
    #[prost(bool, tag = "3")]
    pub(crate) terminate: bool,
}

/// Everything that a step of the simulation shows.
#[derive(Clone, PartialEq, Message)]
pub(crate) struct VizMessage {
    #[prost(message, optional, tag = "1")]
    pub(crate) time: Option<MessageTime>,
    #[prost(message, repeated, tag = "2")]
    pub(crate) bodies: Vec<Body>,
    #[prost(message, repeated, tag = "3")]
    pub(crate) spacecraft: Vec<Spacecraft>,
    #[prost(message, repeated, tag = "4")]
    pub(crate) cameras: Vec<MessageCamera>,
    /// Settings, not in every message.
    #[prost(message, optional, tag = "7")]
    pub(crate) settings: Option<Settings>,
    /// Date of the start, in the first message.
    #[prost(message, optional, tag = "8")]
    pub(crate) epoch: Option<Epoch>,
    /// Settings of a run under way.
    #[prost(message, optional, tag = "10")]
    pub(crate) live: Option<LiveSettings>,
}

/// Three numbers as a vector. `None` unless there are three finite numbers. An absent list is zero, as for all numbers.
pub(crate) fn vector(list: &[f64]) -> Option<glam::DVec3> {
    let vector = match list {
        [] => glam::DVec3::ZERO,
        [x, y, z] => glam::DVec3::new(*x, *y, *z),
        _ => return None,
    };
    vector.is_finite().then_some(vector)
}
