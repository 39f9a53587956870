//! `isotherm materials`: lists, searches and converts a table of materials.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

use super::columns::aligned;
use super::error::CliError;
use crate::output::console::answer;
use crate::output::destination::{Destination, destinations};
use crate::output::inputs::keep_inputs;
use crate::scene::{MaterialRecord, StatedOptics, read_material_records};
use crate::text::plain_json;

const EXAMPLES: &str = "\
Examples:
  isotherm materials
  isotherm materials white paint --finishes
  isotherm materials bulk_invar_36
  isotherm materials --csv -o materials.csv
  isotherm materials kapton --table mine.toml --json

CSV and JSON have the keys and units of a table (docs/scene.md): temperatures
in K, density in kg/m3, specific_heat in J/(kg K), conductivity in W/(m K).
The end of life is named _eol. Of a table of your own, the response, gloss, laws
of emissivity and what lies under a blanket are left out.";

/// Up to this many entries are printed whole.
const WHOLE: usize = 4;

/// List the materials of a table, search them, or convert them to CSV or JSON.
///
/// An entry matches if its name, its finish or its sources hold every word. Case does not count. Up to four entries are printed whole, with their
/// sources, as keys of a table; more are printed as lines.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Words to search for
    #[arg(value_name = "WORD")]
    words: Vec<String>,
    /// Table to read [default: the one that comes with the program, models/materials.toml]
    #[arg(long, value_name = "FILE")]
    table: Option<PathBuf>,
    /// Only entries with density, specific heat or conductivity
    #[arg(long)]
    bulk: bool,
    /// Only entries with absorptivity or emissivity
    #[arg(long, conflicts_with = "bulk")]
    finishes: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// Print CSV
    #[arg(long, conflicts_with = "json")]
    csv: bool,
    /// File to write [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    if let Some(output) = &arguments.output {
        keep_inputs(output, arguments.table.as_ref())?;
    }
    let [output] = destinations([arguments.output.as_deref()])?;
    let records =
        read_material_records(arguments.table.as_deref()).map_err(|error| CliError::Usage(error.to_string()))?;
    let matches: Vec<&MaterialRecord> = records.iter().filter(|record| is_wanted(record, arguments)).collect();
    if matches.is_empty() {
        return Err(CliError::Usage(nothing(arguments, records.len())));
    }
    if arguments.csv {
        let rows = std::iter::once(COLUMNS.map(str::to_owned).to_vec()).chain(matches.iter().map(|record| row(record)));
        return Ok(output.unwrap_or(Destination::StandardOutput).write_csv(rows)?);
    }
    let text = if arguments.json {
        let entries: Vec<Value> = matches.iter().map(|record| Value::Object(keys(record))).collect();
        plain_json(&format!("{:#}", Value::Array(entries))).into_owned()
    } else if matches.len() <= WHOLE {
        matches.iter().map(|record| whole(record)).collect::<Vec<_>>().join("\n\n")
    } else {
        lines(&matches)
    };
    match output {
        Some(output) => output.write_bytes(format!("{text}\n").as_bytes())?,
        None => answer!("{text}"),
    }
    Ok(())
}

fn is_wanted(record: &MaterialRecord, arguments: &Arguments) -> bool {
    let texts =
        [record.name.as_str(), record.finish.as_str()].into_iter().chain(record.sources().map(|(_, text)| text));
    let searched = texts.collect::<Vec<_>>().join("\n").to_lowercase();
    let kind = match (arguments.bulk, arguments.finishes) {
        (true, _) => record.bulk_source.is_some(),
        (_, true) => record.optics_source.is_some(),
        _ => true,
    };
    kind && arguments.words.iter().all(|word| searched.contains(&word.to_lowercase()))
}

fn nothing(arguments: &Arguments, entries: usize) -> String {
    let table =
        arguments.table.as_deref().unwrap_or(Path::new("the table that comes with the program")).display().to_string();
    let kind = match (arguments.bulk, arguments.finishes) {
        (true, _) => " with bulk values",
        (_, true) => " with optics",
        _ => "",
    };
    let words = arguments.words.join("', '");
    let searched = if words.is_empty() { String::new() } else { format!(" has the words '{words}'") };
    format!(
        "none of the {entries} entries of {table}{kind}{searched}: search for fewer words, or list all of them without any"
    )
}

/// The keys of an entry in a table, with the values that it states.
fn keys(record: &MaterialRecord) -> Map<String, Value> {
    let mut keys = Map::new();
    let mut state = |key: &str, value: Value| {
        if !value.is_null() {
            keys.insert(key.to_owned(), value);
        }
    };
    state("name", json!(record.name));
    state("finish", json!(record.finish));
    let StatedOptics { absorptivity, emissivity } = record.outside;
    state("absorptivity", json!(absorptivity));
    state("emissivity", json!(emissivity));
    state("absorptivity_eol", json!(record.aged.absorptivity));
    state("emissivity_eol", json!(record.aged.emissivity));
    state("eol", json!(record.eol));
    state("optics_source", json!(record.optics_source));
    state("sides", json!(record.sides));
    if record.back_source.is_some() {
        let StatedOptics { absorptivity, emissivity } = record.back;
        state("back", json!({ "absorptivity": absorptivity, "emissivity": emissivity }));
    }
    state("back_source", json!(record.back_source));
    let bulk = &record.bulk;
    state("thickness", json!(bulk.thickness));
    state("density", json!(bulk.density));
    state("specific_heat", json!(bulk.specific_heat));
    state("heat_capacity_per_area", json!(bulk.heat_capacity_per_area));
    state("conductivity", json!(bulk.conductivity));
    state("bulk_source", json!(record.bulk_source));
    state("temperature_range", json!(record.temperature_range));
    state("measured", json!(record.measured));
    state("note", json!(record.note));
    keys
}

/// Columns of the CSV. A column with a dot is a key of a key, or a place in a list.
const COLUMNS: [&str; 22] = [
    "name",
    "finish",
    "absorptivity",
    "emissivity",
    "absorptivity_eol",
    "emissivity_eol",
    "eol",
    "sides",
    "back.absorptivity",
    "back.emissivity",
    "thickness",
    "density",
    "specific_heat",
    "heat_capacity_per_area",
    "conductivity",
    "temperature_range.0",
    "temperature_range.1",
    "measured",
    "optics_source",
    "back_source",
    "bulk_source",
    "note",
];

fn row(record: &MaterialRecord) -> Vec<String> {
    let keys = Value::Object(keys(record));
    let cell = |column: &&str| match keys.pointer(&format!("/{}", column.replace('.', "/"))) {
        Some(Value::String(text)) => text.clone(),
        Some(value) if !value.is_null() => value.to_string(),
        _ => String::new(),
    };
    COLUMNS.iter().map(cell).collect()
}

/// An entry as it stands in a table.
fn whole(record: &MaterialRecord) -> String {
    // A JSON string is a string of TOML too.
    let quoted = |text: &str| Value::from(text).to_string();
    let bare = record.name.chars().all(|letter| letter.is_ascii_alphanumeric() || letter == '_' || letter == '-');
    let name = if bare { record.name.clone() } else { quoted(&record.name) };
    let mut lines = vec![format!("[{name}]")];
    for (key, value) in keys(record).iter().skip(1) {
        let value = match value {
            Value::Object(group) => {
                let stated = group.iter().filter(|(_, value)| !value.is_null());
                let pairs = stated.map(|(key, value)| format!("{key} = {value}")).collect::<Vec<_>>();
                format!("{{ {} }}", pairs.join(", "))
            }
            other => other.to_string(),
        };
        lines.push(format!("{key} = {value}"));
    }
    lines.join("\n")
}

/// A line for each entry: finishes first, then bulk.
fn lines(matches: &[&MaterialRecord]) -> String {
    let number = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
    let fixed = |value: Option<f64>| {
        let shortest = number(value);
        if shortest.len() > 4 { shortest } else { value.map_or(String::new(), |value| format!("{value:.2}")) }
    };
    let finishes: Vec<&&MaterialRecord> = matches.iter().filter(|record| record.optics_source.is_some()).collect();
    let bulks: Vec<&&MaterialRecord> = matches.iter().filter(|record| record.bulk_source.is_some()).collect();
    let mut parts = Vec::new();
    if !finishes.is_empty() {
        let mut rows = vec![["finish", "alpha", "eps", "alpha_eol", "eps_eol", ""].map(str::to_owned).to_vec()];
        rows.extend(finishes.iter().map(|record| {
            let (start, end) = (record.outside, record.aged);
            let optics = [start.absorptivity, start.emissivity, end.absorptivity, end.emissivity].map(fixed);
            [vec![record.name.clone()], optics.to_vec(), vec![record.finish.clone()]].concat()
        }));
        parts.push(aligned(&rows, 6).join("\n"));
    }
    if !bulks.is_empty() {
        let heads = ["bulk", "k W/(m K)", "rho kg/m3", "c J/(kg K)", ""];
        let mut rows = vec![heads.map(str::to_owned).to_vec()];
        rows.extend(bulks.iter().map(|record| {
            let bulk = [record.bulk.conductivity, record.bulk.density, record.bulk.specific_heat].map(number);
            [vec![record.name.clone()], bulk.to_vec(), vec![record.finish.clone()]].concat()
        }));
        parts.push(aligned(&rows, 5).join("\n"));
    }
    parts.push(format!(
        "{} finishes, {} materials with bulk values; words narrow the list, and {WHOLE} entries or fewer are printed whole",
        finishes.len(),
        bulks.len()
    ));
    parts.join("\n\n")
}
