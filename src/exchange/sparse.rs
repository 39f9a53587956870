//! A sparse square matrix in rows.

use rayon::prelude::*;

/// A row: columns and values.
pub(crate) type SparseRow = Vec<(u32, f64)>;

/// Rows one after another. The entries of a row are sorted by column.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sparse {
    /// First entry of each row, and the one after the last.
    pub(crate) first: Vec<u32>,
    /// Columns and values.
    pub(crate) entries: Vec<(u32, f64)>,
}

impl Sparse {
    pub(crate) fn from_rows(rows: Vec<SparseRow>) -> Self {
        let mut first = vec![0];
        let mut entries = Vec::with_capacity(rows.iter().map(Vec::len).sum());
        for row in rows {
            entries.extend(row);
            first.push(entries.len() as u32);
        }
        Self { first, entries }
    }

    pub(crate) fn len(&self) -> usize {
        self.first.len().saturating_sub(1)
    }

    /// Entries of a row.
    pub fn row(&self, row: usize) -> &[(u32, f64)] {
        &self.entries[self.first[row] as usize..self.first[row + 1] as usize]
    }

    /// An entry; 0 where the matrix has none.
    pub fn at(&self, row: usize, column: u32) -> f64 {
        let row = self.row(row);
        row.binary_search_by_key(&column, |(column, _)| *column).map_or(0.0, |place| row[place].1)
    }

    pub(crate) fn transposed(&self) -> Self {
        let mut first = vec![0u32; self.len() + 1];
        self.entries.iter().for_each(|(column, _)| first[*column as usize + 1] += 1);
        (0..self.len()).for_each(|row| first[row + 1] += first[row]);
        let mut next = first.clone();
        let mut entries = vec![(0, 0.0); self.entries.len()];
        for row in 0..self.len() {
            for (column, value) in self.row(row) {
                let place = &mut next[*column as usize];
                entries[*place as usize] = (row as u32, *value);
                *place += 1;
            }
        }
        Self { first, entries }
    }

    /// Combines two matrices entry by entry. An entry that one of them lacks is 0 there. Entries of 0 are left out.
    pub(crate) fn combined(&self, other: &Self, with: impl Fn(usize, u32, f64, f64) -> f64 + Sync) -> Self {
        let rows = (0..self.len()).into_par_iter().map(|row| {
            let (a, b) = (self.row(row), other.row(row));
            let (mut i, mut j, mut merged) = (0, 0, Vec::with_capacity(a.len().max(b.len())));
            while i < a.len() || j < b.len() {
                let [left, right] = [a.get(i), b.get(j)].map(|entry| entry.map_or(u32::MAX, |entry| entry.0));
                let column = left.min(right);
                let take = |next: u32, at: &mut usize, entries: &[(u32, f64)]| {
                    let value = if next == column { entries[*at].1 } else { 0.0 };
                    *at += usize::from(next == column);
                    value
                };
                let (x, y) = (take(left, &mut i, a), take(right, &mut j, b));
                let value = with(row, column, x, y);
                if value != 0.0 {
                    merged.push((column, value));
                }
            }
            merged
        });
        Self::from_rows(rows.collect())
    }
}
