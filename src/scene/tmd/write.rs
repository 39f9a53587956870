//! Writes a TMD file in the layout of ESATAN, which other programs read by places as well as by names.

use hdf5_writer::{
    AttributeBuilder, ByteOrder, CompoundField, DatasetBuilder, Datatype, Error, Hdf5Builder, StringEncoding,
    StringPadding, StringSize, WriteOptions,
};

use super::{Conductors, GROUP, SET, Tmd};
use crate::files::LARGEST_FILE;
use crate::thermal::STEFAN_BOLTZMANN;

/// Attributes of a node, in the order of ESATAN. Attributes 7 to 12 are written as 0.
const REAL: [&str; 16] = [
    "Temperature",
    "Capacitance",
    "Total_Albedo_Heat_Source",
    "Total_Earth_Heat_Source",
    "Total_Internal_Heat_Source",
    "Total_Rest_Heat_Source",
    "Total_Solar_Heat_Source",
    "Area",
    "Solar_Absorptivity",
    "Infra-Red_Emissivity",
    "Incident_Albedo_Heat_Source",
    "Incident_Earth_Heat_Source",
    "Incident_Solar_Heat_Source",
    "X_Coordinate",
    "Y_Coordinate",
    "Z_Coordinate",
];
/// 0 degrees of the temperatures in the file [K].
const ZERO: f64 = 273.15;
const NAME: usize = 24;

impl Tmd {
    /// The bytes of a file with one model and temperatures in degrees Celsius.
    ///
    /// # Errors
    /// A message if it is larger than a file may be, or than HDF5 holds.
    pub fn bytes(&self) -> Result<Vec<u8>, String> {
        let conductors = self.linear.values.len() + self.radiative.values.len();
        let numbers = self.times.len() as u64 * (REAL.len() * self.nodes.len() + 2 * conductors) as u64;
        if 8 * numbers > LARGEST_FILE {
            let times = self.times.len();
            return Err(format!(
                "a TMD holds all conductors at each of the {times} times, {numbers} numbers, more than a file may hold"
            ));
        }
        self.encoded().map_err(|error| error.to_string())
    }

    fn encoded(&self) -> Result<Vec<u8>, Error> {
        let in_group = |name: &str| format!("{SET}/{GROUP}/{name}");
        let (times, nodes) = (self.times.len() as u64, self.nodes.len() as u64);
        let text = |name: &str, value: &str| AttributeBuilder::fixed_string_vector(name, &[value]);
        let numbers: Vec<i32> = self.nodes.iter().flat_map(|node| [node.number as i32, 1]).collect();
        let (mut real, mut texts) = (Vec::new(), Vec::new());
        for time in 0..self.times.len() {
            for node in &self.nodes {
                real.extend([node.temperatures[time] - ZERO, node.capacitances[time]]);
                real.extend(node.loads.iter().map(|load| load[time]));
                real.extend([0.0; 6]);
                real.extend(node.position.to_array());
                texts.extend([node.kind.to_string(), node.label.clone()]);
            }
        }
        let mut builder = Hdf5Builder::new()
            .attribute(text("Description", &self.description)?)
            .attribute(text("FileVersion", "01.00")?)
            .group_attribute(SET, text("Description", &self.description)?)
            .group_attribute(SET, AttributeBuilder::scalar("StefanBoltzmann", STEFAN_BOLTZMANN)?)
            .group_attribute(SET, AttributeBuilder::scalar("TAbs", ZERO)?)
            .group_attribute(format!("{SET}/{GROUP}"), text("Description", &self.description)?)
            .dataset(model(&self.description)?)
            .dataset(DatasetBuilder::typed_data(format!("{SET}/thermalNodes"), [nodes, 2], &numbers)?)
            .dataset(DatasetBuilder::fixed_string_data(format!("{SET}/thermalNodesRealAttributes"), [16], &REAL)?)
            .dataset(DatasetBuilder::fixed_string_data(
                format!("{SET}/thermalNodesStringAttributes"),
                [2],
                &["Type", "Label"],
            )?)
            .dataset(DatasetBuilder::typed_data(in_group("times"), [times], &self.times)?)
            .dataset(DatasetBuilder::typed_data(in_group("thermalNodesRealData"), [times, nodes, 16], &real)?)
            .dataset(DatasetBuilder::fixed_string_data(in_group("thermalNodesStringData"), [times, nodes, 2], &texts)?);
        for (kind, conductors) in [("GL", &self.linear), ("GR", &self.radiative)] {
            let Conductors { nodes, values, .. } = conductors;
            let count = values.len() as u64;
            let ends: Vec<i32> = nodes.iter().flat_map(|[a, b]| [*a as i32 + 1, *b as i32 + 1, 1, 1]).collect();
            let once: Vec<f64> = values.iter().flat_map(|value| [*value, 1.0]).collect();
            let ends = DatasetBuilder::typed_data(format!("{SET}/conductors{kind}"), [count, 4], &ends)?;
            let name = in_group(&format!("conductorData{kind}"));
            let data = DatasetBuilder::typed_data(name, [times, count, 2], &once.repeat(self.times.len()))?;
            builder = builder.dataset(ends).dataset(data);
        }
        builder.into_plan()?.encode(WriteOptions::default())
    }
}

/// The table of models, with one record.
fn model(description: &str) -> Result<DatasetBuilder, Error> {
    let text = Datatype::String {
        size: StringSize::Fixed(NAME as u32),
        encoding: StringEncoding::Ascii,
        padding: StringPadding::NullPad,
    };
    let number = Datatype::FixedPoint { size: 4, signed: true, byte_order: ByteOrder::LittleEndian };
    let field = |name: &str, byte_offset: usize, datatype: &Datatype| CompoundField {
        name: name.to_owned(),
        byte_offset: byte_offset as u32,
        datatype: datatype.clone(),
    };
    let fields =
        vec![field("modelName", 0, &text), field("parentId", NAME, &number), field("modelPath", NAME + 4, &text)];
    let letters = description.chars().map(|letter| if letter.is_ascii_alphanumeric() { letter as u8 } else { b'_' });
    let mut name: Vec<u8> = letters.take(NAME).collect();
    name.resize(NAME, 0);
    let record = [&name[..], &[0; 4], &name].concat();
    let datatype = Datatype::Compound { size: record.len() as u32, fields };
    Ok(DatasetBuilder::new(format!("{SET}/models"), datatype, [1]).raw_data(record))
}
