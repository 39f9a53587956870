//! Writes a network as the text of a network file.

use std::fmt::Write;

use super::NetworkFile;
use crate::text::plain;
use crate::thermal::network::NodeKind;
use crate::thermal::network::schedule::HeatTable;

impl NetworkFile {
    /// The text of this network. `head` becomes comments at its begin, and `comments` one above each node that has one. Parsing the text gives the same
    /// network.
    pub fn text(&self, head: &[String], comments: &[String]) -> String {
        let (network, schedule) = (&self.network, &self.schedule);
        let mut text = String::new();
        for line in head {
            let _ = writeln!(text, "# {}", plain(line));
        }
        let _ = writeln!(text, "\nspace_temperature = {:?}", network.space_temperature);
        let heat = schedule.heat_of_nodes(network.len());
        for (node, label) in self.labels.iter().enumerate() {
            let kind = network.kinds[node].name();
            let comment = comments.get(node).filter(|comment| !comment.is_empty());
            let comment = comment.map(|comment| format!(" # {}", plain(comment))).unwrap_or_default();
            let _ = writeln!(text, "\n[[node]]{comment}\nlabel = {}\nkind = \"{kind}\"", quoted(label));
            if network.kinds[node] == NodeKind::Diffusive {
                let _ = writeln!(text, "capacitance = {:?}", network.capacitances[node]);
            }
            if network.emissive_areas[node] != 0.0 {
                let _ = writeln!(text, "emissive_area = {:?}", network.emissive_areas[node]);
            }
            let _ = writeln!(text, "temperature = {:?}", network.temperatures[node]);
            match &heat[node] {
                None => {}
                Some(HeatTable { times, powers }) if times.len() == 1 => {
                    let _ = writeln!(text, "heat = {:?}", powers[0]);
                }
                Some(HeatTable { times, powers }) => {
                    let _ = writeln!(text, "heat = {{ time = {times:?}, power = {powers:?} }}");
                }
            }
        }
        let pair = |ends: [u32; 2]| {
            let [a, b] = ends.map(|end| quoted(&self.labels[end as usize]));
            format!("nodes = [{a}, {b}]")
        };
        for conductor in &network.linear {
            let ends = pair(conductor.nodes);
            let _ = writeln!(text, "\n[[linear_conductor]]\n{ends}\nconductance = {:?}", conductor.conductance);
        }
        for conductor in &network.radiative {
            let ends = pair(conductor.nodes);
            let _ = writeln!(text, "\n[[radiative_conductor]]\n{ends}\nexchange_area = {:?}", conductor.exchange_area);
        }
        for (number, thermostat) in schedule.thermostats.iter().enumerate() {
            let alone = [(thermostat.node, 1.0)];
            // A heater of several nodes is several thermostats with one sensor and one band.
            for (node, share) in schedule.spread.get(number).map_or(&alone[..], Vec::as_slice) {
                let [node, sensor] = [*node, thermostat.sensor].map(|node| quoted(&self.labels[node as usize]));
                let _ = writeln!(
                    text,
                    "\n[[thermostat]]\nnode = {node}\nsensor = {sensor}\npower = {:?}\non_below = {:?}\noff_above = {:?}\ninitially_on = {}",
                    share * thermostat.power,
                    thermostat.on_below,
                    thermostat.off_above,
                    thermostat.initially_on
                );
            }
        }
        if !self.times.is_empty() {
            let _ = writeln!(text, "\n[output]\ntimes = {:?}", self.times);
        }
        text
    }
}

pub(super) fn quoted(text: &str) -> toml::Value {
    toml::Value::String(text.to_owned())
}
