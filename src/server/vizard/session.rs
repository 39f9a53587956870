//! A session: the requests of one Basilisk process, one after the other, and their answers.

use std::collections::{BTreeMap, BTreeSet};
use std::convert::Infallible;

use glam::DVec3;
use hifitime::{Epoch, Unit};
use prost::Message;

use super::frames::{ModelMount, Mounted, camera_from_body, view};
use super::messages::{CustomModel, MessageCamera, Spacecraft, VizMessage, vector};
use super::unserved::unserved;
use super::world::{SunFrom, date, heavens, place, state};
use super::zmtp::{ZmtpRequest, answer, greet, receive};
use crate::environment::scene_time::SceneTime;
use crate::scene::Scene;
use crate::server::connection::Connection;
use crate::server::craft::{ServedCraft, nearest};
use crate::server::error::{ConnectionEnd, Refusal};
use crate::server::listen::Server;
use crate::server::picture::{Painter, depth_png};
use crate::server::sessions::Session;

/// Most craft of a run that are drawn.
const MOST_CRAFT: usize = 8;
/// Most different messages that a session tells.
const MOST_SAID: usize = 100;
/// Name by which a model is meant for every craft.
const EVERY_CRAFT: &str = "ALL_SPACECRAFT";
/// Most bytes of a message that is kept, and of a name that a client gives.
const LONGEST_NAME: usize = 1000;
const MOST_MODELS: usize = 1000;
/// The far plane of a picture of depth where the camera states none [m].
const FAR: f64 = 100.0;
/// Share by which the radius of the messages' planet may differ from the radius of the scene's planet.
const RADIUS_TOLERANCE: f64 = 0.02;

/// Serves a client up to its end.
pub fn talk_vizard(server: &Server, connection: &mut Connection, client: &str) -> ConnectionEnd {
    let mut session = VizardSession { server, client, session: connection.session(), run: None, said: BTreeSet::new() };
    let greeted = greet(connection).map(|()| connection.greeted());
    match greeted.and_then(|()| session.serve(connection)) {
        Ok(never) => match never {},
        Err(end) => end,
    }
}

struct PaintedCraft<'s> {
    craft: ServedCraft,
    scene: &'s Scene,
    painter: Painter,
    mount: ModelMount,
    /// Why its last state was refused.
    fault: Option<String>,
}

/// A run of the simulation: from its first message to the first message of the next run.
#[derive(Default)]
struct VizardRun<'s> {
    epoch: Option<Epoch>,
    /// The script's model of a craft, by the name of the craft.
    models: BTreeMap<String, CustomModel>,
    /// Craft by their names. `None` where no scene has the name.
    craft: BTreeMap<String, Option<PaintedCraft<'s>>>,
    planet: Option<String>,
    last: VizMessage,
}

struct VizardSession<'s, 'c> {
    server: &'s Server,
    client: &'c str,
    session: &'c Session,
    run: Option<VizardRun<'s>>,
    said: BTreeSet<String>,
}

impl<'s> VizardSession<'s, '_> {
    fn serve(&mut self, connection: &mut Connection) -> Result<Infallible, ConnectionEnd> {
        loop {
            let request = receive(connection)?;
            self.session.begin_call(connection.longest_call());
            let (frames, terminated) = self.reply(&request);
            self.session.end_call();
            if let Some(end) = self.session.verdict() {
                return Err(end);
            }
            answer(connection, &request, &frames)?;
            if terminated {
                self.run = None;
            }
        }
    }

    /// The frames of the answer to a request, and whether the request ends the run.
    fn reply(&mut self, request: &ZmtpRequest) -> (Vec<Vec<u8>>, bool) {
        let name = request.frames.first().map_or(&b""[..], Vec::as_slice);
        let mut terminates = false;
        let frames = match name {
            b"PING" => {
                self.log("PING");
                vec![b"PONG".to_vec()]
            }
            b"SIM_UPDATE" => match request.frames.last().map(|bytes| VizMessage::decode(&bytes[..])) {
                Some(Ok(message)) if request.frames.len() > 1 => {
                    terminates = message.live.as_ref().is_some_and(|live| live.terminate);
                    self.update(message);
                    self.tell_unserved(request.frames.last().map_or(&[][..], Vec::as_slice));
                    vec![b"OK".to_vec()]
                }
                _ => {
                    self.tell("SIM_UPDATE without a message that can be read");
                    vec![b"ERROR".to_vec()]
                }
            },
            b"REQUEST_INPUT" => {
                self.log("REQUEST_INPUT");
                vec![b"VIZARD_INPUT".to_vec(), Vec::new()]
            }
            _ => match image_number(name) {
                Some(number) => {
                    let image = self.image(number).unwrap_or_else(|refusal| {
                        self.tell(&format!("no image of camera {number}: {refusal}"));
                        Vec::new()
                    });
                    self.log(&format!("REQUEST_IMAGE_{number}: {} bytes", image.len()));
                    vec![i32::try_from(image.len()).unwrap_or(0).to_be_bytes().to_vec(), image]
                }
                None => {
                    self.tell(&format!("'{}' is unknown", String::from_utf8_lossy(name)));
                    vec![b"ERROR".to_vec()]
                }
            },
        };
        (frames, terminates)
    }

    fn log(&self, request: &str) {
        self.server.log.request(self.client, request);
    }

    /// Tells a message once.
    fn tell(&mut self, message: &str) {
        if message.len() <= LONGEST_NAME && self.said.len() < MOST_SAID && self.said.insert(message.to_owned()) {
            self.server.log.tell(self.client, message);
        } else {
            self.log(&format!("! {message}"));
        }
    }

    /// Tells the fields of a message that have no effect, each once in a run.
    fn tell_unserved(&mut self, message: &[u8]) {
        let told: Vec<String> = unserved(message)
            .into_iter()
            .filter(|name| self.said.len() < MOST_SAID && self.said.insert(format!("no effect: {name}")))
            .collect();
        if !told.is_empty() {
            self.server.log.tell(self.client, &format!("these fields change nothing here: {}", told.join("; ")));
        }
    }

    /// Moves all craft to the states of a message.
    fn update(&mut self, message: VizMessage) {
        let (frame, time) = message.time.as_ref().map_or((0, 0.0), |time| (time.frame, 1e-9 * time.elapsed));
        self.log(&format!("SIM_UPDATE frame {frame}, {time} s, {} craft", message.spacecraft.len()));
        let known = SceneTime::new(time).map_err(|error| error.to_string());
        let known =
            known.and_then(|known| if time < 0.0 { Err(format!("{time} s lies before the start")) } else { Ok(known) });
        let time = match known {
            Ok(known) => known,
            Err(reason) => {
                self.tell(&format!("the time of a message can not be used: {reason}"));
                // No image shows the state of an earlier message in its place.
                self.run = None;
                return;
            }
        };
        let goes_on = |run: &VizardRun| {
            let last = run.last.time.as_ref().map_or((0, 0.0), |time| (time.frame, 1e-9 * time.elapsed));
            frame > last.0 && time.seconds() > last.1
        };
        let mut run = match self.run.take() {
            Some(run) if goes_on(&run) => run,
            _ => {
                self.said.clear();
                self.log("a run begins");
                VizardRun::default()
            }
        };
        match message.epoch.as_ref().map(date) {
            Some(Ok(epoch)) => run.epoch = Some(epoch),
            Some(Err(refusal)) => self.tell(&refusal.to_string()),
            None => {}
        }
        for model in message.settings.iter().flat_map(|settings| &settings.models) {
            for body in &model.bodies {
                if run.models.len() < MOST_MODELS && body.len().max(model.path.len()) <= LONGEST_NAME {
                    run.models.insert(body.clone(), model.clone());
                }
            }
        }
        for craft in message.spacecraft.iter().filter(|craft| craft.parent.is_empty()) {
            self.move_craft(&mut run, &message, craft, time);
        }
        run.last = message;
        self.run = Some(run);
    }

    fn move_craft(&mut self, run: &mut VizardRun<'s>, message: &VizMessage, craft: &Spacecraft, time: SceneTime) {
        if !run.craft.contains_key(&craft.name) {
            if run.craft.len() >= 4 * MOST_CRAFT {
                self.tell("too many spacecraft: the others are not drawn");
                return;
            }
            let carries = message.cameras.iter().any(|camera| camera.parent == craft.name);
            let drawn = self.begin_craft(run, &craft.name, carries);
            run.craft.insert(craft.name.clone(), drawn);
        }
        let now = run.epoch.map(|epoch| epoch + Unit::Second * time.seconds());
        let Some(Some(drawn)) = run.craft.get_mut(&craft.name) else { return };
        let around = place(craft).and_then(|place| heavens(message, place.position, run.planet.as_deref(), now));
        let around = match around {
            Ok(around) => around,
            Err(refusal) => {
                drawn.fault = Some(refusal.to_string());
                return self.tell(&format!("'{}': {refusal}", craft.name));
            }
        };
        let of_scene = drawn.scene.environment.planet_radius;
        let moved = state(craft, &drawn.mount, &around, time);
        let moved = moved.and_then(|state| drawn.craft.observe(state, self.session));
        drawn.fault = moved.err().map(|refusal| refusal.to_string());
        if let Some(fault) = drawn.fault.clone() {
            self.tell(&format!("'{}' at {} s: {fault}", craft.name, time.seconds()));
        }
        run.planet.get_or_insert(around.planet.clone());
        match around.sun_from {
            SunFrom::Message => {}
            SunFrom::NoSun => self.tell("the messages have no Sun: its direction is that of the date, in axes of J2000"),
            SunFrom::AtThePlanet => self.tell(
                "in the messages the Sun is where the planet is, because the script links no ephemeris: its direction is that of the date, in axes of J2000",
            ),
        }
        if around.radius > 0.0 && (around.radius / of_scene - 1.0).abs() > RADIUS_TOLERANCE {
            self.tell(&format!(
                "the planet '{}' has a radius of {:.0} km, and that of the scene has {:.0} km",
                around.planet,
                around.radius / 1e3,
                of_scene / 1e3
            ));
        }
    }

    /// The craft of a name, where a scene belongs to it. If a craft without a scene carries a camera, only the log tells of it.
    fn begin_craft(&mut self, run: &VizardRun, name: &str, carries: bool) -> Option<PaintedCraft<'s>> {
        let model = run.models.get(name).or_else(|| run.models.get(EVERY_CRAFT));
        let scenes = &self.server.scenes;
        let scene = match model {
            Some(model) => scenes.get(&model.path).or_else(|| scenes.get(name)),
            None => scenes.get(name),
        };
        let Some(scene) = scene else {
            let asked =
                model.map_or_else(|| format!("'{name}'"), |model| format!("'{name}' with the model '{}'", model.path));
            let message = format!("{asked} is not drawn: {}", scenes.told());
            if carries {
                self.log(&message);
            } else {
                self.tell(&message);
            }
            return None;
        };
        if run.craft.values().flatten().count() >= MOST_CRAFT {
            self.tell(&format!("'{name}' is not drawn: a run shows at most {MOST_CRAFT} craft"));
            return None;
        }
        let mount = model.map_or(Ok(ModelMount::PLAIN), ModelMount::of);
        let begun = mount.and_then(|mount| Ok((mount, ServedCraft::new(scene, self.server, self.session)?)));
        match begun {
            Ok((mount, craft)) => {
                if mount.scale != 1.0 {
                    let scale = mount.scale;
                    self.tell(&format!("'{name}' is drawn {scale} times as large as its scene, with the temperatures of the scene as it is"));
                }
                let painter = Painter::new(self.server.picture, scene);
                Some(PaintedCraft { craft, scene, painter, mount, fault: None })
            }
            Err(refusal) => {
                self.tell(&format!("'{name}' is not drawn: {refusal}"));
                None
            }
        }
    }

    /// The PNG of a camera.
    fn image(&mut self, number: i64) -> Result<Vec<u8>, Refusal> {
        let session = self.session;
        let Some(run) = &mut self.run else { return Err(Refusal::because("no state of the simulation has come")) };
        let Some(camera) = run.last.cameras.iter().find(|camera| camera.id == number) else {
            return Err(Refusal::because("the messages have no such camera"));
        };
        let mounted = mounted(camera)?;
        let is_carrier = |craft: &&Spacecraft| craft.name == camera.parent;
        let Some(carrier) = run.last.spacecraft.iter().find(is_carrier) else {
            return Err(Refusal::because(format!("the messages have no craft '{}', which carries it", camera.parent)));
        };
        let carrier = place(carrier)?;
        let mut band = None;
        let mut views = Vec::new();
        for craft in run.last.spacecraft.iter().filter(|craft| craft.parent.is_empty()) {
            let Some(Some(drawn)) = run.craft.get(&craft.name) else { continue };
            if let Some(fault) = &drawn.fault {
                return Err(Refusal::because(format!("'{}': {fault}", craft.name)));
            }
            if *band.get_or_insert(drawn.scene.band) != drawn.scene.band {
                return Err(Refusal::because("the scenes of the craft have different bands"));
            }
            let mount = &drawn.mount;
            views.push((&craft.name, view(&mounted, &carrier, &mount.on(&place(craft)?), mount.scale)));
        }
        ServedCraft::check_images(&self.server.target, views.len(), mounted.size)?;
        let drawn = |(name, view)| Some(run.craft.get_mut(name)?.as_mut()?.craft.image(&view, session));
        let image = nearest(views.into_iter().filter_map(drawn))?;
        let painter = run.craft.values().flatten().next().map(|drawn| &drawn.painter);
        let (Some(image), Some(painter)) = (image, painter) else {
            return Err(Refusal::because(format!("no craft has a scene; {}", self.server.scenes.told())));
        };
        let png = match camera.render_mode {
            0 => painter.png(&image),
            _ => depth_png(&image, far(camera)?),
        };
        if let Some(step) = run.craft.values().flatten().find_map(|drawn| drawn.craft.cut_step()) {
            self.tell(&format!(
                "images come between the ends of the scene's steps of {step} s and cut them: temperatures differ from `isotherm run` by the error of the \
                 step length (docs/serve.md)"
            ));
        }
        png.map_err(|error| Refusal::because(error.to_string()))
    }
}

/// The camera's number in `REQUEST_IMAGE_7`.
fn image_number(name: &[u8]) -> Option<i64> {
    std::str::from_utf8(name.strip_prefix(b"REQUEST_IMAGE_")?).ok()?.parse().ok()
}

/// The far plane of a camera [m].
fn far(camera: &MessageCamera) -> Result<f64, Refusal> {
    match camera.depth_planes[..] {
        [] => Ok(FAR),
        [_, far] if far.is_finite() && far > 0.0 => Ok(far),
        _ => Err(Refusal::because("its depth planes are not a near and a far distance")),
    }
}

fn mounted(camera: &MessageCamera) -> Result<Mounted, Refusal> {
    let side = |value: i64| u32::try_from(value).ok().filter(|side| *side > 0);
    let size = match camera.resolution[..] {
        [width, height] => side(width).zip(side(height)),
        _ => None,
    };
    let Some((width, height)) = size else {
        return Err(Refusal::because("its resolution is not a width and a height in pixels"));
    };
    let field_of_view = camera.field_of_view;
    if !(field_of_view > 0.0 && field_of_view < 180.0) {
        return Err(Refusal::because(format!("its field of view of {field_of_view} deg is not between 0 and 180 deg")));
    }
    let numbers = vector(&camera.position).zip(vector(&camera.direction));
    let Some((position, direction)): Option<(DVec3, DVec3)> = numbers else {
        return Err(Refusal::because("its position or direction is not three finite numbers"));
    };
    Ok(Mounted {
        size: [width, height],
        field_of_view: field_of_view.to_radians(),
        position,
        camera_from_body: camera_from_body(direction),
    })
}
