//! A network as tables that any program reads.

use super::NetworkFile;
pub(crate) const NAMES: [&str; 4] = ["nodes.csv", "gl.csv", "gr.csv", "heat.csv"];

type TextRows = Vec<Vec<String>>;

impl NetworkFile {
    /// The rows of the tables `NAMES`, each with its header: nodes, linear and radiative conductors, and the heat of each node that has any [W]. A time
    /// of heat that stands twice is a jump.
    pub(crate) fn tables(&self) -> [TextRows; 4] {
        let network = &self.network;
        let header = |names: &[&str]| vec![names.iter().map(|name| (*name).to_owned()).collect::<Vec<String>>()];
        let mut nodes = header(&["node", "kind", "capacitance_j_per_k", "emissive_area_m2", "temperature_k"]);
        for (at, label) in self.labels.iter().enumerate() {
            let kind = network.kinds[at].name();
            let values = [network.capacitances[at], network.emissive_areas[at], network.temperatures[at]];
            let cells = [label.clone(), kind.to_owned()].into_iter();
            nodes.push(cells.chain(values.iter().map(f64::to_string)).collect());
        }
        let row = |ends: [u32; 2], value: f64| {
            let [a, b] = ends.map(|end| self.labels[end as usize].clone());
            vec![a, b, value.to_string()]
        };
        let mut linear = header(&["from", "to", "gl_w_per_k"]);
        linear.extend(network.linear.iter().map(|conductor| row(conductor.nodes, conductor.conductance)));
        let mut radiative = header(&["from", "to", "gr_m2"]);
        radiative.extend(network.radiative.iter().map(|conductor| row(conductor.nodes, conductor.exchange_area)));
        [nodes, linear, radiative, self.heat_table()]
    }

    fn heat_table(&self) -> TextRows {
        let tables = self.schedule.heat_of_nodes(self.network.len());
        let heated: Vec<_> =
            self.labels.iter().zip(&tables).filter_map(|(label, table)| Some((label, table.as_ref()?))).collect();
        let mut times: Vec<f64> = heated.iter().flat_map(|(_, table)| table.times.iter().copied()).collect();
        times.sort_unstable_by(f64::total_cmp);
        times.dedup();
        let header = std::iter::once("time".to_owned()).chain(heated.iter().map(|(label, _)| (*label).clone()));
        let mut rows = vec![header.collect::<Vec<String>>()];
        for time in times {
            let before: Vec<f64> = heated.iter().map(|(_, table)| table.before(time)).collect();
            let after: Vec<f64> = heated.iter().map(|(_, table)| table.after(time).0).collect();
            let row = |powers: &[f64]| std::iter::once(&time).chain(powers).map(f64::to_string).collect();
            if before != after {
                rows.push(row(&before));
            }
            rows.push(row(&after));
        }
        rows
    }
}
