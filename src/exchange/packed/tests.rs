//! Findings that a file kept: each damage to their lengths, orders and numbers is seen.

use super::*;

/// Three patches: single values with lower halves and a rest, and doubles.
fn finding() -> PoseFinding {
    let rows = |values: [f64; 3]| {
        let row = |row: usize| (0..3).map(|column| (column, values[row.min(column as usize)])).collect();
        HalfRows::new(&Sparse::from_rows((0..3).map(row).collect()))
    };
    PoseFinding {
        rows: [rows([1.0, 0.7f32.into(), 0.1]), rows([0.1, 0.2, 0.3]), rows([1.0, 2.0, 3.0])],
        space: [vec![1.0; 3], vec![2.0; 3], vec![3.0; 3]],
        returned: [0.0; 2],
        inside: vec![0.0; 3],
        correction: Correction::default(),
        rays: 8,
        open: vec![0x2c, 0xc0, 0x01],
    }
}

type Damage = fn(&mut PoseFinding);

#[test]
fn a_finding_of_other_patches_or_with_other_numbers_is_seen() {
    let whole = finding();
    assert!(!whole.rows[0].upper.is_empty() && !whole.rows[0].lower.is_empty() && !whole.rows[0].rests.is_empty());
    assert!(!whole.rows[1].doubles.is_empty());
    assert!(whole.is_whole(3, 8, 2));
    for (patches, rays, bundles) in [(2, 8, 2), (4, 8, 2), (3, 9, 2), (3, 8, 3), (0, 8, 2)] {
        assert!(!whole.is_whole(patches, rays, bundles));
    }
    let damages: [(&str, Damage); 17] = [
        ("no start", |found| found.rows[0].first.clear()),
        ("another start", |found| found.rows[0].first[0] = 1),
        ("another end", |found| found.rows[0].first[3] += 1),
        ("falling starts", |found| found.rows[0].first[1] = 6),
        ("a column beyond", |found| found.rows[0].columns[2] = 3),
        ("a column before", |found| found.rows[0].columns[5] = 1),
        ("the same column twice", |found| found.rows[0].columns[1] = 0),
        ("a value less", |found| found.rows[0].upper.truncate(5)),
        ("a lower half less", |found| found.rows[0].lower.clear()),
        ("no bits", |found| found.rows[0].has_lower.clear()),
        ("a rest beyond", |found| found.rows[0].rests[0].0 = 6),
        ("a double less", |found| found.rows[1].doubles.truncate(5)),
        ("both kinds", |found| found.rows[0].doubles = vec![0.0; 6]),
        ("a share of space less", |found| found.space[2].truncate(2)),
        ("a share inside more", |found| found.inside.push(0.0)),
        ("a byte of the sky less", |found| found.open.truncate(2)),
        ("more open than all", |found| found.open[1] = 0x0d),
    ];
    for (what, damage) in damages {
        let mut found = whole.clone();
        damage(&mut found);
        assert!(!found.is_whole(3, 8, 2), "{what}");
    }
}
