//! `compare.html`: the results of a comparison on one page that needs no network and no script.

use super::responses::{ResponseOrigin, domain_text, notes, profile_text};
use super::runs::{ComparedRun, Runs};
use super::{INSTANT, NETWORK, RESPONSES, TRANSITION};
use crate::output::html::{Html, kelvin, significant, thousands};
use crate::output::report::{PlotEntry, ReportPicture};
use crate::output::settings;
use crate::simulation::prepare::Prepared;
use crate::thermal::step_response::Fitted;

/// Further facts on the page.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct ComparePage {
    pub(crate) command_line: String,
    /// Wall time of the command up to this page [s].
    pub(crate) wall_s: f64,
}

impl ComparePage {
    /// The page. `tables` are the names of the CSV files.
    pub(crate) fn html(
        &self,
        runs: &Runs,
        tables: &[String],
        pictures: &[ReportPicture],
        plots: &[PlotEntry],
    ) -> String {
        let prepared = &runs.ran[NETWORK].prepared;
        let scene = &prepared.scene;
        let mut html = Html::page(&format!("{} - three responses - isotherm", scene.name));
        html.element("h1", &format!("{}: three responses", scene.name));
        let version = env!("CARGO_PKG_VERSION");
        html.element("p", &format!("{}, with isotherm {version} on {}", scene.source.display(), runs.device));
        html.raw("</header>\n<main>\n");
        headline(&mut html, runs);
        html.element(
            "p",
            "Instant: the balance temperature of the moment, without memory. Transition: a profile in temperature towards \
             that balance. Network: the energy balance of every node with its capacitance, conduction and radiation. \
             Differences are against the network.",
        );
        html.list("Warnings", &warnings(runs), "warning");
        let panels = match pictures {
            [] => {
                html.element("p", "The scene draws no step, or has no camera: there are no pictures.");
                &[][..]
            }
            [sheet, panels @ ..] => {
                html.picture(&sheet.png, &sheet.title, &sheet.file);
                panels
            }
        };
        for plot in plots {
            html.figure(&plot.svg, &plot.title, &plot.file);
        }
        parts(&mut html, runs);
        cost(&mut html, runs);
        functions(&mut html, runs);
        let network = prepared.network.as_ref().map(|network| network.description()).unwrap_or_default();
        html.element("h2", "Thermal network");
        html.pairs(network.into_iter().chain(runs.ran[NETWORK].network.iter().cloned()));
        if !panels.is_empty() {
            html.element("h2", "Step by step");
        }
        for picture in panels {
            html.picture(&picture.png, &picture.title, &picture.file);
        }
        let mut said = notes(prepared, &runs.materials, &scene.source);
        said.extend(scene.assumptions.iter().cloned());
        html.list("Assumed", &said, "plain");
        html.element("h2", "Settings");
        html.settings(&settings::groups(prepared));
        self.inputs(&mut html, prepared);
        let names = tables.iter().chain(pictures.iter().map(|one| &one.file)).chain(plots.iter().map(|one| &one.file));
        html.files(names.map(String::as_str));
        html.into_page()
    }

    fn inputs(&self, html: &mut Html, prepared: &Prepared) {
        html.element("h2", "Inputs");
        html.command(&self.command_line);
        let rows =
            prepared.scene.files.iter().map(|path| vec![path.display().to_string(), prepared.hashes.of_file(path)]);
        html.table(&["file", "SHA-256"], rows);
        html.element("p", &format!("{} s in all, pictures included", significant(self.wall_s)));
    }
}

fn headline(html: &mut Html, runs: &Runs) {
    let mut figures = Vec::new();
    for run in [INSTANT, TRANSITION] {
        let all = &runs.ran[run].differences.all;
        figures.push((kelvin(all.rms()), format!("rms, {} against network", RESPONSES[run])));
    }
    for (run, ran) in runs.ran.iter().enumerate() {
        if let Some(step) = &ran.cost.step {
            figures.push(((significant(step.median), "ms"), format!("a step, {}", RESPONSES[run])));
        }
    }
    html.headline(figures.into_iter().map(|((value, unit), what)| (value, unit.to_owned(), what)));
}

/// The warnings of the scene and of the runs.
fn warnings(runs: &Runs) -> Vec<String> {
    let of_scene = runs.ran[NETWORK].prepared.warnings.iter().cloned();
    of_scene.chain(runs.warnings()).collect()
}

fn parts(html: &mut Html, runs: &Runs) {
    html.element("h2", "Differences from the network by part");
    html.element(
        "p",
        "Over the area of the part and all steps; the largest with its sign, when and where it is. Parts are in the order of \
         instant's rms.",
    );
    let prepared = &runs.ran[NETWORK].prepared;
    let step = prepared.scene.time.step;
    let names = runs.ran[NETWORK].series.parts();
    let head =
        ["part", "area [m²]", "response", "rms [K]", "mean [K]", "largest [K]", "time [s]", "step", "node", "material"];
    let mut rows = Vec::new();
    for part in runs.farthest_parts().into_iter().map(Some).chain([None]) {
        for run in [INSTANT, TRANSITION] {
            let differences = &runs.ran[run].differences;
            let group = part.map_or(&differences.all, |part| &differences.parts[part]);
            let Some(largest) = group.largest() else { continue };
            let vertex = largest.vertex as usize;
            rows.push(vec![
                part.map_or("all", |part| names[part].as_str()).to_owned(),
                significant(group.area),
                RESPONSES[run].to_owned(),
                format!("{:.2}", group.rms()),
                format!("{:.2}", group.mean()),
                format!("{:.1}", largest.difference),
                format!("{:.0}", f64::from(largest.step) * step),
                largest.step.to_string(),
                largest.vertex.to_string(),
                prepared.materials[runs.vertices.materials[vertex] as usize].name.clone(),
            ]);
        }
    }
    html.table(&head, rows);
}

fn cost(html: &mut Html, runs: &Runs) {
    html.element("h2", "Cost");
    html.element(
        "p",
        &format!(
            "On {}, one run after the other. A step is wall-clock time on the host from its submission until it is done; an \
             image, until its temperatures and labels are on the host.",
            runs.device
        ),
    );
    let number = |value: Option<f64>| value.map_or("-".to_owned(), significant);
    let row = |(name, ran): (&&str, &ComparedRun)| {
        let cost = &ran.cost;
        let step = cost.step.as_ref();
        vec![
            (*name).to_owned(),
            number(step.map(|time| time.median)),
            number(step.map(|time| time.p10)),
            number(step.map(|time| time.p90)),
            number(cost.device_step_ms),
            number(cost.image.as_ref().map(|time| time.median)),
            ran.periodic
                .map_or_else(|| format!("{} steps", cost.warm_up), |periodic| format!("{} orbits", periodic.orbits)),
            significant(cost.warm_up_s),
            significant(cost.wall_s),
        ]
    };
    let head = [
        "response",
        "step, median [ms]",
        "10 % [ms]",
        "90 % [ms]",
        "loads and transitions on the device, mean [ms]",
        "image [ms]",
        "warm-up",
        "warm-up [s]",
        "run [s]",
    ];
    html.table(&head, RESPONSES.iter().zip(&runs.ran).map(row));
    let nodes = thousands(runs.ran[NETWORK].prepared.nodes.count as u64);
    html.element("p", &format!("{nodes} drawn nodes, {} steps.", runs.ran[NETWORK].prepared.scene.time.steps));
}

fn functions(html: &mut Html, runs: &Runs) {
    html.element("h2", "Functions of the transition");
    let step = runs.ran[TRANSITION].prepared.scene.time.step;
    let rows = runs.materials.iter().map(|material| {
        let profiles = match &material.transition {
            None => ["instant", "instant", "-"].map(str::to_owned),
            Some(one) => {
                let [heating, cooling] = [&one.heating, &one.cooling].map(|profile| profile_text(profile, step));
                [heating, cooling, domain_text(one.domain).to_owned()]
            }
        };
        let (origin, residual) = match &material.origin {
            ResponseOrigin::Stated => ("the scene".to_owned(), "-".to_owned()),
            ResponseOrigin::Kept => ("instant in all runs".to_owned(), "-".to_owned()),
            ResponseOrigin::Fitted(fitted) => fitted_text(fitted),
        };
        std::iter::once(material.name.clone()).chain(profiles).chain([origin, residual]).collect()
    });
    html.table(&["material", "heating", "cooling", "moves", "from", "rms residual [K]"], rows);
}

fn fitted_text(fitted: &Fitted) -> (String, String) {
    let [cold, hot] = fitted.between;
    let residual = |[rms, _]: [f64; 2]| format!("{rms:.2}");
    let residuals = format!("{} heating, {} cooling", residual(fitted.heating), residual(fitted.cooling));
    (format!("step response between {cold:.0} and {hot:.0} K"), residuals)
}
