//! A fit from its files to its result.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use super::FittingError;
use super::files::{FILES, write};
use super::least_squares::{BestFit, Objective};
use super::measurements::Measurements;
use super::network_model::NetworkModel;
use super::posterior::{DataDirection, Posterior};
use super::prior::Unknown;
use super::result::{FitModel, Fitted};
use super::scene_model::SceneCase;
use super::words::open;
use crate::converge::RunNews;
use crate::files::{self, Reach};
use crate::guard;
use crate::guard::finding::CheckEffort;
use crate::output::folder::Folder;
use crate::output::inputs::real;
use crate::scene::{FitInput, Scene};
use crate::simulation::facade_error::SimulationError;
use crate::simulation::prepare_error::PrepareStage;
use crate::simulation::target::Target;

/// The files of a fit.
pub(crate) struct FitOrder<'a> {
    /// A scene, or a network file.
    pub(crate) model: &'a Path,
    /// Telemetry (`.csv`) and images (`.exr`, `.png`).
    pub(crate) measured: &'a [PathBuf],
    /// Parameters, sensors, images.
    pub(crate) parameters: &'a Path,
    /// The files that the scene may name.
    pub(crate) reach: Reach,
}

/// A fit whose files were read and checked.
pub(crate) struct FitCase<'a> {
    name: String,
    input: FitInput,
    unknowns: Vec<Unknown>,
    model: CaseModel<'a>,
    files: Vec<PathBuf>,
    stop: &'a AtomicBool,
}

enum CaseModel<'a> {
    Scene(Box<SceneCase>),
    Network(Box<NetworkModel<'a>>, Measurements),
}

impl<'a> FitCase<'a> {
    /// Reads and checks all files. `stop` ends the fit; the best values so far are its result.
    ///
    /// # Errors
    /// The first file that is wrong, and measured values or parameters that the model does not have.
    pub(crate) fn load(
        order: &FitOrder<'_>,
        stop: &'a AtomicBool,
        progress: &mut dyn FnMut(PrepareStage),
    ) -> Result<Self, FittingError> {
        let input = FitInput::load(order.parameters, &Reach::of(order.parameters))?;
        let mut given = BTreeSet::new();
        if let Some(twice) = order.measured.iter().find(|path| !given.insert(real(path))) {
            let reason = "is given twice, and would count twice".to_owned();
            return Err(FittingError::Measured { path: twice.clone(), reason });
        }
        let is_table = |path: &&PathBuf| path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv"));
        let (tables, images): (Vec<&PathBuf>, Vec<&PathBuf>) = order.measured.iter().partition(is_table);
        let [tables, images] = [tables, images].map(|all| all.into_iter().cloned().collect::<Vec<PathBuf>>());
        let name = order.model.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let mut files: Vec<PathBuf> = order.measured.to_vec();
        files.push(order.parameters.to_path_buf());
        files.extend(input.images.iter().filter_map(|rule| rule.mask.clone()));
        let (model, unknowns) = if is_network(order.model) {
            if let Some(path) = images.first() {
                let reason = "is an image, and a network file has no images".to_owned();
                return Err(FittingError::Measured { path: path.clone(), reason });
            }
            if let Some(rule) = input.images.first() {
                return Err(input
                    .error(rule.line, "image.file", "has no meaning for a network file".to_owned())
                    .into());
            }
            let (model, measurements, unknowns) = NetworkModel::load(order.model, &input, &tables, stop)?;
            files.push(order.model.to_path_buf());
            (CaseModel::Network(Box::new(model), measurements), unknowns)
        } else {
            let scene = Scene::load_within(order.model, order.reach.clone())?;
            let (case, unknowns) = SceneCase::load(scene, &input, [&tables, &images], progress)?;
            files.extend(case.prepared().scene.files.iter().cloned());
            (CaseModel::Scene(Box::new(case)), unknowns)
        };
        Ok(Self { name, input, unknowns, model, files, stop })
    }

    /// Whether the fit computes on a device.
    pub(crate) fn needs_device(&self) -> bool {
        matches!(self.model, CaseModel::Scene(_))
    }

    /// All files that were read.
    pub(crate) fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// Warnings and assumptions for the user.
    pub(crate) fn notes(&self) -> Vec<String> {
        let CaseModel::Scene(case) = &self.model else { return Vec::new() };
        let prepared = case.prepared();
        let warnings = guard::warnings(prepared, CheckEffort::NO_IMAGE);
        let warnings = warnings.iter().map(|warning| format!("warning: {warning}"));
        warnings.chain(prepared.scene.assumptions.iter().map(|assumption| format!("assumed: {assumption}"))).collect()
    }

    /// Finds the values. A scene is computed on `target`.
    ///
    /// # Errors
    /// A run that fails, a fit that is singular, or the end by the user before the first derivatives.
    pub(crate) fn solve(self, target: &Target, news: &dyn Fn(RunNews)) -> Result<Fitted, FittingError> {
        let Self { name, input, unknowns, model, stop, .. } = self;
        match model {
            CaseModel::Network(mut model, measurements) => {
                solve((name, input), unknowns, &mut *model, measurements, news)
            }
            CaseModel::Scene(case) => {
                news(RunNews::Begins("the scene as it is".to_owned(), 1));
                let (mut model, measurements) = case.open(target, stop, news)?;
                solve((name, input), unknowns, &mut model, measurements, news)
            }
        }
    }
}

/// Fits `parameters` of a scene or a network file to measured files, without a word, and writes the files of `isotherm fit` into a folder, where one is given. `open` opens the device of a
/// scene. `stop` ends the fit. Returns the content of `fit.json`.
///
/// # Errors
/// Wrong files, a fit that is singular, a run that fails, the end by the user, and a folder that is not empty or cannot be written.
pub fn fit_files(
    [model, parameters]: [&Path; 2],
    measured: &[PathBuf],
    output: Option<&Path>,
    reach: Reach,
    open: impl FnOnce() -> Result<Target, SimulationError>,
    stop: &AtomicBool,
) -> Result<String, SimulationError> {
    let case = FitCase::load(&FitOrder { model, measured, parameters, reach }, stop, &mut |_| ())?;
    let target = if case.needs_device() { open()? } else { Target::Reference };
    let inputs = case.files.clone();
    let prepare = |output: &Path| Folder::new(output, &FILES).prepare(false, &inputs).map_err(FittingError::from);
    let folder = output.map(prepare).transpose()?;
    let solved = case.solve(&target, &|_| ());
    let whole = solved.and_then(|fitted| if fitted.is_stopped() { Err(FittingError::Stopped) } else { Ok(fitted) });
    let fitted = whole.inspect_err(|_| folder.iter().for_each(Folder::take_back))?;
    if let Some(folder) = &folder {
        write(folder, &fitted).and_then(|()| folder.finish()).map_err(FittingError::from)?;
    }
    Ok(fitted.json().to_string())
}

/// Whether a file is a network file: its root has nodes and no model.
fn is_network(path: &Path) -> bool {
    let table = files::read_text(path).ok().and_then(|text| text.parse::<toml::Table>().ok());
    table.is_some_and(|table| table.contains_key("node") && !table.contains_key("model"))
}

fn solve(
    (name, input): (String, FitInput),
    unknowns: Vec<Unknown>,
    model: &mut dyn FitModel,
    mut measurements: Measurements,
    news: &dyn Fn(RunNews),
) -> Result<Fitted, FittingError> {
    if measurements.points.is_empty() {
        let reason = "--measured names nothing that was measured".to_owned();
        return Err(FittingError::Measured { path: input.path, reason });
    }
    measurements.hold_out(&input)?;
    let objective =
        Objective { measurements: &measurements, unknowns: &unknowns, loss: input.loss, loss_scale: input.loss_scale };
    let singular = |directions: Vec<DataDirection>| {
        let open = open(&directions[0], &directions, &unknowns);
        let reason = format!("{open}; state a prior (range, percent or prior_sigma) or more data");
        FittingError::Singular { path: input.path.clone(), reason }
    };
    let runs = 2 * unknowns.len() as u64 + 1;
    let factors = |x: &[f64]| x.iter().map(|x| x.exp()).collect::<Vec<f64>>();
    news(RunNews::Begins("first derivatives".to_owned(), runs));
    let mut compute = |x: &[f64]| {
        let computed = model.computed(&factors(x))?;
        news(RunNews::Stepped);
        Ok(computed)
    };
    let before = compute(&vec![0.0; unknowns.len()])?;
    let values = (measurements.points.len() - measurements.held_out()) as f64;
    let mut begun = |best: &BestFit| {
        // What is singular here has derivatives that only rounding makes.
        Posterior::new(best, &unknowns).map_err(singular)?;
        news(RunNews::Says(format!("step {}: sum of squares over values {:.4}", best.steps, best.sum / values)));
        news(RunNews::Begins(format!("step {}", best.steps + 1), runs));
        Ok(())
    };
    let best = objective.minimise(before.clone(), &mut compute, &mut begun)?;
    let posterior = Posterior::new(&best, &unknowns).map_err(singular)?;
    let head = [format!("fitted to measurements by isotherm fit {}", env!("CARGO_PKG_VERSION"))];
    let text = model.fitted_text(&factors(&best.x), &head);
    let loss = (input.loss, input.loss_scale);
    Ok(Fitted { name, unknowns, posterior, measurements, before, best, loss, text })
}
