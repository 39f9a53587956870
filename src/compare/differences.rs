//! Differences between a run and the network, by part and over time.

/// The largest difference in a group of nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Largest {
    /// The run minus the network [K].
    pub(crate) difference: f32,
    /// Temperature in the run [K].
    pub(crate) temperature: f32,
    /// Temperature in the network [K].
    pub(crate) network: f32,
    pub(crate) step: u32,
    /// Vertex of the model after subdivision, which is the same node in every run.
    pub(crate) vertex: u32,
}

/// Differences in a part, or in the whole craft, over all steps.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct OfGroup {
    pub(crate) nodes: u64,
    /// Area [m2].
    pub(crate) area: f64,
    weight: f64,
    sum: f64,
    squares: f64,
    largest: Option<Largest>,
}

impl OfGroup {
    /// Mean over area and steps of the run minus the network [K].
    pub(crate) fn mean(&self) -> f64 {
        if self.weight > 0.0 { self.sum / self.weight } else { 0.0 }
    }

    /// Root mean square over area and steps [K].
    pub(crate) fn rms(&self) -> f64 {
        if self.weight > 0.0 { (self.squares / self.weight).sqrt() } else { 0.0 }
    }

    /// The largest difference. `None` without nodes.
    pub(crate) fn largest(&self) -> Option<Largest> {
        self.largest
    }
}

/// Differences of one step over all nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct OfStep {
    /// Time since the start [s].
    pub(crate) time: f64,
    /// Area-weighted mean of the run minus the network [K].
    pub(crate) mean: f64,
    /// Area-weighted root mean square [K].
    pub(crate) rms: f64,
    /// Largest [K].
    pub(crate) max: f32,
}

/// The vertices of the model, the same in every run.
#[derive(Debug, Clone, Default)]
pub(crate) struct Vertices {
    /// Areas [m2].
    pub(crate) areas: Vec<f64>,
    pub(crate) parts: Vec<u32>,
    pub(crate) materials: Vec<u32>,
    /// Positions in the body frame [m].
    pub(crate) positions: Vec<[f32; 3]>,
}

/// The differences between a run and the network.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Differences {
    pub(crate) parts: Vec<OfGroup>,
    /// Of all nodes.
    pub(crate) all: OfGroup,
    pub(crate) steps: Vec<OfStep>,
}

impl Differences {
    pub(crate) fn new(vertices: &Vertices, parts: usize) -> Self {
        let mut made = Self { parts: vec![OfGroup::default(); parts], ..Self::default() };
        for (part, area) in vertices.parts.iter().zip(&vertices.areas) {
            for group in [&mut made.parts[*part as usize], &mut made.all] {
                group.nodes += 1;
                group.area += area;
            }
        }
        made
    }

    /// Adds a step. Temperatures of run and network [K] are in vertex order.
    pub(crate) fn add(&mut self, vertices: &Vertices, step: u32, time: f64, run: &[f32], network: &[f32]) {
        let mut of_step = OfGroup::default();
        for (vertex, (temperature, reference)) in run.iter().zip(network).enumerate() {
            let (area, part) = (vertices.areas[vertex], vertices.parts[vertex] as usize);
            let difference = temperature - reference;
            let exact = f64::from(*temperature) - f64::from(*reference);
            for group in [&mut self.parts[part], &mut self.all, &mut of_step] {
                group.weight += area;
                group.sum += area * exact;
                group.squares += area * exact * exact;
                if group.largest.is_none_or(|largest| difference.abs() > largest.difference.abs()) {
                    let vertex = vertex as u32;
                    let (temperature, network) = (*temperature, *reference);
                    group.largest = Some(Largest { difference, temperature, network, step, vertex });
                }
            }
        }
        let max = of_step.largest.map_or(0.0, |largest| largest.difference);
        self.steps.push(OfStep { time, mean: of_step.mean(), rms: of_step.rms(), max });
    }
}

/// Columns of `compare.csv` in SI units. `mean` and `rms` are over area and steps. `max` is the largest difference, run
/// minus network. The columns after it state its time, place and both temperatures.
const COLUMNS: &str = "part,response,rms,max,time,step,node,x,y,z,material,temperature,network,mean,nodes,area";

/// Rows of `compare.csv`: one for each part and response, then one for `all`. `step` is the length of a step [s].
pub(crate) fn table(
    parts: &[String],
    materials: &[String],
    vertices: &Vertices,
    differences: &[(&str, &Differences)],
    step: f64,
) -> Vec<Vec<String>> {
    let head: Vec<String> = COLUMNS.split(',').map(str::to_owned).collect();
    let columns = head.len();
    let mut rows = vec![head];
    for (part, name) in parts.iter().map(String::as_str).chain(["all"]).enumerate() {
        for (response, differences) in differences {
            let group = differences.parts.get(part).unwrap_or(&differences.all);
            let kelvin = |value: f64| format!("{value:.6}");
            let mut row = vec![name.to_owned(), (*response).to_owned()];
            match group.largest {
                None => row.resize(columns - 2, String::new()),
                Some(largest) => {
                    let vertex = largest.vertex as usize;
                    row.extend([kelvin(group.rms()), kelvin(f64::from(largest.difference))]);
                    row.push((f64::from(largest.step) * step).to_string());
                    row.extend([largest.step, largest.vertex].map(|number| number.to_string()));
                    row.extend(vertices.positions[vertex].map(|x| x.to_string()));
                    row.push(materials[vertices.materials[vertex] as usize].clone());
                    row.extend([largest.temperature, largest.network].map(|t| t.to_string()));
                    row.push(kelvin(group.mean()));
                }
            }
            row.extend([group.nodes.to_string(), kelvin(group.area)]);
            rows.push(row);
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_parts() -> Vertices {
        Vertices {
            areas: vec![1.0, 3.0, 2.0],
            parts: vec![0, 0, 1],
            materials: vec![0, 0, 1],
            positions: vec![[0.0; 3], [1.0, 2.0, 3.0], [4.0; 3]],
        }
    }

    #[test]
    fn rms_mean_and_largest_are_those_by_hand() {
        let vertices = two_parts();
        let mut computed = Differences::new(&vertices, 3);
        computed.add(&vertices, 0, 0.0, &[300.0; 3], &[300.0; 3]);
        computed.add(&vertices, 1, 10.0, &[302.0, 296.0, 301.0], &[300.0; 3]);
        // Over two steps, part 0: (1 x 4 + 3 x 16) / 8 = 6.5; mean (2 - 12) / 8. Part 1: 2 x 1 / 4. All: 54 / 12.
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} is not {b}");
        near(computed.parts[0].rms(), 6.5f64.sqrt());
        near(computed.parts[0].mean(), -1.25);
        near(computed.parts[1].rms(), 0.5f64.sqrt());
        near(computed.all.rms(), 4.5f64.sqrt());
        let worst = Largest { difference: -4.0, temperature: 296.0, network: 300.0, step: 1, vertex: 1 };
        assert_eq!((computed.parts[0].largest(), computed.all.largest()), (Some(worst), Some(worst)));
        assert_eq!((computed.parts[2].largest(), computed.parts[2].rms()), (None, 0.0));
        near(computed.steps[1].rms, 9.0f64.sqrt());
        assert_eq!((computed.steps[0].max, computed.steps[1].max), (0.0, -4.0));
        // Equal areas would give another rms, so the weights count.
        let even = Vertices { areas: vec![1.0; 3], ..two_parts() };
        let mut other = Differences::new(&even, 3);
        other.add(&even, 1, 10.0, &[302.0, 296.0, 301.0], &[300.0; 3]);
        assert!((other.parts[0].rms() - 6.5f64.sqrt()).abs() > 0.1);
    }

    #[test]
    fn the_table_has_a_row_for_each_part_and_response() {
        let vertices = two_parts();
        let mut found = Differences::new(&vertices, 3);
        found.add(&vertices, 2, 20.0, &[302.0, 296.0, 301.0], &[300.0; 3]);
        let parts = ["body", "wing", "empty"].map(str::to_owned);
        let materials = ["a", "b"].map(str::to_owned);
        let rows = table(&parts, &materials, &vertices, &[("instant", &found), ("transition", &found)], 10.0);
        assert_eq!(rows.len(), 1 + 2 * 4);
        assert!(rows.iter().all(|row| row.len() == rows[0].len()));
        let expected = "body,instant,3.605551,-4.000000,20,2,1,1,2,3,a,296,300,-2.500000,2,4.000000";
        assert_eq!(rows[1].join(","), expected);
        assert_eq!(rows[5].join(","), "empty,instant,,,,,,,,,,,,,0,0.000000");
        assert_eq!(rows[8][..2], ["all", "transition"]);
    }
}
