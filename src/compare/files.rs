//! Writes the files of a comparison.

use rayon::prelude::*;

use super::differences::table;
use super::page::ComparePage;
use super::runs::Runs;
use super::{INSTANT, NETWORK, RESPONSES, TRANSITION};
use crate::output::OutputError;
use crate::output::colour::ColourScale;
use crate::output::comparison::{Legend, panel, sheet};
use crate::output::comparison_plots::{MOST_PLOTS, NamedSeries, differences, temperatures};
use crate::output::eclipses::Eclipses;
use crate::output::folder::Folder;
use crate::output::report::{ReportPicture, write_plots};
use crate::text::time_of_step;

pub(crate) const PAGE: &str = "compare.html";
/// Differences by part.
pub(crate) const TABLE: &str = "compare.csv";
/// Differences of all nodes over time.
pub(crate) const OVER_TIME: &str = "differences.csv";
/// All shown steps on one sheet.
pub(crate) const SHEET: &str = "comparison.png";

pub(crate) fn own_files() -> Vec<String> {
    let names = [PAGE, TABLE, OVER_TIME, SHEET, "panels/step_#.png", "plots/*.svg"].map(str::to_owned);
    names.into_iter().chain(RESPONSES.map(series_name)).collect()
}

fn series_name(response: &str) -> String {
    format!("series_{response}.csv")
}

/// Writes every file. `pictured` is called after each picture.
pub(crate) fn write(
    folder: &Folder,
    runs: &Runs,
    page: &ComparePage,
    pictured: &(dyn Fn() + Sync),
) -> Result<(), OutputError> {
    let network = &runs.ran[NETWORK];
    let scene = &network.prepared.scene;
    let compared = [INSTANT, TRANSITION].map(|run| (RESPONSES[run], &runs.ran[run].differences));
    let materials: Vec<String> = network.prepared.materials.iter().map(|material| material.name.clone()).collect();
    let rows = table(network.series.parts(), &materials, &runs.vertices, &compared, scene.time.step);
    folder.write_csv(TABLE, rows)?;
    folder.write_csv(OVER_TIME, over_time(runs))?;
    for (name, ran) in RESPONSES.iter().zip(&runs.ran) {
        let file = series_name(name);
        folder.write(&file, |writer| {
            ran.series.write(writer).map_err(|source| OutputError::Write(folder.file(&file), source))
        })?;
    }

    let mut pictures = Vec::new();
    if !runs.views.is_empty() {
        let title = format!("{}: instant, transition, network", scene.name);
        let legend = Legend::new(&title, RESPONSES, &runs.views, scene.colour_range);
        let details = details(runs, &legend.temperature);
        let png = sheet(&runs.views, &legend, &details)?.png()?;
        folder.write_bytes(SHEET, &png)?;
        pictures.push(ReportPicture {
            title: "Temperatures under each response, and their differences from the network".to_owned(),
            file: SHEET.to_owned(),
            png,
        });
        let panels = runs.views.par_iter().map(|view| {
            let file = format!("panels/step_{:06}.png", view.step);
            let png = panel(view, &legend)?.png()?;
            folder.write_bytes(&file, &png)?;
            pictured();
            Ok(ReportPicture { title: view.caption.clone(), file, png })
        });
        pictures.extend(panels.collect::<Result<Vec<_>, OutputError>>()?);
    }

    let shades = Eclipses::of(&network.prepared);
    let lines = [INSTANT, TRANSITION].map(|run| {
        let steps = &runs.ran[run].differences.steps;
        (RESPONSES[run], steps.iter().map(|step| [step.time, step.rms]).collect())
    });
    let responses: Vec<NamedSeries> =
        RESPONSES.iter().zip(&runs.ran).map(|(name, ran)| NamedSeries { name, series: &ran.series }).collect();
    let mut parts = runs.farthest_parts();
    parts.truncate(MOST_PLOTS);
    let mut plots = vec![differences(&lines, network.series.rows(), RESPONSES[NETWORK], &shades)?];
    plots.extend(temperatures(&responses, &parts, &shades)?);
    write_plots(folder, &plots)?;
    let tables: Vec<String> =
        [TABLE, OVER_TIME].map(str::to_owned).into_iter().chain(RESPONSES.map(series_name)).collect();
    folder.write_bytes(PAGE, page.html(runs, &tables, &pictures, &plots).as_bytes())
}

fn details(runs: &Runs, scale: &ColourScale) -> String {
    let band = if runs.ran[NETWORK].prepared.scene.colour_range.is_some() { "the scene's" } else { "of all pictures" };
    format!(
        "{} of the drawn steps; one colour scale for all temperatures ({band}, {} to {} K), one for all differences",
        runs.views.len(),
        scale.lower,
        scale.upper
    )
}

/// Rows of `differences.csv`: time [s], then mean, rms and max [K] over all nodes, for instant and for transition.
fn over_time(runs: &Runs) -> Vec<Vec<String>> {
    let mut head = vec!["time".to_owned()];
    for run in [INSTANT, TRANSITION] {
        head.extend(["mean", "rms", "max"].map(|what| format!("{}:{what}", RESPONSES[run])));
    }
    let [instant, transition] = [INSTANT, TRANSITION].map(|run| &runs.ran[run].differences.steps);
    let row = |(a, b): (&super::differences::OfStep, &super::differences::OfStep)| {
        let values = [a.mean, a.rms, f64::from(a.max), b.mean, b.rms, f64::from(b.max)];
        std::iter::once(time_of_step(a.time)).chain(values.map(|value| format!("{value:.6}"))).collect()
    };
    std::iter::once(head).chain(instant.iter().zip(transition).map(row)).collect()
}
