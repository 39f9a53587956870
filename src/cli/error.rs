//! Errors of the commands, and their exit codes.

use std::path::PathBuf;

use crate::compare::CompareError;
use crate::converge::ConvergeError;
use crate::dataset::error::DatasetError;
use crate::environment::sky::SkyError;
use crate::fit::FittingError;
use crate::gpu::error::GpuError;
use crate::output::OutputError;
use crate::output::job::JobError;
use crate::scene::SceneError;
use crate::sensitivity::SensitivityError;
use crate::server::error::ServerError;
use crate::simulation::engine::EngineError;
use crate::simulation::facade_error::SimulationError;
use crate::simulation::prepare_error::PrepareError;
use crate::thermal::brightness::BrightnessError;
use crate::view::session::ViewError;

/// An error that ends a command.
#[derive(Debug, thiserror::Error)]
pub(super) enum CliError {
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    #[error(transparent)]
    Gpu(#[from] GpuError),
    #[error(transparent)]
    Simulation(SimulationError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error(transparent)]
    Job(#[from] JobError),
    #[error(transparent)]
    Brightness(#[from] BrightnessError),
    #[error(transparent)]
    Compare(CompareError),
    #[error(transparent)]
    Converge(ConvergeError),
    #[error(transparent)]
    Sensitivity(SensitivityError),
    #[error(transparent)]
    Fit(FittingError),
    #[error(transparent)]
    View(ViewError),
    #[error(transparent)]
    Server(ServerError),
    #[error(transparent)]
    Dataset(DatasetError),
    #[error("{0}")]
    Usage(String),
    #[error("{0}")]
    Solver(String),
    #[error("the validation layer reports:\n{0}")]
    Validation(String),
    #[error("stopped; what was finished is in {0}")]
    Stopped(PathBuf),
    #[error("stopped; what was finished is in {0}, and this goes on with it: isotherm run --resume {0}")]
    StoppedRun(PathBuf),
    #[error("stopped; nothing was written")]
    StoppedBefore,
}

impl From<ViewError> for CliError {
    fn from(error: ViewError) -> Self {
        match error {
            ViewError::Simulation(error) => error.into(),
            other => Self::View(other),
        }
    }
}

impl From<CompareError> for CliError {
    fn from(error: CompareError) -> Self {
        match error {
            CompareError::Prepare(error) => Self::Prepare(error),
            CompareError::Job(error) => Self::Job(error),
            CompareError::Stopped => Self::StoppedBefore,
            other => Self::Compare(other),
        }
    }
}

impl From<ConvergeError> for CliError {
    fn from(error: ConvergeError) -> Self {
        match error {
            ConvergeError::Prepare(error) => Self::Prepare(error),
            ConvergeError::Engine(error) => Self::Job(error.into()),
            ConvergeError::Stopped => Self::StoppedBefore,
            other => Self::Converge(other),
        }
    }
}

impl From<SensitivityError> for CliError {
    fn from(error: SensitivityError) -> Self {
        match error {
            SensitivityError::Prepare(error) => Self::Prepare(error),
            SensitivityError::Parameter(error) => Self::Prepare(error.into()),
            SensitivityError::Engine(error) => Self::Job(error.into()),
            SensitivityError::Output(error) => Self::Output(error),
            SensitivityError::Stopped => Self::StoppedBefore,
            other => Self::Sensitivity(other),
        }
    }
}

impl From<FittingError> for CliError {
    fn from(error: FittingError) -> Self {
        match error {
            FittingError::Prepare(error) => Self::Prepare(error),
            FittingError::Scene(error) => Self::Prepare(error.into()),
            FittingError::Engine(error) => Self::Job(error.into()),
            FittingError::Output(error) => Self::Output(error),
            FittingError::Stopped => Self::StoppedBefore,
            other => Self::Fit(other),
        }
    }
}

impl From<DatasetError> for CliError {
    fn from(error: DatasetError) -> Self {
        match error {
            DatasetError::Scene(error) => Self::Prepare(error.into()),
            DatasetError::Output(error) => Self::Output(error),
            DatasetError::Simulation(error) => error.into(),
            other => Self::Dataset(other),
        }
    }
}

impl From<SceneError> for CliError {
    fn from(error: SceneError) -> Self {
        Self::Prepare(error.into())
    }
}

impl From<ServerError> for CliError {
    fn from(error: ServerError) -> Self {
        match error {
            ServerError::Scene(error) => Self::Prepare(error),
            other => Self::Server(other),
        }
    }
}

impl From<SimulationError> for CliError {
    fn from(error: SimulationError) -> Self {
        match error {
            SimulationError::Prepare(error) => Self::Prepare(error),
            SimulationError::Gpu(error) => Self::Gpu(error),
            SimulationError::Engine(error) => error.into(),
            other => Self::Simulation(other),
        }
    }
}

impl From<EngineError> for CliError {
    fn from(error: EngineError) -> Self {
        Self::Job(error.into())
    }
}

impl From<SkyError> for CliError {
    fn from(source: SkyError) -> Self {
        PrepareError::Sky { path: PathBuf::from("the paper's scenario"), source }.into()
    }
}

impl From<std::convert::Infallible> for CliError {
    fn from(never: std::convert::Infallible) -> Self {
        match never {}
    }
}

impl CliError {
    /// 2 if the user can fix the error, otherwise 1.
    pub(super) fn exit_code(&self) -> u8 {
        match self {
            Self::Prepare(_)
            | Self::Brightness(_)
            | Self::Compare(_)
            | Self::Converge(_)
            | Self::Sensitivity(_)
            | Self::Fit(_)
            | Self::Server(_)
            | Self::Usage(_) => 2,
            Self::Simulation(error) => {
                if error.is_of_the_user() {
                    2
                } else {
                    1
                }
            }
            Self::Dataset(error) => {
                if error.is_of_the_user() {
                    2
                } else {
                    1
                }
            }
            Self::Job(JobError::Engine(EngineError::Network { .. } | EngineError::Saved(_))) => 2,
            Self::Gpu(error) | Self::Job(JobError::Engine(EngineError::Gpu(error))) => {
                if matches!(error, GpuError::Call { .. } | GpuError::Allocation { .. }) { 1 } else { 2 }
            }
            Self::Output(error) | Self::Job(JobError::Output(error)) => {
                if error.is_about_the_folder() {
                    2
                } else {
                    1
                }
            }
            Self::Job(
                JobError::NotFinite { .. } | JobError::Writer | JobError::Engine(EngineError::NoTemperature { .. }),
            )
            | Self::Validation(_)
            | Self::View(_)
            | Self::Solver(_)
            | Self::Stopped(_)
            | Self::StoppedRun(_)
            | Self::StoppedBefore => 1,
        }
    }
}
