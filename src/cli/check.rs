//! `isotherm check`: looks for probable mistakes in a scene, without running it.

use std::path::PathBuf;

use super::arguments::folder;
use super::columns::aligned;
use super::error::CliError;
use super::progress::{building_bar, show_stage};
use super::reach::ReachArguments;
use crate::guard::finding::{CheckEffort, short};
use crate::guard::identity::{Identity, of_first_image, of_whole_craft};
use crate::guard::materials::AT;
use crate::guard::{Checked, check};
use crate::output::console::{answer, say};
use crate::output::folder::Folder;
use crate::output::material_picture::{LegendEntry, material_picture};
use crate::simulation::prepare::Prepared;
use crate::text::plain_json;

/// Files that the command writes.
const IMAGE: &str = "materials.png";
const WHOLE: &str = "craft.png";
const FILES: [&str; 2] = [IMAGE, WHOLE];
/// Most pairs of neighbours in the table.
const NEIGHBOURS: usize = 30;

/// Look for what is probably wrong in a scene, without running it.
///
/// Errors of the scene file are told all at once, and the exit code is 2. Otherwise the command prints the size of the craft in metres and in pixels, a
/// table of the materials with their time constants beside the step, and warnings: a craft out of view, a camera inside it, a model in mm, normals
/// that point inward, a thickness or density in the wrong unit, materials hotter than 500 K in balance, meshes too coarse for shadows or
/// conduction. Each warning says what to do. With warnings alone the exit code is 0, or 2 with --strict.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  isotherm check models/station.toml\n  isotherm check models/station.toml -o out/check\n  \
isotherm check models/station.toml --json --strict"
)]
pub(crate) struct Arguments {
    /// Scene file (TOML, described in docs/scene.md)
    scene: PathBuf,
    /// Folder for pictures with each material in its own colour: what the camera sees first, and the whole craft
    #[arg(short, long, value_name = "DIR", value_parser = folder())]
    output: Option<PathBuf>,
    /// Replace the files that isotherm wrote into the output folder
    #[arg(long, requires = "output")]
    force: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// Exit with code 2 where a warning holds
    #[arg(long)]
    strict: bool,
    #[command(flatten)]
    reach: ReachArguments,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let scene = arguments.reach.scene(&arguments.scene)?;
    let bar = building_bar();
    let prepared = Prepared::from_scene(scene, &mut |stage| show_stage(&bar, stage));
    bar.finish_and_clear();
    let prepared = prepared?;
    let checked = check(&prepared, CheckEffort::WHOLE);
    if let Some(output) = &arguments.output {
        let folder = Folder::new(output, &FILES).prepare(arguments.force, &prepared.scene.files)?;
        for (name, bytes) in pictures(&prepared, &checked)? {
            folder.write_bytes(name, &bytes)?;
            say!("{}", folder.file(name).display());
        }
        folder.finish()?;
    }
    if arguments.json {
        let value = serde_json::json!({
            "scene": prepared.scene.name,
            "nodes": prepared.nodes.count,
            "triangles": prepared.triangle_count(),
            "step_s": prepared.scene.time.step,
            "checked": checked,
            "remarks": prepared.warnings,
        });
        answer!("{}", plain_json(&format!("{value:#}")));
    } else {
        answer!("{}", text(&prepared, &checked).trim_end());
        checked.findings.iter().for_each(|finding| answer!("warning: {finding}"));
        prepared.warnings.iter().for_each(|remark| answer!("remark: {remark}"));
        if checked.findings.is_empty() {
            answer!("nothing is probably wrong");
        }
    }
    match checked.findings.len() {
        count if arguments.strict && count > 0 => {
            Err(CliError::Usage(format!("{count} of the warnings hold, and --strict takes none")))
        }
        _ => Ok(()),
    }
}

/// Size of the craft, its place in the images, and the table of materials.
fn text(prepared: &Prepared, checked: &Checked) -> String {
    let [x, y, z] = checked.size_m().map(short);
    let mut text = format!(
        "{}: {x} x {y} x {z} m, {} parts, {} nodes, {} triangles\n",
        prepared.scene.name,
        prepared.parts.len(),
        prepared.nodes.count,
        prepared.triangle_count()
    );
    match &checked.sight {
        None => text.push_str("no image is drawn\n"),
        Some(sight) => {
            let size = prepared.scene.camera.as_ref().map_or([0; 2], |camera| [camera.width, camera.height]);
            let extent = match sight.first_px {
                Some([width, height]) => format!("{width:.1} x {height:.1} pixels"),
                None => "beside or behind the camera in part".to_owned(),
            };
            text.push_str(&format!(
                "its box in the first image, at {} s from {} m away: {extent}, in an image of {} x {}\nin view in {} of {} images that were looked at, \
                 of {}\n",
                sight.first_s,
                short(sight.first_distance_m),
                size[0],
                size[1],
                sight.looked_at - sight.out_of_view,
                sight.looked_at,
                sight.images
            ));
        }
    }
    let head = ["material", "response", "area m2", "hottest K", "J/(m2 K)", "tau s", "tau/step", "conducts over m"];
    let cell = |value: Option<f64>, digits: usize| value.map_or("-".to_owned(), |value| format!("{value:.digits$}"));
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    for fact in &checked.materials {
        rows.push(vec![
            fact.name.clone(),
            fact.response.to_owned(),
            format!("{:.3}", fact.area_m2),
            format!("{:.0}", fact.hottest_k),
            cell(fact.capacity, 0),
            cell(fact.time_constant_s, 1),
            cell(fact.time_constant_steps, 1),
            cell(fact.conduction_length_m, 3),
        ]);
    }
    text.push_str(&format!(
        "\nMaterials. The hottest temperature is the balance in full sunlight; tau is the time constant at {AT} K, or t_max; a step is {} s\n",
        prepared.scene.time.step
    ));
    aligned(&rows, 2).iter().for_each(|line| text.push_str(&format!("  {line}\n")));
    text.push_str(&neighbours(checked));
    text
}

/// The table of neighbours without contact.
fn neighbours(checked: &Checked) -> String {
    let count = checked.neighbours.len();
    if count == 0 {
        return String::new();
    }
    let mut rows = vec![
        ["neighbours", "apart by", "length or area", "W/K", "left of their difference"].map(str::to_owned).to_vec(),
    ];
    rows.extend(checked.neighbours.iter().take(NEIGHBOURS).map(|pair| {
        let left = format!("{:.1} %", 100.0 * pair.remaining);
        vec![pair.names(), pair.reason(), pair.extent(), short(pair.conductance_w_k), left]
    }));
    let per_area = short(checked.neighbours[0].conductance_w_k / checked.neighbours[0].area_m2);
    let mut text = format!("\nNeighbours without contact, and what {per_area} W/(m2 K) would do\n");
    aligned(&rows, 2).iter().for_each(|line| text.push_str(&format!("  {line}\n")));
    if count > NEIGHBOURS {
        text.push_str(&format!("  and {} more, which --json lists\n", count - NEIGHBOURS));
    }
    text
}

/// The pictures with the materials in colours.
fn pictures(prepared: &Prepared, checked: &Checked) -> Result<Vec<(&'static str, Vec<u8>)>, CliError> {
    let materials: Vec<LegendEntry> =
        checked.materials.iter().map(|fact| (fact.name.clone(), format!("{:.2} m2", fact.area_m2))).collect();
    let picture = |identity: &Identity, details: &str| -> Result<Vec<u8>, CliError> {
        let title = format!("{}: materials", prepared.scene.name);
        Ok(material_picture(identity.width, &identity.pixels, &materials, &title, details)?.png()?)
    };
    let mut pictures = Vec::new();
    if let Some((time, identity)) = of_first_image(prepared) {
        pictures.push((IMAGE, picture(&identity, &format!("the first image, at {time} s"))?));
    }
    let [x, y, z] = checked.size_m().map(short);
    let details = format!("the whole craft from +X, -Y, +Z; {x} x {y} x {z} m");
    pictures.push((WHOLE, picture(&of_whole_craft(prepared), &details)?));
    Ok(pictures)
}
