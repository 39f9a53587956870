//! Figures 2, 3 and 4 as plots and tables: one face or all faces through the orbit.

use super::cube::{FACES, FaceOrbit, SIDE, STEPS, ZENITH};
use super::orbits::{Orbits, SolvedCube};
use crate::output::OutputError;
use crate::output::panels::Panels;
use crate::output::plot::{Mark, Plot, PlotLine, Shade};
use crate::output::plot_axis::Axis;

/// Files of the tables of figures 2 to 4, in the order of [`figures`].
pub(crate) const TABLES: [&str; 7] = [
    "figure2_1.csv",
    "figure2_2.csv",
    "figure2_3.csv",
    "figure2_4.csv",
    "figure3_1.csv",
    "figure3_2.csv",
    "figure4.csv",
];

/// Temperatures [K] of every step. Each line of a plot is a column.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FigureTable {
    /// File in the folder.
    pub(crate) file: &'static str,
    /// Names of the columns after `step`.
    pub(crate) columns: Vec<String>,
    /// A row for each of the steps 0 to [`STEPS`].
    pub(crate) rows: Vec<Vec<f64>>,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Figure {
    /// Number in the paper.
    pub(crate) number: u8,
    pub(crate) svg: String,
    /// One table for each panel.
    pub(crate) tables: Vec<FigureTable>,
}

/// Figures 2, 3 and 4.
pub(crate) fn figures(orbits: &Orbits, device: &str) -> Result<[Figure; 3], OutputError> {
    let zenith = |solved: &SolvedCube| named(&format!("{} W/m2", solved.case.solar_constant), solved, ZENITH);
    let two = [&orbits.aluminium, &orbits.conducting, &orbits.mli, &orbits.conducting_mli];
    let figure_2 = two.iter().zip(1..).map(|(pair, number)| {
        let not_drawn = if number == 4 { "not in the paper; " } else { "" };
        let [dim, bright] = pair.each_ref().map(swing);
        Axes {
            title: format!("2.{number} {}", pair[0].case),
            subtitle: format!("{not_drawn}{dim} K; broken: {bright} K"),
            lines: pair.iter().map(zenith).collect(),
            shadow: None,
        }
    });
    let figure_3 = orbits.all_loads.iter().zip(1..).map(|(solved, number)| Axes {
        title: format!("3.{number} MLI under all loads at {}", altitude(solved)),
        subtitle: "+Z to the zenith, +X along the velocity; +Y and -Y are the same".to_owned(),
        lines: (0..FACES.len()).map(|face| named(FACES[face], solved, face)).collect(),
        shadow: solved.shadow,
    });
    let side = |solved: &SolvedCube| {
        let without = if orbits.without_albedo.contains(solved) { " without albedo" } else { "" };
        named(&format!("{}{without}", altitude(solved)), solved, SIDE)
    };
    let figure_4 = Axes {
        title: "4 MLI under all loads, +Y face".to_owned(),
        subtitle: "the paper sees about 180 K in eclipse, and its end near step 264; the shadow is that at 224 km"
            .to_owned(),
        lines: orbits.all_loads.iter().chain(&orbits.without_albedo).map(side).collect(),
        shadow: orbits.all_loads[0].shadow,
    };
    let in_the_sun =
        "periodic state, the Sun alone, no planet shadow; broken: the solar constant is 1367, not 1361 W/m2";
    let loads =
        "periodic state, space at 2.7 K, Sun 1367 W/m2 with planet shadow, albedo 0.3, planet infrared 237 W/m2";
    Ok([
        figure(2, "the zenith face of the cube", in_the_sun, 2, false, figure_2.collect(), device)?,
        figure(3, "all faces of the cube", loads, 1, true, figure_3.collect(), device)?,
        figure(4, "the +Y face of the cube", loads, 1, true, vec![figure_4], device)?,
    ])
}

struct Axes {
    title: String,
    subtitle: String,
    lines: Vec<(String, Vec<f64>)>,
    shadow: Option<[f64; 2]>,
}

fn figure(
    number: u8,
    title: &str,
    subtitle: &str,
    columns: usize,
    legends: bool,
    panels: Vec<Axes>,
    device: &str,
) -> Result<Figure, OutputError> {
    let prefix = format!("figure{number}");
    let files = TABLES.into_iter().filter(|file| file.starts_with(&prefix));
    let tables = files.zip(&panels).map(|(file, panel)| panel.table(file)).collect();
    let title = format!("Figure {number}: {title}");
    let plots = panels.into_iter().map(|panel| panel.plot(legends)).collect();
    let subtitle = format!("{subtitle}; on {device}");
    Ok(Figure { number, svg: Panels { title, subtitle, columns, legends, plots }.svg()?, tables })
}

impl Axes {
    fn table(&self, file: &'static str) -> FigureTable {
        let columns = self.lines.iter().map(|(name, _)| name.clone()).collect();
        let row = |step: usize| self.lines.iter().map(|(_, values)| values[step]).collect();
        FigureTable { file, columns, rows: (0..=STEPS).map(row).collect() }
    }

    fn plot(self, legends: bool) -> Plot {
        let line = |(index, (name, values)): (usize, (String, Vec<f64>))| PlotLine {
            // A legend distinguishes lines. Without it every second line is dashed.
            mark: if index % 2 == 1 && (!legends || name.starts_with('-')) || name.contains("without") {
                Mark::Dashed
            } else {
                Mark::Line
            },
            points: values.into_iter().enumerate().map(|(step, t)| [step as f64, t]).collect(),
            name,
            ..PlotLine::default()
        };
        let mut x = Axis::linear("step");
        x.range = Some([0.0, STEPS as f64]);
        let shade = |[begins, ends]: [f64; 2]| Shade {
            name: "planet shadow".to_owned(),
            intervals: vec![(begins, ends)],
            strength: 1.0,
        };
        Plot {
            title: self.title,
            subtitle: self.subtitle,
            x,
            y: Axis::linear("temperature [K]"),
            series: self.lines.into_iter().enumerate().map(line).collect(),
            shaded: self.shadow.map(shade).into_iter().collect(),
        }
    }
}

fn altitude(solved: &SolvedCube) -> String {
    format!("{} km", solved.case.altitude / 1e3)
}

fn named(name: &str, solved: &SolvedCube, face: usize) -> (String, Vec<f64>) {
    (name.to_owned(), series(&solved.orbit, face))
}

/// Temperatures of a face at steps 0 to [`STEPS`]. NaN after the end of a shorter orbit.
fn series(orbit: &FaceOrbit, face: usize) -> Vec<f64> {
    (0..=STEPS).map(|step| orbit.get(step).map_or(f64::NAN, |faces| faces[face])).collect()
}

/// Temperature range of the zenith face [K], because figures have different axes.
fn swing(solved: &SolvedCube) -> String {
    let series = series(&solved.orbit, ZENITH);
    let least = series.iter().copied().fold(f64::INFINITY, f64::min);
    let greatest = series.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    format!("{least:.2} to {greatest:.2}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::sky::SkyError;

    /// Test orbits: the temperature of a face is its number times 100 plus the step.
    fn made() -> Orbits {
        let row = |step: usize| std::array::from_fn(|face| (100 * face + step) as f64);
        Orbits::compute(|_, _| Ok::<_, SkyError>((0..=STEPS).map(row).collect())).unwrap()
    }

    #[test]
    fn every_panel_has_its_table_and_its_lines() {
        let [two, three, four] = figures(&made(), "device <1>").unwrap();
        assert_eq!([two.number, three.number, four.number], [2, 3, 4]);
        let tables: Vec<&FigureTable> = [&two, &three, &four].into_iter().flat_map(|figure| &figure.tables).collect();
        assert_eq!(tables.iter().map(|table| table.file).collect::<Vec<_>>(), TABLES);
        assert!(tables.iter().all(|table| table.rows.len() == STEPS + 1));
        assert!(tables.iter().all(|table| table.rows.iter().all(|row| row.len() == table.columns.len())));
        assert_eq!(two.tables[1].rows[7], [407.0, 407.0], "the zenith face");
        assert_eq!(three.tables[0].rows[7], [7.0, 107.0, 207.0, 307.0, 407.0, 507.0]);
        assert_eq!(four.tables[0].rows[7], [207.0; 4], "the +Y face");
        assert_eq!(four.tables[0].columns[3], "772 km without albedo");
        assert!(two.svg.contains("2.4 MLI, radiating and conducting") && two.svg.contains("device &lt;1&gt;"));
        assert!(three.svg.contains("planet shadow") && !two.svg.contains("planet shadow</"));
    }
}
