//! Images an hour of data sets against the number of shards, their bytes and memory, and what a GPU would change.

mod gpu;
mod shards;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use gpu::Gpu;
use isotherm::internals::{Axis, Mark, Plot, PlotLine};
use isotherm_tools::{exit_code, section};
use shards::{Measured, measure};

/// Make data sets with 1, 2 and 4 shards at once, and write what they cost. Nothing else should run on the machine.
#[derive(Parser)]
struct Arguments {
    /// SPEC files, each with the number of its images, such as models/cubesat_dataset.toml=400
    #[arg(required = true, value_parser = of_spec)]
    specs: Vec<(PathBuf, u64)>,
    /// Images of an orbit, in place of those of the SPEC. With fewer orbits than shards some shards have nothing to do
    #[arg(long)]
    poses_per_orbit: Option<u64>,
    /// Numbers of shards
    #[arg(long, value_delimiter = ',', default_value = "1,2,4")]
    shards: Vec<u64>,
    /// The built program [default: beside this one]
    #[arg(long)]
    program: Option<PathBuf>,
    #[command(flatten)]
    gpu: Gpu,
    /// Write the plot
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
    /// Replace the section between `<!-- dataset_speed -->` and `<!-- /dataset_speed -->` of this page
    #[arg(long, value_name = "FILE.md")]
    page: Option<PathBuf>,
    /// Replace the section between `<!-- dataset_gpu -->` and `<!-- /dataset_gpu -->` of this page
    #[arg(long, value_name = "FILE.md")]
    gpu_page: Option<PathBuf>,
}

fn of_spec(text: &str) -> Result<(PathBuf, u64), String> {
    let wrong = || "it takes a file and a number of images, such as models/cubesat_dataset.toml=400".to_owned();
    let (path, images) = text.split_once('=').ok_or_else(wrong)?;
    Ok((PathBuf::from(path), images.parse().map_err(|_| wrong())?))
}

fn main() -> ExitCode {
    exit_code(work(&Arguments::parse()))
}

fn work(arguments: &Arguments) -> Result<(), String> {
    let program = section::program(arguments.program.clone())?;
    let (mut rows, mut calculated, mut series) = (Vec::new(), Vec::new(), Vec::new());
    for (spec, images) in &arguments.specs {
        let mut points = Vec::new();
        let mut alone: Option<Measured> = None;
        for shards in &arguments.shards {
            let found = measure(&program, spec, (*images, arguments.poses_per_orbit), *shards)?;
            eprintln!("{} with {shards} shards: {:.0} s", found.name, found.seconds);
            rows.push(found.row());
            points.push([*shards as f64, found.images_an_hour()]);
            alone = alone.or((*shards == 1).then_some(found));
        }
        if let Some(alone) = alone {
            calculated.push(arguments.gpu.row(&program, &alone)?);
            series.push(PlotLine { name: alone.name.clone(), points, mark: Mark::Joined, ..PlotLine::default() });
        }
    }
    if let Some(path) = &arguments.plot {
        draw(path, series)?;
    }
    let picture = arguments.plot.as_ref().and_then(|path| path.file_name()).map_or(String::new(), |name| {
        format!("\n![Images an hour against the number of shards]({})\n", name.to_string_lossy())
    });
    let specs: Vec<String> =
        arguments.specs.iter().map(|(path, images)| format!("{}={images}", path.display())).collect();
    let poses = arguments.poses_per_orbit.map_or(String::new(), |poses| format!(" --poses-per-orbit {poses}"));
    let text = format!(
        "`cargo run {}-p isotherm-tools --bin dataset_speed -- {}{poses} --plot docs/dataset_speed.svg --page docs/datasets.md --gpu-page docs/gpu.md`\n\n\
         {}\n{}\n{picture}",
        section::PROFILE,
        specs.join(" "),
        Measured::HEAD,
        rows.join("\n"),
    );
    section::tell("dataset_speed", &text, arguments.page.as_deref())?;
    let text = format!("{}\n{}\n{}", arguments.gpu.sentence(), Gpu::HEAD, calculated.join("\n"));
    section::tell("dataset_gpu", &text, arguments.gpu_page.as_deref())
}

fn draw(path: &Path, series: Vec<PlotLine>) -> Result<(), String> {
    let plot = Plot {
        title: "Images of data sets".to_owned(),
        subtitle: "shards at once on one machine, with all labels and the tar".to_owned(),
        x: Axis::linear("shards"),
        y: Axis::logarithmic("images an hour"),
        series,
        ..Plot::default()
    };
    let svg = plot.svg().map_err(|error| error.to_string())?;
    std::fs::write(path, svg).map_err(|error| error.to_string())
}
