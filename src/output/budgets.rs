//! The budget of each part over time: a table, and the mean over a run.

use std::io::Read;

use super::OutputError;
use super::report::PartBudget;
use super::series::unique;
use super::series_lines::each_row;
use crate::text::time_of_step;
use crate::thermal::budget::{Budget, CAUSES, CHANNELS};

/// The table of budgets: a row for each step and part.
pub(super) struct BudgetRows {
    parts: Vec<String>,
}

impl BudgetRows {
    pub(super) fn new(parts: &[String]) -> Self {
        Self { parts: unique(parts) }
    }

    /// The head of `budget.csv`: `time` [s], `part`, and the gain by each cause [W/m2].
    pub(super) fn head() -> Vec<String> {
        ["time", "part"].into_iter().chain(CHANNELS).map(str::to_owned).collect()
    }

    /// The rows of a step, with six decimals.
    pub(super) fn rows(&self, time: f64, budgets: &[Budget]) -> impl Iterator<Item = Vec<String>> {
        self.parts.iter().zip(budgets).map(move |(part, budget)| {
            let gains = budget.iter().map(|gain| format!("{gain:.6}"));
            [time_of_step(time), part.clone()].into_iter().chain(gains).collect()
        })
    }

    /// The mean budget of each part over the time of a table, with straight lines between the steps.
    ///
    /// # Errors
    /// The table cannot be read.
    pub(super) fn means(&self, table: impl Read) -> Result<Vec<PartBudget>, OutputError> {
        let parts = self.parts.len().max(1);
        let nothing = vec![[0.0; CAUSES]; parts];
        let (mut sums, mut first, mut last, mut row) = (nothing.clone(), nothing.clone(), nothing, 0);
        each_row(table, |cell| {
            let budget: Budget = std::array::from_fn(|cause| cell(2 + cause).unwrap_or(0.0));
            if row < parts {
                first[row] = budget;
            }
            last[row % parts] = budget;
            sums[row % parts].iter_mut().zip(budget).for_each(|(sum, gain)| *sum += gain);
            row += 1;
        })?;
        let steps = (row / parts).saturating_sub(1);
        for ((sum, first), last) in sums.iter_mut().zip(&first).zip(&last).filter(|_| steps > 0) {
            let ends = first.iter().zip(last);
            sum.iter_mut()
                .zip(ends)
                .for_each(|(sum, (first, last))| *sum = (*sum - 0.5 * (first + last)) / steps as f64);
        }
        let mean = |(part, sum): (&String, [f64; CAUSES])| PartBudget {
            part: part.clone(),
            mean_w_per_m2: CHANNELS.into_iter().zip(sum).collect(),
        };
        Ok(self.parts.iter().zip(sums).map(mean).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_is_taken_over_the_time() {
        let rows = BudgetRows::new(&["a".to_owned(), "b".to_owned()]);
        let mean = |steps: &[[f64; 2]]| {
            let mut table = BudgetRows::head().join(",") + "\n";
            for (time, [a, b]) in steps.iter().enumerate() {
                for row in rows.rows(time as f64, &[[*a; CAUSES], [*b; CAUSES]]) {
                    table += &(row.join(",") + "\n");
                }
            }
            let means = rows.means(table.as_bytes()).expect("a table");
            means.iter().map(|part| part.mean_w_per_m2["Q_heater"]).collect::<Vec<_>>()
        };
        assert_eq!(mean(&[[100.0, 7.0], [1.0, 2.0], [3.0, -4.0]]), [26.25, 1.75]);
        assert_eq!(mean(&[[100.0, 7.0]]), [100.0, 7.0]);
    }
}
