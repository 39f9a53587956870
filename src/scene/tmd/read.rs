//! Reads a TMD file.

use std::path::Path;

use glam::DVec3;
use hdf5_reader::group::Group;
use hdf5_reader::messages::datatype::{Datatype, StringSize};
use hdf5_reader::{Dataset, Hdf5File, OpenOptions};

use super::{Conductors, GROUP, LOADS, SET, Tmd, TmdError, TmdNode};
use crate::environment::scene_time::SceneTime;
use crate::files::{self, Expansion};
use crate::text::plain;
use crate::thermal::STEFAN_BOLTZMANN;

/// Memory of an entry in the reader's list of chunks.
const CHUNK_ENTRY: usize = 128;
const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";

impl Tmd {
    /// Reads a TMD file.
    ///
    /// # Errors
    /// See [`TmdError`].
    pub fn load(path: &Path) -> Result<Self, TmdError> {
        let bytes = files::read(path).map_err(|fault| TmdError::Unreadable { path: path.to_path_buf(), fault })?;
        Self::parse(bytes, path)
    }

    /// Reads the bytes of a TMD file as if it lay at `path`.
    ///
    /// # Errors
    /// See [`TmdError`].
    pub fn parse(bytes: Vec<u8>, path: &Path) -> Result<Self, TmdError> {
        if !bytes.starts_with(SIGNATURE) {
            return Err(TmdError::Signature { path: path.to_path_buf() });
        }
        let expansion = Expansion::of(bytes.len());
        let options = OpenOptions::default().with_max_read_bytes(expansion.most());
        let opened = Hdf5File::from_vec_with_options(bytes, options);
        let file = TmdFile { path, file: opened.map_err(|source| hdf5(path, "/", source))?, expansion };
        file.version()?;
        file.tmd()
    }
}

fn hdf5(path: &Path, object: &str, source: hdf5_reader::error::Error) -> TmdError {
    TmdError::Hdf5 { path: path.to_path_buf(), object: object.to_owned(), source: Box::new(source) }
}

/// An open file.
struct TmdFile<'a> {
    path: &'a Path,
    file: Hdf5File,
    expansion: Expansion,
}

/// Numbers of a dataset with its extents.
struct Numbers {
    object: String,
    shape: Vec<usize>,
    values: Vec<f64>,
}

impl Numbers {
    fn rows(&self) -> usize {
        self.shape.first().copied().unwrap_or(0)
    }
}

/// The attributes of all nodes at all times, with the columns of the attributes that are read.
struct NodeTable<'a> {
    times: &'a [f64],
    count: usize,
    attributes: usize,
    real: Numbers,
    temperature: usize,
    capacitance: usize,
    loads: [Option<usize>; 5],
    places: [Option<usize>; 3],
    text_attributes: usize,
    label: Option<usize>,
    kind: usize,
    text_object: String,
    texts: Vec<String>,
}

impl NodeTable<'_> {
    fn text(&self, time: usize, node: usize, column: usize) -> &String {
        &self.texts[(time * self.count + node) * self.text_attributes + column]
    }

    /// Values of an attribute of a node at all times.
    fn values(&self, node: usize, column: usize) -> Vec<f64> {
        let value = |time: usize| self.real.values[(time * self.count + node) * self.attributes + column];
        (0..self.times.len()).map(value).collect()
    }

    /// Whether the type of a node changes over time.
    fn changes_type(&self, node: usize) -> bool {
        (1..self.times.len()).any(|time| self.text(time, node, self.kind) != self.text(0, node, self.kind))
    }
}

impl TmdFile<'_> {
    fn wrong(&self, object: &str, message: impl Into<String>) -> TmdError {
        TmdError::Value { path: self.path.to_path_buf(), object: object.to_owned(), message: message.into() }
    }

    fn group(&self, name: &str) -> Result<Group, TmdError> {
        self.file.group(name).map_err(|source| hdf5(self.path, name, source))
    }

    fn version(&self) -> Result<(), TmdError> {
        let root = self.file.root_group().map_err(|source| hdf5(self.path, "/", source))?;
        let attribute = root.attribute("FileVersion").map_err(|source| hdf5(self.path, "FileVersion", source))?;
        let version = attribute.read_string().map_err(|source| hdf5(self.path, "FileVersion", source))?;
        if version.trim().starts_with("01.") {
            return Ok(());
        }
        Err(TmdError::Version { path: self.path.to_path_buf(), version: plain(version.trim()).into_owned() })
    }

    /// An attribute of the analysis set, where it has it.
    fn setting(&self, set: &Group, name: &str) -> Result<Option<f64>, TmdError> {
        let object = format!("{SET}.{name}");
        let Ok(attribute) = set.attribute(name) else { return Ok(None) };
        let value = attribute.read_as_f64().map_err(|source| hdf5(self.path, &object, source))?;
        if value.is_finite() { Ok(Some(value)) } else { Err(self.wrong(&object, format!("is {value}, not a number"))) }
    }

    fn charge(&self, object: &str, count: usize, each: usize) -> Result<(), TmdError> {
        self.expansion.charge(count, each).map_err(|fault| self.wrong(object, fault.to_string()))
    }

    /// Opens a dataset whose elements become values of `each` bytes. What is read of the file and what is made of it are charged.
    fn dataset(&self, object: &str, each: usize) -> Result<Dataset, TmdError> {
        let failed = |source| hdf5(self.path, object, source);
        let dataset = self.file.dataset(object).map_err(failed)?;
        let count = usize::try_from(dataset.num_elements().map_err(failed)?).unwrap_or(usize::MAX);
        let size = dataset.raw_element_size().map_err(failed)?;
        self.charge(object, count, each.saturating_add(size))?;
        if let Some(chunk) = dataset.chunks() {
            // A chunk may be larger than its dataset, and the list of chunks has an entry for each.
            let extents = dataset.shape().iter().zip(&chunk);
            let chunks = extents.map(|(extent, chunk)| extent.div_ceil(u64::from(*chunk).max(1)));
            let chunks = chunks.fold(1u64, u64::saturating_mul);
            let elements = chunk.iter().fold(size, |bytes, extent| bytes.saturating_mul(*extent as usize));
            self.charge(object, usize::try_from(chunks).unwrap_or(usize::MAX), elements.saturating_add(CHUNK_ENTRY))?;
        }
        Ok(dataset)
    }

    /// A dataset of numbers with so many extents. Integers become numbers.
    fn numbers(&self, object: &str, extents: usize) -> Result<Numbers, TmdError> {
        let failed = |source| hdf5(self.path, object, source);
        let dataset = self.dataset(object, 2 * size_of::<f64>())?;
        let shape: Vec<usize> = dataset.shape().iter().map(|extent| *extent as usize).collect();
        if shape.len() != extents {
            return Err(self.wrong(object, format!("has {} extents instead of {extents}", shape.len())));
        }
        let values = match dataset.dtype() {
            Datatype::FloatingPoint { size: 4, .. } => {
                dataset.read_array::<f32>().map_err(failed)?.iter().map(|value| f64::from(*value)).collect()
            }
            Datatype::FixedPoint { size: 8, .. } => {
                dataset.read_array::<i64>().map_err(failed)?.iter().map(|value| *value as f64).collect()
            }
            Datatype::FixedPoint { .. } => {
                dataset.read_array::<i32>().map_err(failed)?.iter().map(|value| f64::from(*value)).collect()
            }
            _ => dataset.read_array::<f64>().map_err(failed)?.iter().copied().collect(),
        };
        Ok(Numbers { object: object.to_owned(), shape, values })
    }

    fn strings(&self, object: &str) -> Result<Vec<String>, TmdError> {
        let failed = |source| hdf5(self.path, object, source);
        let dataset = self.dataset(object, 2 * size_of::<String>())?;
        let clean = |text: &str| plain(text.trim_matches([' ', '\0'])).into_owned();
        let Datatype::String { size: StringSize::Variable, .. } = dataset.dtype() else {
            let size = dataset.raw_element_size().map_err(failed)?;
            self.charge(
                object,
                usize::try_from(dataset.num_elements().map_err(failed)?).unwrap_or(usize::MAX),
                2 * size,
            )?;
            return Ok(dataset.read_strings().map_err(failed)?.iter().map(|text| clean(text)).collect());
        };
        // Many elements may refer to one long text.
        let references = dataset.read_raw_bytes().map_err(failed)?;
        let text = |reference: &[u8]| {
            let bytes = dataset.resolve_vlen_reference_bytes(reference, 1).map_err(failed)?;
            self.charge(object, bytes.len(), 2)?;
            Ok(clean(&String::from_utf8_lossy(&bytes)))
        };
        references.chunks_exact(dataset.vlen_reference_size()).map(text).collect()
    }

    /// Names of the models. Empty where they can not be told.
    fn models(&self) -> Vec<String> {
        let Ok(dataset) = self.dataset(&format!("{SET}/models"), 2 * size_of::<String>()) else { return Vec::new() };
        let Datatype::Compound { size, fields } = dataset.dtype() else { return Vec::new() };
        let Some(field) = fields.iter().find(|field| field.name == "modelName") else { return Vec::new() };
        let Datatype::String { size: StringSize::Fixed(length), .. } = field.datatype else { return Vec::new() };
        let (first, size) = (field.byte_offset as usize, (*size as usize).max(1));
        let Ok(bytes) = dataset.read_raw_bytes() else { return Vec::new() };
        let name = |record: &[u8]| {
            let text = String::from_utf8_lossy(record.get(first..first + length as usize).unwrap_or_default());
            plain(text.trim_matches([' ', '\0'])).into_owned()
        };
        bytes.chunks_exact(size).map(name).collect()
    }

    fn tmd(&self) -> Result<Tmd, TmdError> {
        let set = self.group(SET)?;
        let data = self.group(&format!("{SET}/{GROUP}"))?;
        let mut notes = self.left_out(&set, &data)?;
        let zero = self.setting(&set, "TAbs")?;
        let zero = zero.ok_or_else(|| self.wrong(SET, "has no attribute TAbs, the 0 of its temperatures [K]"))?;
        let times = self.times()?;
        let nodes = self.nodes(&times, zero, &mut notes)?;
        let linear = self.conductors("GL", times.len(), nodes.len(), &mut notes)?;
        let mut radiative = self.conductors("GR", times.len(), nodes.len(), &mut notes)?;
        let sigma = self.setting(&set, "StefanBoltzmann")?.unwrap_or(STEFAN_BOLTZMANN);
        let ratio = sigma / STEFAN_BOLTZMANN;
        if (ratio - 1.0).abs() > 1e-6 {
            radiative.values.iter_mut().for_each(|value| *value *= ratio);
            notes.push(format!(
                "Its Stefan-Boltzmann constant is {sigma:e} W m-2 K-4: all GR are multiplied by {ratio:.7}."
            ));
        }
        let description = data.attribute("Description").or_else(|_| set.attribute("Description"));
        let description = description.and_then(|text| text.read_string()).unwrap_or_default();
        let description = plain(description.trim_matches([' ', '\0'])).into_owned();
        Ok(Tmd { description, times, nodes, linear, radiative, notes })
    }

    /// Notes about groups and datasets of the file that are not read.
    fn left_out(&self, set: &Group, data: &Group) -> Result<Vec<String>, TmdError> {
        let names =
            |group: &Group, object: &str| group.member_names().map_err(|source| hdf5(self.path, object, source));
        let mut notes = Vec::new();
        let root = self.file.root_group().map_err(|source| hdf5(self.path, "/", source))?;
        for (group, object, read_here) in [(&root, "/", SET), (set, SET, GROUP)] {
            for other in names(group, object)?.0.iter().filter(|name| *name != read_here) {
                notes.push(format!("The group {} beside {read_here} is left out.", plain(other)));
            }
        }
        for other in names(set, SET)?.1.iter().chain(&names(data, GROUP)?.1) {
            let is_conductor = other.starts_with("conductor");
            if is_conductor
                && !["conductorsGL", "conductorsGR", "conductorDataGL", "conductorDataGR"].contains(&&**other)
            {
                notes.push(format!("The dataset {} is left out: a network file has GL and GR only.", plain(other)));
            }
        }
        Ok(notes)
    }

    fn times(&self) -> Result<Vec<f64>, TmdError> {
        let times = self.numbers(&format!("{SET}/{GROUP}/times"), 1)?;
        if times.values.is_empty() {
            return Err(self.wrong(&times.object, "is empty: the file has no results"));
        }
        for (number, time) in times.values.iter().enumerate() {
            let checked = SceneTime::new(*time);
            checked.map_err(|error| self.wrong(&times.object, format!("time {}: {error}", number + 1)))?;
        }
        if let Some(pair) = times.values.windows(2).find(|pair| pair[1] <= pair[0]) {
            let message = format!("must ascend, but {} follows {}", pair[1], pair[0]);
            return Err(self.wrong(&times.object, message));
        }
        Ok(times.values)
    }

    fn nodes(&self, times: &[f64], zero: f64, notes: &mut Vec<String>) -> Result<Vec<TmdNode>, TmdError> {
        let listed = self.numbers(&format!("{SET}/thermalNodes"), 2)?;
        let count = listed.rows();
        let columns = listed.shape[1];
        if columns == 0 {
            return Err(self.wrong(&listed.object, "has no column"));
        }
        let table = self.node_table(times, count, notes)?;
        let names = self.node_names(&listed);
        let mut nodes = Vec::with_capacity(count);
        for (node, name) in names.into_iter().enumerate() {
            nodes.push(self.node(&table, node, (listed.values[node * columns] as i64, name), zero)?);
        }
        let changed = (0..count).filter(|node| table.changes_type(*node)).count();
        if changed > 0 {
            notes.push(format!("{changed} nodes change their type over time: that of the first time is taken."));
        }
        let mut known = std::collections::HashSet::new();
        match nodes.iter().find(|node| !known.insert(&*node.name)) {
            Some(twice) => Err(self.wrong(&listed.object, format!("two nodes have the number {}", twice.name))),
            None => Ok(nodes),
        }
    }

    /// Reads the attributes of all nodes. A load without an attribute is noted.
    fn node_table<'t>(
        &self,
        times: &'t [f64],
        count: usize,
        notes: &mut Vec<String>,
    ) -> Result<NodeTable<'t>, TmdError> {
        let real = self.numbers(&format!("{SET}/{GROUP}/thermalNodesRealData"), 3)?;
        let names = self.strings(&format!("{SET}/thermalNodesRealAttributes"))?;
        let wanted = [times.len(), count, names.len()];
        if real.shape != wanted {
            let message = format!(
                "has the extents {:?}; {} times, {count} nodes and {} attributes need {wanted:?}",
                real.shape,
                times.len(),
                names.len()
            );
            return Err(self.wrong(&real.object, message));
        }
        let column = |name: &str| names.iter().position(|known| known.eq_ignore_ascii_case(name));
        let needed =
            |name: &str| column(name).ok_or_else(|| self.wrong(&real.object, format!("has no attribute {name}")));
        let [temperature, capacitance] = [needed("Temperature")?, needed("Capacitance")?];
        let loads = LOADS.map(|name| {
            if column(name).is_none() {
                notes.push(format!("It has no attribute {name}, which counts as 0."));
            }
            column(name)
        });
        let places = ["X_Coordinate", "Y_Coordinate", "Z_Coordinate"].map(column);
        let object = format!("{SET}/{GROUP}/thermalNodesStringData");
        let texts = self.strings(&object)?;
        let text_names = self.strings(&format!("{SET}/thermalNodesStringAttributes"))?;
        if texts.len() != times.len() * count * text_names.len() {
            return Err(
                self.wrong(&object, format!("has {} texts for {} times and {count} nodes", texts.len(), times.len()))
            );
        }
        let text_column = |name: &str| text_names.iter().position(|known| known.eq_ignore_ascii_case(name));
        let kind = text_column("Type").ok_or_else(|| self.wrong(&object, "has no attribute Type"))?;
        Ok(NodeTable {
            times,
            count,
            attributes: names.len(),
            real,
            temperature,
            capacitance,
            loads,
            places,
            text_attributes: text_names.len(),
            label: text_column("Label"),
            kind,
            text_object: object,
            texts,
        })
    }

    /// Names of the nodes: their numbers, after the name or number of their model where there are several models.
    fn node_names(&self, listed: &Numbers) -> Vec<String> {
        let (count, columns) = (listed.rows(), listed.shape[1]);
        let models = self.models();
        let model_of = |node: usize| if columns > 1 { listed.values[node * columns + 1] as i64 } else { 1 };
        let several = (1..count).any(|node| model_of(node) != model_of(0));
        let name = |node: usize| {
            let number = listed.values[node * columns] as i64;
            let model = model_of(node);
            let known =
                usize::try_from(model - 1).ok().and_then(|place| models.get(place)).filter(|name| !name.is_empty());
            match (several, known) {
                (false, _) => number.to_string(),
                (true, Some(known)) => format!("{known}:{number}"),
                (true, None) => format!("{model}:{number}"),
            }
        };
        (0..count).map(name).collect()
    }

    fn node(
        &self,
        table: &NodeTable,
        node: usize,
        (number, name): (i64, String),
        zero: f64,
    ) -> Result<TmdNode, TmdError> {
        let times = table.times;
        let over = |column: usize, quantity: &str| {
            let values = table.values(node, column);
            match values.iter().position(|value| !value.is_finite()) {
                None => Ok(values),
                Some(at) => {
                    let message =
                        format!("{quantity} of node {name} at {} s is {}, not a number", times[at], values[at]);
                    Err(self.wrong(&table.real.object, message))
                }
            }
        };
        let kind = table.text(0, node, table.kind).chars().next().unwrap_or(' ').to_ascii_uppercase();
        if !"DABX".contains(kind) {
            let message = format!("node {name} is of type '{kind}'; isotherm knows D, A, B and X");
            return Err(self.wrong(&table.text_object, message));
        }
        let place =
            |column: Option<usize>| column.map_or(Ok(0.0), |column| over(column, "the place").map(|values| values[0]));
        let load =
            |which: usize| table.loads[which].map_or(Ok(vec![0.0; times.len()]), |column| over(column, LOADS[which]));
        let mut temperatures = over(table.temperature, "the temperature")?;
        temperatures.iter_mut().for_each(|value| *value += zero);
        if let Some(below) = temperatures.iter().find(|value| **value < 0.0 && kind != 'X') {
            return Err(self.wrong(&table.real.object, format!("node {name} is at {below} K, below 0 K")));
        }
        let [x, y, z] = table.places;
        Ok(TmdNode {
            number,
            label: table.label.map(|column| table.text(0, node, column).clone()).unwrap_or_default(),
            kind,
            position: DVec3::new(place(x)?, place(y)?, place(z)?),
            temperatures,
            capacitances: over(table.capacitance, "the capacitance")?,
            loads: [load(0)?, load(1)?, load(2)?, load(3)?, load(4)?],
            name,
        })
    }

    fn conductors(
        &self,
        kind: &str,
        times: usize,
        nodes: usize,
        notes: &mut Vec<String>,
    ) -> Result<Conductors, TmdError> {
        let ends = self.numbers(&format!("{SET}/conductors{kind}"), 2)?;
        let data = self.numbers(&format!("{SET}/{GROUP}/conductorData{kind}"), 3)?;
        let count = ends.rows();
        let (columns, per) = (ends.shape[1], data.shape[2]);
        if count > 0 && (columns < 2 || per == 0 || data.shape[..2] != [times, count]) {
            let message = format!("has the extents {:?} for {times} times and {count} conductors", data.shape);
            return Err(self.wrong(&data.object, message));
        }
        let mut conductors = Conductors::default();
        let mut second = 0;
        for conductor in 0..count {
            let end = |column: usize| {
                let place = ends.values[conductor * columns + column];
                if place >= 1.0 && place <= nodes as f64 {
                    return Ok(place as u32 - 1);
                }
                let message = format!("conductor {} joins node {place} of {nodes}", conductor + 1);
                Err(self.wrong(&ends.object, message))
            };
            conductors.nodes.push([end(0)?, end(1)?]);
            let value = |time: usize| data.values[(time * count + conductor) * per];
            let first = value(0);
            let mut change = 0.0_f64;
            for time in 0..times {
                let value = value(time);
                if !value.is_finite() || value < 0.0 {
                    let message = format!("conductor {} is {value} at time {}", conductor + 1, time + 1);
                    return Err(self.wrong(&data.object, message));
                }
                change = change.max((value - first).abs() / first.max(f64::MIN_POSITIVE));
            }
            conductors.values.push(first);
            conductors.changing += usize::from(change > 0.0);
            conductors.change = conductors.change.max(change);
            second += usize::from(per > 1 && data.values[conductor * per + 1] != 1.0);
        }
        if second > 0 {
            notes.push(format!(
                "The second number of {second} {kind}, whose meaning isotherm does not know, is not 1; it is left out."
            ));
        }
        Ok(conductors)
    }
}
