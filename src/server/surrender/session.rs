//! A session: the calls of one client, one after the other, and their answers.
//!
//! Every call is answered with its name, because the client waits for some of them and skips answers that it does not wait for. A message goes before the
//! answer: the client raises an exception at a message with `[error]`, and prints a message with `[warning]`.

use std::collections::BTreeSet;

use super::calls::{FORMAL, WITHOUT_EFFECT};
use super::stage::SurrenderStage;
use super::values::{Hash, Value, read, write_value};
use crate::environment::scene_time::SceneTime;
use crate::output::apparent::Apparent;
use crate::scene::Scene;
use crate::server::connection::Connection;
use crate::server::craft::{ServedCraft, nearest};
use crate::server::error::{ConnectionEnd, Refusal};
use crate::server::listen::Server;
use crate::server::picture::{DEFAULT_RANGE, grey};
use crate::server::sessions::Session;
use crate::simulation::image::Image;

const MOST_CRAFT: usize = 8;
/// File of a sphere's shape.
const SPHERE: &str = "sphere.shp";
/// The call by which a script steps the temperatures: `client.runLuaCode("isotherm.step_to(600)")`.
const STEP_TO: &str = "isotherm.step_to(";

/// Serves a client up to its end.
pub fn talk_surrender(server: &Server, connection: &mut Connection, client: &str) -> ConnectionEnd {
    let mut session = SurrenderSession {
        server,
        client,
        session: connection.session(),
        stage: SurrenderStage::default(),
        image: None,
        apparent: None,
        time: server.time,
        warned: BTreeSet::new(),
    };
    loop {
        let answered = read(connection).and_then(|call| {
            connection.greeted();
            session.answer(connection, &call)
        });
        if let Err(end) = answered {
            return end;
        }
    }
}

struct SurrenderSession<'s> {
    server: &'s Server,
    client: &'s str,
    session: &'s Session,
    stage: SurrenderStage,
    /// The last picture.
    image: Option<Image>,
    /// Brightness temperatures of its band.
    apparent: Option<Apparent>,
    /// Time of the scenes' own orbits [s].
    time: f64,
    /// Calls that change nothing. The client knows them.
    warned: BTreeSet<String>,
}

/// Names and values of an answer, beside the name of the call.
type Answer = Result<Vec<(&'static str, Value)>, Refusal>;

struct CallArguments<'c>(&'c Hash);

impl CallArguments<'_> {
    fn value<T>(&self, key: &str, what: &str, take: impl Fn(&Value) -> Option<T>) -> Result<T, Refusal> {
        let taken = self.0.get(key).and_then(take);
        taken.ok_or_else(|| Refusal::because(format!("'{key}' must be {what}")))
    }

    fn number(&self, key: &str) -> Result<f64, Refusal> {
        self.value(key, "a number", Value::number)
    }

    fn text(&self, key: &str) -> Result<&str, Refusal> {
        match self.0.get(key) {
            Some(Value::Text(text)) => Ok(text),
            _ => Err(Refusal::because(format!("'{key}' must be a text"))),
        }
    }

    fn numbers<const N: usize>(&self, key: &str) -> Result<[f64; N], Refusal> {
        self.value(key, &format!("a list of {N} numbers"), Value::numbers)
    }

    fn side(&self, key: &str) -> Result<u32, Refusal> {
        let side = self.number(key)?;
        if (1.0..=16384.0).contains(&side) && side.fract() == 0.0 {
            Ok(side as u32)
        } else {
            Err(Refusal::because(format!("'{key}' must be a number of pixels from 1 to 16384")))
        }
    }
}

impl SurrenderSession<'_> {
    fn answer(&mut self, connection: &mut Connection, call: &Hash) -> Result<(), ConnectionEnd> {
        let Some(Value::Text(name)) = call.get("") else {
            return Err(ConnectionEnd::Malformed("a request has no name".to_owned()));
        };
        self.server.log.request(self.client, &format!("{name} {}", shown(call)));
        if name == "close" {
            return Err(ConnectionEnd::Closed);
        }
        let mut bytes = Vec::new();
        let mut reply = Hash::new();
        self.session.begin_call(connection.longest_call());
        let done = self.call(name, &CallArguments(call));
        self.session.end_call();
        if let Some(end) = self.session.verdict() {
            return Err(end);
        }
        match done {
            Ok(values) => {
                let formal = FORMAL.contains(&name.as_str());
                let idle = WITHOUT_EFFECT.contains(&name.as_str());
                if (formal || idle) && self.warned.insert(name.clone()) {
                    let level = if formal { "info" } else { "warning" };
                    bytes.extend(message(&format!("[{level}] {name} changes nothing: the scene of isotherm says it")));
                }
                reply.extend(values.into_iter().map(|(key, value)| (key.to_owned(), value)));
            }
            Err(refusal) => {
                self.server.log.tell(self.client, &format!("{name}: {refusal}"));
                bytes.extend(message(&format!("[error] {name}: {refusal}")));
            }
        }
        reply.insert(String::new(), Value::Text(name.clone()));
        bytes.extend(write_value(&reply));
        connection.send(&bytes)
    }

    fn call(&mut self, name: &str, given: &CallArguments) -> Answer {
        let one = |key: &'static str, value: Value| Ok(vec![(key, value)]);
        let text = |key, text: String| one(key, Value::Text(text));
        match name {
            "version" => text("version", format!("isotherm {}", env!("CARGO_PKG_VERSION"))),
            "setConventions" => {
                let (order, camera) = (given.number("quaternion_convention")?, given.number("camera_convention")?);
                (self.stage.scalar_first, self.stage.looks_forward) = (order != 0.0, camera != 0.0);
                Ok(Vec::new())
            }
            "getConventions" => {
                let flags = [self.stage.scalar_first, self.stage.looks_forward];
                one("conventions", Value::List(flags.map(|flag| Value::Int(i32::from(flag))).to_vec()))
            }
            "setImageSize" => {
                self.stage.size = [given.side("width")?, given.side("height")?];
                Ok(Vec::new())
            }
            "getImageSize" => one("size", Value::List(self.stage.size.map(|side| Value::Int(side as i32)).to_vec())),
            "setCameraFOVDeg" | "setCameraFOVRad" => {
                let field = [given.number("fov_x")?, given.number("fov_y")?];
                self.stage.field = if name == "setCameraFOVDeg" { field.map(f64::to_radians) } else { field };
                Ok(Vec::new())
            }
            "getCameraFOVDeg" => one("fov", Value::list(self.stage.field.map(f64::to_degrees))),
            "getCameraFOVRad" => one("fov", Value::list(self.stage.field)),
            "setObjectPosition" => {
                self.stage.set_position(given.text("object_name")?, given.numbers("pos")?)?;
                Ok(Vec::new())
            }
            "setObjectAttitude" => {
                self.stage.set_attitude(given.text("object_name")?, given.numbers("attitude")?)?;
                Ok(Vec::new())
            }
            "getObjectPosition" | "getObjectAttitude" => {
                let object = given.text("object_name")?;
                let unknown = || Refusal::because(format!("there is no object '{object}'"));
                if name == "getObjectPosition" {
                    one("pos", Value::list(self.stage.position(object).ok_or_else(unknown)?.to_array()))
                } else {
                    one("attitude", Value::list(self.stage.attitude(object).ok_or_else(unknown)?))
                }
            }
            "exists" => {
                let object = given.text("object_name")?;
                one("exists", Value::Bool(self.stage.position(object).is_some()))
            }
            _ => self.call_scene(name, given),
        }
    }

    /// A call that changes the scene, draws it, or asks about the server.
    fn call_scene(&mut self, name: &str, given: &CallArguments) -> Answer {
        let text = |key: &'static str, text: String| Ok(vec![(key, Value::Text(text))]);
        match name {
            "createMesh" => self.create_mesh(given.text("object_name")?, given.text("model_name")?),
            "createShape" => self.create_shape(given),
            "createBody" => self.create_body(given.text("body_name")?, given.text("shape_name")?),
            "createSphericalDEM" | "createDEM" => Err(Refusal::because(
                "isotherm draws no terrain from a .dem file; serve a scene whose model is the terrain as a mesh (docs/cad.md), and name it in createMesh",
            )),
            "reset" => {
                (self.stage, self.image) = (SurrenderStage::default(), None);
                Ok(Vec::new())
            }
            "render" => {
                self.image = Some(self.render()?);
                Ok(Vec::new())
            }
            "getImageGray8" => self.bytes(1),
            "getImageRGBA8" => self.bytes(4),
            "getImageGray32F" => self.floats(1, 1.0),
            "getImage" => self.floats(4, 1.0),
            "getImageSpectrumProjection" => {
                let spectrum = given.numbers::<4>("spectrum")?;
                self.floats(1, spectrum.iter().sum())
            }
            "getDepthMap" => {
                let image = self.rendered()?;
                let depth = flipped(&image.depth, image.size(), |depth| f64::from(*depth).to_le_bytes());
                Ok(picture(image, "depth_data", depth))
            }
            "runLUACode" => self.run_code(given.text("code")?),
            "help" => text("help", "isotherm serve: docs/serve.md lists the calls that do something".to_owned()),
            "ls" => text("listing", self.server.scenes.known()),
            "pwd" => text("path", "/".to_owned()),
            "getRessourcePath" => text("ressource_path", "/".to_owned()),
            _ if FORMAL.contains(&name) || WITHOUT_EFFECT.contains(&name) => Ok(Vec::new()),
            _ => Err(Refusal::because("isotherm does not do this")),
        }
    }

    fn create_mesh(&mut self, name: &str, model: &str) -> Answer {
        let Some(scene) = self.server.scenes.get(model) else {
            let told = self.server.scenes.told();
            return Err(Refusal::because(format!("there is no scene '{model}'; {told}")));
        };
        self.begin_craft(name, scene, 1.0)
    }

    /// Keeps the radius of a sphere. Other shapes have none.
    fn create_shape(&mut self, given: &CallArguments) -> Answer {
        let radius = match given.0.get("parameters") {
            Some(Value::Hash(parameters)) => parameters.get("radius").and_then(Value::number),
            _ => None,
        };
        let radius = radius.filter(|radius| given.text("filename").is_ok_and(|file| file == SPHERE) && *radius > 0.0);
        self.stage.set_shape(given.text("name")?, radius)?;
        Ok(Vec::new())
    }

    /// A sphere is drawn by the scene of the body's name, or else by the scene `sphere`: a craft of radius 1 m, which grows to the radius. The Sun is a source of light and
    /// not drawn.
    fn create_body(&mut self, name: &str, shape: &str) -> Answer {
        self.stage.object(name)?;
        let scenes = &self.server.scenes;
        let radius = self.stage.radius(shape).filter(|_| !name.eq_ignore_ascii_case("sun"));
        let (Some(radius), Some(scene)) = (radius, scenes.get(name).or_else(|| scenes.get("sphere"))) else {
            if radius.is_some() && self.warned.insert(format!("createBody {name}")) {
                let told = format!("the body '{name}' is not drawn: serve models/sphere.toml, or a scene of its name");
                self.server.log.tell(self.client, &told);
            }
            return Ok(Vec::new());
        };
        self.begin_craft(name, scene, radius)
    }

    fn begin_craft(&mut self, name: &str, scene: &Scene, scale: f64) -> Answer {
        if self.stage.craft_count() >= MOST_CRAFT {
            return Err(Refusal::because(format!("a session has at most {MOST_CRAFT} craft")));
        }
        let mut craft = ServedCraft::new(scene, self.server, self.session)?;
        craft.step_along(self.time, self.session)?;
        let object = self.stage.object(name)?;
        (object.craft, object.scale) = (Some(craft), scale);
        Ok(Vec::new())
    }

    fn render(&mut self) -> Result<Image, Refusal> {
        // The picture before is no more than memory now.
        self.image = None;
        ServedCraft::check_images(&self.server.target, self.stage.craft_count(), self.stage.size)?;
        let session = self.session;
        self.apparent = self.stage.band().map(Apparent::new);
        let images = self.stage.views()?.into_iter().map(|(view, craft)| craft.image(&view, session));
        nearest(images)?.ok_or_else(|| Refusal::because("no object has a scene: createMesh names one as its model"))
    }

    fn rendered(&self) -> Result<&Image, Refusal> {
        self.image.as_ref().ok_or_else(|| Refusal::because("nothing was rendered"))
    }

    /// The radiance [W m-2 sr-1] in a number of equal channels, times a factor.
    fn floats(&self, channels: usize, factor: f64) -> Answer {
        let image = self.rendered()?;
        let data = flipped(&image.radiance, image.size(), |radiance| {
            ((f64::from(*radiance) * factor) as f32).to_le_bytes().repeat(channels)
        });
        Ok(picture(image, "image_data", data))
    }

    /// Brightness temperatures in 8 bits, as `--picture apparent` has them, in one channel or in four of which the last is opaque.
    fn bytes(&self, channels: usize) -> Answer {
        let image = self.rendered()?;
        let [low, high] = self.server.picture.range.unwrap_or(DEFAULT_RANGE);
        let apparent = self.apparent.as_ref().ok_or_else(|| Refusal::because("nothing was rendered"))?;
        let data = flipped(&image.radiance, image.size(), |radiance| {
            let grey = grey(f64::from(apparent.temperature(*radiance)), [low, high]);
            let mut pixel = vec![grey; channels];
            if channels == 4 {
                pixel[3] = u8::MAX;
            }
            pixel
        });
        Ok(picture(image, "image_data", data))
    }

    fn run_code(&mut self, code: &str) -> Answer {
        let time = code.trim().strip_prefix(STEP_TO).and_then(|rest| rest.trim_end_matches(';').strip_suffix(')'));
        let Some(time) = time.and_then(|time| time.trim().parse::<f64>().ok()) else {
            return Err(Refusal::because(format!("isotherm runs no Lua; the only code is {STEP_TO}SECONDS)")));
        };
        let time = SceneTime::new(time)?.seconds();
        if time < self.time {
            return Err(Refusal::because(format!("the time is {} s and can not become {time} s", self.time)));
        }
        for (_, craft) in self.stage.views()? {
            craft.step_along(time, self.session)?;
        }
        self.time = time;
        Ok(vec![("return", Value::Double(time))])
    }
}

/// Bytes of the pixels, with the lowest row first.
fn flipped<T, B: AsRef<[u8]>>(pixels: &[T], [width, _]: [u32; 2], bytes: impl Fn(&T) -> B) -> Vec<u8> {
    let rows = pixels.chunks(width.max(1) as usize).rev();
    let mut data = Vec::new();
    rows.flatten().for_each(|pixel| data.extend_from_slice(bytes(pixel).as_ref()));
    data
}

fn picture(image: &Image, key: &'static str, data: Vec<u8>) -> Vec<(&'static str, Value)> {
    let [w, h] = image.size().map(|side| Value::Int(side as i32));
    vec![("w", w), ("h", h), ("compressed", Value::Bool(false)), (key, Value::Bytes(data))]
}

/// A message that the client prints.
fn message(text: &str) -> Vec<u8> {
    let text = format!("{text}\n").into_bytes();
    write_value(&Hash::from([(String::new(), Value::Text(String::new())), ("data".to_owned(), Value::Bytes(text))]))
}

/// The values of a call for the log.
fn shown(call: &Hash) -> String {
    let mut text = String::new();
    for (key, value) in call.iter().filter(|(key, _)| !key.is_empty()) {
        match value {
            Value::Bytes(bytes) => text.push_str(&format!("{key}=({} bytes) ", bytes.len())),
            Value::List(list) if list.len() > 16 => text.push_str(&format!("{key}=({} values) ", list.len())),
            Value::Hash(hash) => text.push_str(&format!("{key}=({} values) ", hash.len())),
            Value::Text(word) => text.push_str(&format!("{key}={word} ")),
            Value::List(list) => {
                let numbers: Vec<String> = list
                    .iter()
                    .map(|value| value.number().map_or("?".to_owned(), |number| number.to_string()))
                    .collect();
                text.push_str(&format!("{key}=[{}] ", numbers.join(", ")));
            }
            other => text.push_str(&format!("{key}={} ", other.number().unwrap_or(f64::NAN))),
        }
    }
    text.trim_end().to_owned()
}
