//! A sparse square matrix in rows.

use rayon::prelude::*;

/// Rows that one thread merges together.
const CHUNK: usize = 64;

/// A row: columns and values.
pub(crate) type SparseRow = Vec<(u32, f64)>;

/// Lists one after another, copied by all threads.
pub(crate) fn joined<T: Copy + Default + Send + Sync>(lists: &[Vec<T>]) -> Vec<T> {
    let mut all = vec![T::default(); lists.iter().map(Vec::len).sum()];
    let (mut left, mut rooms) = (&mut all[..], Vec::with_capacity(lists.len()));
    for list in lists {
        let (room, rest) = left.split_at_mut(list.len());
        rooms.push((room, list));
        left = rest;
    }
    rooms.into_par_iter().for_each(|(room, list)| room.copy_from_slice(list));
    all
}

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

    /// Entries of each row.
    pub(crate) fn rows_mut(&mut self) -> Vec<&mut [(u32, f64)]> {
        let mut left = &mut self.entries[..];
        let mut rows = Vec::with_capacity(self.first.len());
        for ends in self.first.windows(2) {
            let (row, rest) = left.split_at_mut((ends[1] - ends[0]) as usize);
            rows.push(row);
            left = rest;
        }
        rows
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
        let merge = |chunk: usize| {
            let rows = chunk * CHUNK..self.len().min((chunk + 1) * CHUNK);
            let room = |of: &Self| (of.first[rows.end] - of.first[rows.start]) as usize;
            let mut merged = Vec::with_capacity(room(self) + room(other));
            let ends: Vec<u32> = rows
                .map(|row| {
                    let (a, b) = (self.row(row), other.row(row));
                    let (mut i, mut j) = (0, 0);
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
                    merged.len() as u32
                })
                .collect();
            (merged, ends)
        };
        let chunks: Vec<(SparseRow, Vec<u32>)> = (0..self.len().div_ceil(CHUNK)).into_par_iter().map(merge).collect();
        let mut first = Vec::with_capacity(self.len() + 1);
        first.push(0);
        for (_, ends) in &chunks {
            let start = first[first.len() - 1];
            first.extend(ends.iter().map(|end| start + end));
        }
        let merged: Vec<SparseRow> = chunks.into_iter().map(|chunk| chunk.0).collect();
        Self { first, entries: joined(&merged) }
    }
}
