//! Joint positions over time: a table and plots.

use std::io::Read;

use super::OutputError;
use super::clock::DisplayClock;
use super::eclipses::Eclipses;
use super::plot::PlotLine;
use super::report::PlotEntry;
use super::series::unique;
use super::series_lines::each_row;
use super::thinned::Thinned;
use crate::text::time_of_step;

/// The table of joint positions: angles [deg] of turning joints, distances [m] of sliding joints.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct JointColumns {
    columns: Vec<(String, bool)>,
}

impl JointColumns {
    /// Columns of joints with these names. The flag marks turning joints.
    pub(crate) fn new(joints: impl Iterator<Item = (String, bool)>) -> Self {
        let (names, turns): (Vec<String>, Vec<bool>) = joints.unzip();
        Self { columns: unique(&names).into_iter().zip(turns).collect() }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.columns.is_empty()
    }

    /// The head of `joints.csv`: `time` [s], then `NAME:deg` or `NAME:m` for each joint.
    pub(crate) fn head(&self) -> Vec<String> {
        let unit = |turns: &bool| if *turns { "deg" } else { "m" };
        let names = self.columns.iter().map(|(name, turns)| format!("{name}:{}", unit(turns)));
        std::iter::once("time".to_owned()).chain(names).collect()
    }

    /// The cells of the positions [rad or m] at a time [s], with six decimals.
    pub(crate) fn cells(&self, time: f64, positions: &[f64]) -> Vec<String> {
        let shown = |((_, turns), position): (&(String, bool), &f64)| {
            format!("{:.6}", if *turns { position.to_degrees() } else { *position })
        };
        std::iter::once(time_of_step(time)).chain(self.columns.iter().zip(positions).map(shown)).collect()
    }

    /// Draws `joint_angles` and `joint_distances` if such joints exist, from the table that `open` opens. A jump of half a turn becomes a gap.
    ///
    /// # Errors
    /// The table cannot be read.
    pub(crate) fn plots<R: Read>(
        &self,
        mut open: impl FnMut() -> Result<R, OutputError>,
        eclipses: &Eclipses,
    ) -> Result<Vec<PlotEntry>, OutputError> {
        let (mut rows, mut until) = (0, 0.0);
        each_row(open()?, |cell| (rows, until) = (rows + 1, cell(0).unwrap_or(until)))?;
        let clock = DisplayClock::until(until);
        let mut lines: Vec<(Thinned, u64, f64)> =
            self.columns.iter().map(|_| (Thinned::of(rows), 0, f64::NAN)).collect();
        each_row(open()?, |cell| {
            for (index, (line, gaps, last)) in lines.iter_mut().enumerate() {
                let (Some(time), Some(at)) = (cell(0), cell(index + 1)) else { continue };
                *gaps += u64::from(self.columns[index].1 && (at - *last).abs() > 180.0);
                *last = at;
                line.push([clock.time(time), at, at], *gaps);
            }
        })?;
        let mut plots = Vec::new();
        let made = lines.into_iter().zip(&self.columns).map(|((line, ..), (name, turns))| {
            let points = line.points().iter().map(|[time, at, _]| [*time, *at]).collect();
            (*turns, PlotLine { name: name.clone(), points, ..PlotLine::default() })
        });
        let (turning, sliding): (Vec<_>, Vec<_>) = made.partition(|(turns, _)| *turns);
        for (lines, name, title, label) in [
            (turning, "joint_angles", "Joint angles", "angle [deg]"),
            (sliding, "joint_distances", "Joint distances", "distance [m]"),
        ] {
            if !lines.is_empty() {
                let subtitle = "from the pose in the model's file";
                let lines = lines.into_iter().map(|(_, line)| line).collect();
                plots.push(clock.plot(name, [title, subtitle, label], lines, eclipses)?);
            }
        }
        Ok(plots)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn angles_are_degrees_and_distances_metres() {
        let columns = JointColumns::new([("arm".to_owned(), true), ("arm".to_owned(), false)].into_iter());
        let rows = [columns.head(), columns.cells(0.0, &[PI, 1.5]), columns.cells(60.0, &[-PI, 2.0])];
        let table = rows.map(|row| row.join(",") + "\n").concat();
        assert_eq!(table, "time,arm:deg,arm#2:m\n0,180.000000,1.500000\n60,-180.000000,2.000000\n");
        let plots = columns.plots(|| Ok(table.as_bytes()), &Eclipses::default()).unwrap();
        assert_eq!(
            plots.iter().map(|plot| plot.file.as_str()).collect::<Vec<_>>(),
            ["plots/joint_angles.svg", "plots/joint_distances.svg"]
        );
    }
}
