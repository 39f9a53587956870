//! Estimated errors of the one pass, added up over steps.

#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct Told {
    /// Sum of their squares [K2].
    pub(crate) squares: f64,
    pub(crate) count: u64,
    /// The largest [K].
    pub(crate) most: f64,
    pub(crate) node: usize,
}

impl Told {
    pub(crate) fn and(self, other: Self) -> Self {
        let largest = if other.most > self.most { other } else { self };
        Self {
            squares: self.squares + other.squares,
            count: self.count + other.count,
            most: largest.most,
            node: largest.node,
        }
    }

    /// Their root mean square and the largest.
    pub(crate) fn estimate(self) -> Estimate {
        Estimate { rms: (self.squares / self.count.max(1) as f64).sqrt(), most: self.most, node: self.node }
    }
}

/// The estimated error of a run.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Estimate {
    /// Root mean square over all nodes and steps [K].
    pub rms: f64,
    /// Largest [K].
    pub most: f64,
    pub(crate) node: usize,
}
