//! Selects the points of a line to draw: the stretches between gaps, thinned to the resolution of a screen.

/// Most points of a line. A screen cannot show more.
const MOST_POINTS: usize = 2000;

/// The stretches of consecutive items that pass.
pub(super) fn runs<T>(items: &[T], passes: impl Fn(&T) -> bool) -> impl Iterator<Item = &[T]> {
    items.split(move |item| !passes(item)).filter(|run| !run.is_empty())
}

/// Thins a list to about [`MOST_POINTS`] items. Each stretch keeps its first item, its smallest lower value and its
/// largest upper value, so no peak is lost.
pub(super) fn thin<T: Copy>(items: &[T], ends: impl Fn(&T) -> [f64; 2]) -> Vec<T> {
    if items.len() <= MOST_POINTS {
        return items.to_vec();
    }
    let stretch = items.len().div_ceil(MOST_POINTS / 3);
    let mut kept = Vec::with_capacity(MOST_POINTS + 4);
    for (number, chunk) in items.chunks(stretch).enumerate() {
        let indices = 0..chunk.len();
        let least = indices.clone().min_by(|a, b| ends(&chunk[*a])[0].total_cmp(&ends(&chunk[*b])[0])).unwrap_or(0);
        let greatest = indices.max_by(|a, b| ends(&chunk[*a])[1].total_cmp(&ends(&chunk[*b])[1])).unwrap_or(0);
        let mut chosen = vec![0, least, greatest];
        if (number + 1) * stretch >= items.len() {
            chosen.push(chunk.len() - 1);
        }
        chosen.sort_unstable();
        chosen.dedup();
        kept.extend(chosen.into_iter().map(|index| chunk[index]));
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_ends_and_peaks() {
        let mut points: Vec<[f64; 2]> = (0..60_000).map(|i| [f64::from(i), f64::from(i % 7)]).collect();
        points[31_234][1] = 900.0;
        points[31_235][1] = -900.0;
        let kept = thin(&points, |p| [p[1], p[1]]);
        assert!(kept.len() <= MOST_POINTS + 4);
        assert!(kept.contains(&points[31_234]) && kept.contains(&points[31_235]));
        assert_eq!([kept[0], kept[kept.len() - 1]], [points[0], points[59_999]]);
        assert!(kept.windows(2).all(|pair| pair[0][0] < pair[1][0]));
        assert_eq!(thin(&points[..100], |p| [p[1], p[1]]), points[..100]);
    }
}
