//! Joint positions over time: a table and plots.

use std::path::Path;

use super::OutputError;
use super::folder::write_csv;
use super::plot::Line;
use super::report::PlotEntry;
use super::series::unique;
use super::temperature_plots::{Clock, Eclipses};

/// Joint positions over time: angles [deg] of turning joints, distances [m] of sliding joints.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct JointSeries {
    columns: Vec<(String, bool)>,
    rows: Vec<(f64, Vec<f64>)>,
}

impl JointSeries {
    /// An empty series for joints with these names. The flag marks turning joints.
    pub fn new(joints: impl Iterator<Item = (String, bool)>) -> Self {
        let (names, turns): (Vec<String>, Vec<bool>) = joints.unzip();
        Self { columns: unique(&names).into_iter().zip(turns).collect(), rows: Vec::new() }
    }

    /// Whether there is no joint.
    pub fn is_empty(&self) -> bool {
        self.columns.is_empty()
    }

    /// Adds the positions [rad or m] at a time [s].
    pub fn push(&mut self, time: f64, positions: &[f64]) {
        let shown = self.columns.iter().zip(positions).map(
            |((_, turns), position)| {
                if *turns { position.to_degrees() } else { *position }
            },
        );
        self.rows.push((time, shown.collect()));
    }

    /// Writes `joints.csv`: `time` [s], then `NAME:deg` or `NAME:m` for each joint, with six decimals.
    pub fn write(&self, path: &Path) -> Result<(), OutputError> {
        let unit = |turns: &bool| if *turns { "deg" } else { "m" };
        let names = self.columns.iter().map(|(name, turns)| format!("{name}:{}", unit(turns)));
        let head = std::iter::once("time".to_owned()).chain(names).collect();
        let row = |(time, positions): &(f64, Vec<f64>)| -> Vec<String> {
            let cells = positions.iter().map(|position| format!("{position:.6}"));
            std::iter::once(time.to_string()).chain(cells).collect()
        };
        write_csv(path, std::iter::once(head).chain(self.rows.iter().map(row)))
    }

    /// Draws `joint_angles` and `joint_distances` if such joints exist. A jump of half a turn becomes a gap.
    pub fn plots(&self, eclipses: &Eclipses) -> Result<Vec<PlotEntry>, OutputError> {
        let clock = Clock::until(self.rows.last().map_or(0.0, |row| row.0));
        let mut plots = Vec::new();
        for (turning, name, title, label) in [
            (true, "joint_angles", "Joint angles", "angle [deg]"),
            (false, "joint_distances", "Joint distances", "distance [m]"),
        ] {
            let lines = self.columns.iter().enumerate().filter(|(_, (_, turns))| *turns == turning);
            let lines: Vec<Line> = lines
                .map(|(index, (name, _))| {
                    let mut points: Vec<[f64; 2]> = Vec::new();
                    for (time, positions) in &self.rows {
                        let at = [clock.time(*time), positions[index]];
                        if points.last().is_some_and(|last| turning && (last[1] - at[1]).abs() > 180.0) {
                            points.push([at[0], f64::NAN]);
                        }
                        points.push(at);
                    }
                    Line { name: name.clone(), points, ..Line::default() }
                })
                .collect();
            if !lines.is_empty() {
                let subtitle = "from the pose in the model's file";
                plots.push(clock.plot(name, [title, subtitle, label], lines, eclipses)?);
            }
        }
        Ok(plots)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_degrees_and_distances_metres() {
        let mut series = JointSeries::new([("arm".to_owned(), true), ("arm".to_owned(), false)].into_iter());
        series.push(0.0, &[std::f64::consts::PI, 1.5]);
        series.push(60.0, &[-std::f64::consts::PI, 2.0]);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("joints.csv");
        series.write(&path).unwrap();
        let text = std::fs::read_to_string(path).unwrap();
        assert_eq!(text, "time,arm:deg,arm#2:m\n0,180.000000,1.500000\n60,-180.000000,2.000000\n");
        let plots = series.plots(&Eclipses::default()).unwrap();
        assert_eq!(
            plots.iter().map(|plot| plot.file.as_str()).collect::<Vec<_>>(),
            ["plots/joint_angles.svg", "plots/joint_distances.svg"]
        );
    }
}
