//! The paper's numbers next to isotherm's, as rows of `checks.csv`.

use crate::output::OutputError;
use crate::output::finite::finite;
use crate::output::folder::Folder;

/// Largest difference at which two numbers agree, in the unit of the check.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Tolerance {
    /// The paper's number is exact, and isotherm's is computed in f32.
    Computation(f64),
    /// The paper's number was read from a plot or is approximate.
    Reading(f64),
    /// The paper gives an upper bound.
    Below,
}

/// One number that the paper states.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PaperCheck {
    /// The meaning of the number.
    pub(crate) statement: String,
    /// The paper's number, or the result of its equations.
    pub(crate) expected: f64,
    /// Isotherm's number.
    pub(crate) computed: f64,
    /// Largest difference at which they agree.
    pub(crate) tolerance: Tolerance,
    /// Unit of both numbers.
    pub(crate) unit: &'static str,
}

impl PaperCheck {
    /// Isotherm's number minus the paper's.
    pub(crate) fn difference(&self) -> f64 {
        self.computed - self.expected
    }

    /// Whether they agree. NaN never agrees.
    pub(crate) fn agrees(&self) -> bool {
        match self.tolerance {
            Tolerance::Computation(size) | Tolerance::Reading(size) => self.difference().abs() <= size,
            Tolerance::Below => self.computed < self.expected,
        }
    }

    pub(crate) fn statement_with_unit(&self) -> String {
        let how = match self.tolerance {
            Tolerance::Computation(size) => format!("within {size}"),
            Tolerance::Reading(size) => format!("read to {size}"),
            Tolerance::Below => "below".to_owned(),
        };
        format!("{} [{}, {how}]", self.statement, self.unit)
    }

    /// Expected, computed and difference as text.
    pub(crate) fn numbers(&self) -> [String; 3] {
        let expected = match self.tolerance {
            Tolerance::Below => format!("{:.6}", self.expected),
            _ => self.expected.to_string(),
        };
        [expected, format!("{:.6}", self.computed), format!("{:.2e}", self.difference())]
    }
}

/// Writes the file `name`, `checks.csv`: statement, expected, computed, difference, agrees (`true` or `false`).
pub(crate) fn write(folder: &Folder, name: &str, checks: &[PaperCheck]) -> Result<(), OutputError> {
    let head = ["statement", "expected", "computed", "difference", "agrees"].map(str::to_owned);
    let row = |check: &PaperCheck| {
        for value in [check.expected, check.computed] {
            finite(value, || format!("a number of '{}'", check.statement))?;
        }
        let [expected, computed, difference] = check.numbers();
        Ok(vec![check.statement_with_unit(), expected, computed, difference, check.agrees().to_string()])
    };
    folder.write_checked_csv(name, std::iter::once(Ok(head.to_vec())).chain(checks.iter().map(row)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(expected: f64, computed: f64) -> PaperCheck {
        let tolerance = Tolerance::Reading(10.0);
        PaperCheck { statement: "hot, \"very\"".into(), expected, computed, tolerance, unit: "K" }
    }

    #[test]
    fn numbers_agree_within_the_tolerance_only() {
        assert!(check(700.0, 691.0).agrees() && check(700.0, 710.0).agrees());
        assert!(!check(700.0, 689.9).agrees() && !check(700.0, f64::NAN).agrees());
    }

    #[test]
    fn what_should_be_below_agrees_below_only() {
        let below = |computed| PaperCheck { tolerance: Tolerance::Below, ..check(217.1, computed) };
        assert!(below(217.0).agrees() && !below(217.1).agrees() && !below(219.1).agrees() && !below(f64::NAN).agrees());
        assert_eq!(below(219.1).numbers()[0], "217.100000");
    }

    #[test]
    fn the_table_reads_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("checks.csv");
        let out = Folder::new(folder.path(), &["checks.csv"]).prepare(false, &[]).unwrap();
        write(&out, "checks.csv", &[check(700.0, 691.0), check(180.0, 193.8)]).unwrap();
        let mut reader = csv::Reader::from_path(&path).unwrap();
        let header: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
        assert_eq!(header, ["statement", "expected", "computed", "difference", "agrees"]);
        let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
        assert_eq!(&rows[0][0], "hot, \"very\" [K, read to 10]");
        assert_eq!([&rows[0][3], &rows[0][4], &rows[1][4]], ["-9.00e0", "true", "false"]);
    }
}
