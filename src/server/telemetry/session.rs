//! A session of the temperature service: one craft, moved by its client.

use glam::DVec3;
use serde_json::{Map, Value, json};
use wildmatch::WildMatch;

use super::request::{OpenRequest, StepRequest, TelemetryRequest, next_line, read_request};
use crate::guard;
use crate::server::connection::Connection;
use crate::server::craft::ServedCraft;
use crate::server::error::{ConnectionEnd, Refusal};
use crate::server::listen::Server;
use crate::server::sessions::Session;
use crate::simulation::facade::Simulation;
use crate::simulation::light_force::LightPush;
use crate::thermal::budget::CHANNELS;

/// Serves a client up to its end.
pub fn talk_telemetry(server: &Server, connection: &mut Connection, client: &str) -> ConnectionEnd {
    let mut session = TelemetrySession { server, client, session: connection.session(), open: None };
    loop {
        let answered = next_line(connection).and_then(|line| {
            connection.greeted();
            session.answer(connection, &line)
        });
        if let Err(end) = answered {
            return end;
        }
    }
}

/// The craft of a session, and the part of its state that the client asks for.
struct OpenCraft {
    craft: ServedCraft,
    /// Numbers of the parts.
    parts: Vec<usize>,
    /// Name of each probe, and its node on the device.
    probes: Vec<(String, usize)>,
    heat: bool,
    /// The point of the torque.
    light: Option<DVec3>,
}

struct TelemetrySession<'s> {
    server: &'s Server,
    client: &'s str,
    session: &'s Session,
    open: Option<OpenCraft>,
}

impl TelemetrySession<'_> {
    fn answer(&mut self, connection: &mut Connection, line: &[u8]) -> Result<(), ConnectionEnd> {
        self.server.log.request(self.client, &String::from_utf8_lossy(line));
        self.session.begin_call(connection.longest_call());
        let (id, request) = read_request(line);
        let done = match request {
            Ok(request) => self.done(request).map_err(|refusal| {
                let kind = if matches!(refusal, Refusal::Stopped) { "stopped" } else { "refused" };
                (kind, refusal.to_string())
            }),
            Err(reason) => Err(("malformed", reason)),
        };
        self.session.end_call();
        if let Some(end) = self.session.verdict() {
            return Err(end);
        }
        let mut answer = Map::new();
        answer.extend(id.map(|id| ("id".to_owned(), id)));
        match done {
            Ok(values) => answer.extend(values),
            Err((kind, message)) => {
                self.server.log.tell(self.client, &message);
                answer.insert("error".to_owned(), json!({ "kind": kind, "message": message }));
            }
        }
        let mut line = Value::Object(answer).to_string();
        line.push('\n');
        connection.send(line.as_bytes())
    }

    fn done(&mut self, request: TelemetryRequest) -> Result<Map<String, Value>, Refusal> {
        match request {
            TelemetryRequest::Open(open) => self.open(&open),
            TelemetryRequest::Step(step) => {
                let Some(open) = &mut self.open else {
                    return Err(Refusal::because("no scene is open: the request 'open' comes first"));
                };
                open.move_to(&step, self.session)?;
                open.reading(self.session)
            }
        }
    }

    fn open(&mut self, open: &OpenRequest) -> Result<Map<String, Value>, Refusal> {
        let Some(scene) = self.server.scenes.get(&open.scene) else {
            let told = self.server.scenes.told();
            return Err(Refusal::because(format!("there is no scene '{}'; {told}", open.scene)));
        };
        let mut craft = ServedCraft::new(scene, self.server, self.session)?;
        let simulation = craft.simulation();
        let parts = chosen_parts(&simulation.prepared().parts, &open.parts)?;
        let probes = probes(simulation, open)?;
        let places = open.probes.iter().map(|probe| (probe.name.as_str(), DVec3::from(probe.position)));
        let off = guard::probes_off(simulation.prepared(), places);
        let warnings: Vec<String> = off.iter().map(ToString::to_string).collect();
        let names: Vec<&String> = parts.iter().map(|part| &simulation.prepared().parts[*part]).collect();
        let described = [
            ("isotherm", json!(env!("CARGO_PKG_VERSION"))),
            ("step", json!(simulation.prepared().scene.time.step)),
            ("parts", json!(names)),
            ("probes", json!(probes.iter().map(|(name, _)| name).collect::<Vec<_>>())),
            ("warnings", json!(warnings)),
            ("joints", simulation.joints().into_iter().collect()),
            ("heaters", simulation.heaters().into_iter().collect()),
        ];
        let light = open.light.map(|light| DVec3::from(light.about));
        self.open = Some(OpenCraft { craft, parts, probes, heat: open.heat, light });
        Ok(described.into_iter().map(|(name, value)| (name.to_owned(), value)).collect())
    }
}

/// Numbers of the parts that patterns name, in the order of the parts.
fn chosen_parts(parts: &[String], patterns: &[String]) -> Result<Vec<usize>, Refusal> {
    let patterns: Vec<(&String, WildMatch)> =
        patterns.iter().map(|pattern| (pattern, WildMatch::new(pattern))).collect();
    if let Some((pattern, _)) = patterns.iter().find(|(_, wild)| !parts.iter().any(|part| wild.matches(part))) {
        let known = parts.join(", ");
        return Err(Refusal::because(format!("no part matches '{pattern}'; the parts are {known}")));
    }
    let is_chosen = |part: &usize| patterns.iter().any(|(_, wild)| wild.matches(&parts[*part]));
    Ok((0..parts.len()).filter(is_chosen).collect())
}

/// The probes of the scene, and after them the client's.
fn probes(simulation: &Simulation, open: &OpenRequest) -> Result<Vec<(String, usize)>, Refusal> {
    let prepared = simulation.prepared();
    let names = prepared.scene.probes.iter().map(|probe| probe.name.clone());
    let mut probes: Vec<(String, usize)> = names.zip(prepared.probes.iter().copied()).collect();
    for probe in &open.probes {
        if probes.iter().any(|(name, _)| *name == probe.name) {
            return Err(Refusal::because(format!("two probes have the name '{}'", probe.name)));
        }
        let number = |name: &String| {
            let number = prepared.parts.iter().position(|part| part == name);
            let known = || format!("there is no part '{name}'; the parts are {}", prepared.parts.join(", "));
            number.map(|number| number as u32).ok_or_else(|| Refusal::because(known()))
        };
        let part = probe.part.as_ref().map(number).transpose()?;
        let Some(slot) = simulation.nearest_slot(DVec3::from(probe.position), part) else {
            return Err(Refusal::because(format!("no node is there for the probe '{}'", probe.name)));
        };
        probes.push((probe.name.clone(), slot));
    }
    Ok(probes)
}

impl OpenCraft {
    /// Moves the craft to a time. A request that is refused changes nothing.
    fn move_to(&mut self, step: &StepRequest, session: &Session) -> Result<(), Refusal> {
        let simulation = self.craft.simulation();
        simulation.check_joints(step.joints.iter())?;
        for (name, power) in &step.heaters {
            simulation.check_heater(name, *power)?;
        }
        if let Some(placement) = step.placement()? {
            self.craft.begin_at(step.time)?;
            self.craft.simulation().place(placement)?;
        }
        let simulation = self.craft.simulation();
        for (name, position) in &step.joints {
            simulation.set_joint(name, *position)?;
        }
        for (name, power) in &step.heaters {
            simulation.set_heater(name, *power)?;
        }
        self.craft.step_along(step.time, session)
    }

    /// The state that the client asks for.
    fn reading(&mut self, session: &Session) -> Result<Map<String, Value>, Refusal> {
        let _turn = session.turn()?;
        let mut answer = Map::new();
        let simulation = self.craft.simulation();
        answer.insert("time".to_owned(), json!(simulation.time()));
        let temperatures = simulation.part_temperatures()?;
        let of_parts = self.parts.iter().map(|part| {
            let part = &temperatures[*part];
            (part.part.clone(), json!({ "mean": part.mean, "least": part.least, "greatest": part.greatest }))
        });
        answer.insert("parts".to_owned(), of_parts.collect());
        let of_slots = simulation.slot_temperatures()?;
        let of_probes = self.probes.iter().map(|(name, slot)| (name.clone(), json!(f64::from(of_slots[*slot]))));
        answer.insert("probes".to_owned(), of_probes.collect());
        if self.heat {
            let heat = session.until_ended(|| simulation.part_heat())??;
            let parts = &simulation.prepared().parts;
            let of_parts = self.parts.iter().map(|part| (parts[*part].clone(), causes(&heat[*part])));
            answer.insert("heat".to_owned(), of_parts.collect());
        }
        if let Some(about) = self.light {
            let light = session.until_ended(|| simulation.light_force(about))??;
            let pushes = [
                ("all", light.all()),
                ("sun", light.sun),
                ("albedo", light.albedo),
                ("planet", light.planet),
                ("emitted", light.emitted),
            ];
            let of_causes = pushes.map(|(cause, push)| (cause.to_owned(), told(push)));
            answer.insert("light".to_owned(), of_causes.into_iter().collect());
        }
        Ok(answer)
    }
}

/// Heat by its causes: the names of the channels without their mark.
fn causes(heat: &[f64]) -> Value {
    let named = CHANNELS.iter().zip(heat);
    named.map(|(channel, watts)| (channel.trim_start_matches("Q_").to_owned(), json!(watts))).collect()
}

fn told(push: LightPush) -> Value {
    json!({ "force": push.force.to_array(), "torque": push.torque.to_array() })
}
