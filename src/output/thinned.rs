//! A line that is thinned while its points come, so that its length does not grow with them.

/// Points of a line before they are thinned.
const MOST_ROWS: u64 = 6000;
/// Stretches of a thinned line.
const STRETCHES: u64 = 2000;

/// The kept points of a line: place, lower and upper value. Each stretch keeps its first point, its smallest lower value and its largest upper value.
pub(super) struct Thinned {
    stretch: u64,
    came: u64,
    first: Option<Point>,
    least: Option<Point>,
    greatest: Option<Point>,
    last: Option<Point>,
    kept: Vec<Point>,
}

#[derive(Clone, Copy, PartialEq)]
struct Point {
    number: u64,
    at: [f64; 3],
    /// Number of gaps before it.
    gaps: u64,
}

impl Thinned {
    /// A line that will get so many points.
    pub(crate) fn of(points: u64) -> Self {
        let stretch = if points <= MOST_ROWS { 1 } else { points.div_ceil(STRETCHES) };
        Self { stretch, came: 0, first: None, least: None, greatest: None, last: None, kept: Vec::new() }
    }

    /// Adds a point after so many gaps.
    pub(crate) fn push(&mut self, at: [f64; 3], gaps: u64) {
        let point = Point { number: self.came, at, gaps };
        if self.came.is_multiple_of(self.stretch) {
            self.end_stretch();
        }
        self.came += 1;
        self.first.get_or_insert(point);
        if self.least.is_none_or(|least| at[1] < least.at[1]) {
            self.least = Some(point);
        }
        if self.greatest.is_none_or(|greatest| at[2] > greatest.at[2]) {
            self.greatest = Some(point);
        }
        self.last = Some(point);
    }

    fn end_stretch(&mut self) {
        let mut chosen: Vec<Point> =
            [self.first.take(), self.least.take(), self.greatest.take()].into_iter().flatten().collect();
        chosen.sort_by_key(|point| point.number);
        chosen.dedup_by_key(|point| point.number);
        self.kept.extend(chosen);
    }

    /// The kept points, with NaN in every gap.
    pub(crate) fn points(mut self) -> Vec<[f64; 3]> {
        self.end_stretch();
        if let Some(last) = self.last.filter(|last| self.kept.last() != Some(last)) {
            self.kept.push(last);
        }
        let mut points: Vec<[f64; 3]> = Vec::with_capacity(self.kept.len());
        let mut gaps = self.kept.first().map_or(0, |point| point.gaps);
        for point in self.kept {
            if point.gaps != gaps {
                points.push([point.at[0], f64::NAN, f64::NAN]);
                gaps = point.gaps;
            }
            points.push(point.at);
        }
        points
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_points_are_all_kept_and_peaks_always() {
        let line = |points: u64| {
            let mut line = Thinned::of(points);
            for i in 0..points {
                let value = if i == points / 3 { 900.0 } else { (i % 7) as f64 };
                line.push([i as f64, value, value], u64::from(i > points / 2));
            }
            line.points()
        };
        let few = line(5000);
        assert_eq!(few.len(), 5001, "all and a gap");
        let many = line(1_000_000);
        assert!(many.len() < 6010 && many.iter().any(|point| point[2] == 900.0), "{}", many.len());
        assert_eq!(many.iter().filter(|point| point[1].is_nan()).count(), 1);
        assert_eq!((many[0][0], many[many.len() - 1][0]), (0.0, 999_999.0));
        let in_order: Vec<f64> = many.iter().map(|point| point[0]).collect();
        assert!(in_order.is_sorted());
    }
}
