//! Contacts against exact areas and temperatures: any density, any overlap, layers, tubes, edges.

use std::f64::consts::PI;
use std::time::Instant;

use glam::{DMat3, DVec3};

use super::super::*;
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::network::reference::ReferenceStepper;

mod neighbours;

/// Conductance per area in the tests [W/(m2 K)].
const H: f64 = 100.0;

/// 2 mm of a metal that emits on one face.
const METAL: ShellMaterial = ShellMaterial {
    outer: Sheet { capacitance: 4860.0, conductance: 0.32, thickness: 0.002 },
    emissivity: 0.4,
    both_sides: false,
    over: None,
};

/// Grids of several parts.
#[derive(Default, Clone)]
struct Parts {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    parts: Vec<u32>,
}

impl Parts {
    /// Adds a grid of `n` x `m` cells over the unit square, cut along one diagonal or in turn along both, as a part.
    fn grid(mut self, part: u32, [n, m]: [usize; 2], in_turn: bool, place: impl Fn(f64, f64) -> DVec3) -> Self {
        let first = self.positions.len() as u32;
        for j in 0..=m {
            for i in 0..=n {
                self.positions.push(place(i as f64 / n as f64, j as f64 / m as f64));
                self.parts.push(part);
            }
        }
        let at = |i: usize, j: usize| first + (j * (n + 1) + i) as u32;
        for j in 0..m {
            for i in 0..n {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                let other = in_turn && (i + j) % 2 == 1;
                self.triangles.extend(if other { [[a, b, d], [b, c, d]] } else { [[a, b, c], [a, c, d]] });
            }
        }
        self
    }

    /// Adds a closed box over a square of side 1, from a height to another, as a part.
    fn closed_box(self, part: u32, cells: usize, [low, high]: [f64; 2]) -> Self {
        let rise = high - low;
        self.grid(part, [cells; 2], false, |x, y| DVec3::new(y, x, low))
            .grid(part, [cells; 2], false, |x, y| DVec3::new(x, y, high))
            .grid(part, [cells, 1], false, |x, z| DVec3::new(x, 0.0, low + z * rise))
            .grid(part, [cells, 1], false, |x, z| DVec3::new(1.0 - x, 1.0, low + z * rise))
            .grid(part, [cells, 1], false, |y, z| DVec3::new(1.0, y, low + z * rise))
            .grid(part, [cells, 1], false, |y, z| DVec3::new(0.0, 1.0 - y, low + z * rise))
    }

    fn count(&self) -> u32 {
        self.parts.iter().max().map_or(0, |last| last + 1)
    }

    fn selection(&self, chosen: &[u32]) -> Selection {
        let parts = (0..self.count()).map(|part| chosen.contains(&part)).collect();
        Selection { name: format!("parts {chosen:?}"), parts, materials: vec![true] }
    }

    fn contact(&self, between: [&[u32]; 2], conductance: ContactConductance) -> Contact {
        let between = between.map(|chosen| self.selection(chosen));
        Contact { name: "test".into(), between, distance: 1e-3, conductance }
    }

    fn shell(&self, contacts: &[Contact]) -> Result<Shell, ShellError> {
        let materials = vec![0; self.positions.len()];
        let (positions, triangles, parts) = (&self.positions, &self.triangles, &self.parts);
        let surface = ShellSurface { positions, triangles, parts, materials: &materials };
        Shell::new(&surface, &[Some(METAL)], contacts, None, f64::INFINITY, 0.0)
    }

    /// The shell with parts 0 and 1 in contact, with a conductance of `H` an area.
    fn touching(&self) -> Shell {
        self.shell(&[self.contact([&[0], &[1]], ContactConductance::PerArea(H))]).unwrap()
    }

    /// Area of the contact between parts 0 and 1 [m2].
    fn contact_area(&self) -> f64 {
        self.touching().summary.contacts[0].2 / H
    }
}

/// Steady temperatures of the drawn vertices under absorbed fluxes [W/m2].
fn steady(shell: &Shell, absorbed: impl Fn(usize) -> f64) -> Vec<f64> {
    let mut network = shell.network.clone();
    network.temperatures.fill(350.0);
    let mut heat = vec![0.0; network.len()];
    shell.gather(absorbed, &mut heat);
    let nothing = vec![0.0; network.len()];
    let mut stepper = ReferenceStepper::new(network, &[]);
    stepper.set_heat(&heat, &nothing);
    assert!(stepper.steady(0.0), "a steady state");
    let computed = stepper.temperatures();
    shell.node_of_vertex.iter().map(|node| computed[*node as usize]).collect()
}

/// Side of the plates [m].
const SIDE: f64 = 1.3;

/// Two square plates, the second 0.5 mm over the first. The inner lines of the second are shifted.
fn plates(lower: usize, upper: usize, shift: f64) -> Parts {
    let bent = |x: f64| SIDE * (x + shift * (PI * x).sin());
    Parts::default().grid(0, [lower; 2], false, |x, y| DVec3::new(SIDE * x, SIDE * y, 0.0)).grid(
        1,
        [upper; 2],
        true,
        |x, y| DVec3::new(bent(x), bent(y), 5e-4),
    )
}

const DENSITIES: [[usize; 2]; 11] =
    [[1, 1], [6, 6], [5, 10], [10, 5], [4, 12], [12, 4], [2, 14], [14, 2], [1, 9], [7, 9], [9, 7]];

/// Largest distance of the plates' temperatures from the exact ones [K].
fn plates_error(parts: &Parts, change: impl Fn(&mut Shell)) -> f64 {
    // The upper plate absorbs q. Each emits e sigma T^4 on one face, and the contact carries h (Tu - Tl). All of it holds for each square metre, so that
    // the plates are uniform: e sigma Tl^4 = h (Tu - Tl) and q = e sigma (Tu^4 + Tl^4). With Tl = 363.63 K: Tu = 363.63 + e sigma Tl^4 / h = 367.5956 K.
    let radiated = |t: f64| METAL.emissivity * STEFAN_BOLTZMANN * t.powi(4);
    let lower = 363.63;
    let upper = lower + radiated(lower) / H;
    assert!((upper - 367.60).abs() < 0.005);
    let flux = radiated(lower) + radiated(upper);
    let mut shell = parts.touching();
    change(&mut shell);
    let computed = steady(&shell, |vertex| if parts.parts[vertex] == 1 { flux } else { 0.0 });
    let error = |(found, part): (&f64, &u32)| (found - if *part == 1 { upper } else { lower }).abs();
    computed.iter().zip(&parts.parts).map(error).fold(0.0, f64::max)
}

#[test]
fn two_plates_have_their_exact_temperatures_at_any_density() {
    for [lower, upper] in DENSITIES {
        for shift in [0.0, 0.07, -0.05] {
            let error = plates_error(&plates(lower, upper, shift), |_| ());
            assert!(error < 1e-6, "{lower} and {upper} cells, shift {shift}: {error} K");
        }
    }
    // Half of the conductors lost, or the load of one corner by a third of its triangle, would be seen.
    let parts = plates(5, 10, 0.0);
    let lost = plates_error(&parts, |shell| {
        let between = |pair: [u32; 2]| pair.map(|node| node < 36);
        let linear = &mut shell.network.linear;
        linear
            .iter_mut()
            .filter(|one| between(one.nodes) == [true, false])
            .step_by(2)
            .for_each(|one| one.conductance = 0.0);
    });
    let corner = plates_error(&parts, |shell| shell.load_areas[36] *= 4.0 / 3.0);
    println!("half the conductors lost: {lost} K, a corner's load by thirds: {corner} K");
    assert!(lost > 1.0 && corner > 0.1, "{lost} {corner}");
}

fn close(computed: f64, expected: f64, tolerance: f64) -> bool {
    (computed / expected - 1.0).abs() <= tolerance
}

#[test]
fn the_sum_of_a_contact_is_its_exact_area() {
    let turned = DMat3::from_axis_angle(DVec3::new(1.0, -2.0, 0.5).normalize(), 0.7);
    let away = DVec3::new(80.0, -45.0, 13.0);
    let mut worst = 0.0_f64;
    for [lower, upper] in DENSITIES {
        // An upper square of side 0.5 turned by 0.4 rad about its centre, wholly on the lower, and one of side 1 that covers 0.69 x 0.83 of it.
        let (sine, cosine) = 0.4_f64.sin_cos();
        let inside = |x: f64, y: f64| {
            let [x, y] = [0.5 * x - 0.25, 0.5 * y - 0.25];
            DVec3::new(0.47 + cosine * x - sine * y, 0.52 + sine * x + cosine * y, 5e-4)
        };
        let beyond = |x: f64, y: f64| DVec3::new(x + 0.31, y + 0.17, -9e-4);
        let flat = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        for (exact, above) in [(0.25, &inside as &dyn Fn(f64, f64) -> DVec3), (0.69 * 0.83, &beyond)] {
            let parts = Parts::default().grid(0, [lower; 2], false, flat).grid(1, [upper; 2], true, above);
            let area = parts.contact_area();
            assert!(close(area, exact, 1e-9), "{lower} and {upper} cells: {area}, not {exact}");
            worst = worst.max((area / exact - 1.0).abs());
            let anywhere =
                Parts { positions: parts.positions.iter().map(|at| turned * *at + away).collect(), ..parts.clone() };
            assert!(close(anywhere.contact_area(), exact, 1e-9), "turned and far away: {}", anywhere.contact_area());
        }
    }
    println!("largest relative error of an area: {worst:.1e}");
    assert!(!close(0.25 * (1.0 + 2e-9), 0.25, 1e-9), "the comparison sees 2e-9");
}

#[test]
fn swapped_sides_and_swapped_meshes_give_the_same_contact() {
    for [lower, upper] in DENSITIES {
        let parts = plates(lower, upper, 0.03);
        let conductors = |between: [&[u32]; 2]| {
            let shell = parts.shell(&[parts.contact(between, ContactConductance::PerArea(H))]).unwrap();
            let total = shell.summary.contacts[0].2;
            (shell.network, total)
        };
        let (network, total) = conductors([&[0], &[1]]);
        let (swapped, other) = conductors([&[1], &[0]]);
        assert!(close(total, other, 1e-12));
        assert_eq!(network.linear.len(), swapped.linear.len());
        for (one, two) in network.linear.iter().zip(&swapped.linear) {
            assert_eq!(one.nodes, two.nodes);
            assert!((one.conductance - two.conductance).abs() < 1e-12 * H, "{one:?} {two:?}");
        }
        // What one plate loses the other gains.
        let temperatures: Vec<f64> = (0..network.len()).map(|node| 300.0 + (node as f64).sin() * 40.0).collect();
        let mut heat = vec![0.0; network.len()];
        let mut cold = network.clone();
        cold.emissive_areas.fill(0.0);
        cold.exchanged_heat(&temperatures, &mut heat);
        let scale: f64 = heat.iter().map(|heat| heat.abs()).sum();
        assert!(heat.iter().sum::<f64>().abs() < 1e-13 * scale && scale > 1.0);
        let first: f64 = heat[..(lower + 1) * (lower + 1)].iter().sum();
        let unequal = Network { linear: network.linear.iter().copied().step_by(2).collect(), ..cold };
        let mut part = vec![0.0; network.len()];
        unequal.exchanged_heat(&temperatures, &mut part);
        assert!((part[..(lower + 1) * (lower + 1)].iter().sum::<f64>() - first).abs() > 1e-6 || lower * upper == 1);
    }
}

#[test]
fn corners_converge_where_a_plate_covers_a_part_of_another() {
    // The upper plate lies in a corner of the lower and covers a quarter of it. It is heated. The contact is weak enough for the coarsest mesh to follow what
    // it does to the plates: sqrt(0.32 W/K / 20 W/(m2 K)) = 0.13 m. Three corners: that over the lower's corner, that over its middle, the lower's.
    let corners = |cells: usize, conductance: f64| {
        let (lower, upper) = (4 * cells, 3 * cells);
        let parts = Parts::default().grid(0, [lower; 2], false, |x, y| DVec3::new(SIDE * x, SIDE * y, 0.0)).grid(
            1,
            [upper; 2],
            true,
            |x, y| DVec3::new(0.5 * SIDE * x, 0.5 * SIDE * y, 5e-4),
        );
        let contact = parts.contact([&[0], &[1]], ContactConductance::PerArea(conductance));
        let computed =
            steady(&parts.shell(&[contact]).unwrap(), |vertex| if parts.parts[vertex] == 1 { 1000.0 } else { 0.0 });
        let first = (lower + 1) * (lower + 1);
        [computed[first], computed[computed.len() - 1], computed[0]]
    };
    let found = [1, 2, 4, 8].map(|cells| corners(cells, 20.0));
    println!("corners: {found:?}");
    let moves = |corner: usize| [0, 1, 2].map(|at: usize| (found[at + 1][corner] - found[at][corner]).abs());
    for (corner, moves) in [0, 1, 2].map(moves).into_iter().enumerate() {
        assert!(moves[1] < moves[0] && moves[2] < 0.45 * moves[1], "corner {corner}: {moves:?}");
        assert!(moves[2] < 0.8, "corner {corner}: {moves:?}");
    }
    // A contact that lost a tenth on one of the meshes would move the corners again.
    let weaker = corners(8, 18.0);
    let moved = [0, 1, 2].map(|corner: usize| (weaker[corner] - found[3][corner]).abs());
    println!("a tenth of the contact: {moved:?}");
    assert!(moved.iter().any(|moved| *moved > 1.0), "{moved:?}");
}

#[test]
fn tubes_in_one_another_touch_over_their_mean_surface() {
    let tubes = |inner: usize, outer: usize| {
        let around = |radius: f64, x: f64, y: f64| {
            let (sine, cosine) = (2.0 * PI * x).sin_cos();
            DVec3::new(radius * cosine, radius * sine, 0.5 * y)
        };
        let parts =
            Parts::default()
                .grid(0, [inner, 3], false, |x, y| around(0.05, x, y))
                .grid(1, [outer, 7], true, |x, y| around(0.0505, x + 0.01, y));
        parts.contact_area() / (2.0 * PI * 0.05025 * 0.5) - 1.0
    };
    let coarse = tubes(24, 32);
    let [fine, finer] = [tubes(48, 64), tubes(96, 128)];
    println!("tubes: {coarse:.5} {fine:.5} {finer:.5}");
    // A chord of an angle a is a^2/24 shorter than its arc: 0.0029 for 24 facets.
    assert!(coarse.abs() < 0.004 && fine.abs() < 0.001 && finer.abs() < 0.0003, "{coarse} {fine} {finer}");
    assert!(tubes(12, 16).abs() > 0.004, "what is coarser would be seen");
}

#[test]
fn leaning_plates_touch_as_far_as_their_gap_allows() {
    // Two unit squares from one line, 0.1 rad between them. At s from the line in the plane midway the gap is 2 s tan(0.05), so it is 1 mm at 9.99 mm.
    let lean = |cells: usize| {
        Parts::default()
            .grid(0, [4, 4], false, |x, y| DVec3::new(x, y, 0.0))
            .grid(1, [cells, cells], true, |x, y| DVec3::new(x * 0.1_f64.cos(), y, x * 0.1_f64.sin()))
    };
    let exact = 1e-3 / (2.0 * 0.05_f64.tan());
    for cells in [1, 3, 8, 150] {
        let area = lean(cells).contact_area();
        assert!(close(area, exact, 1e-9), "{cells}: {area} {exact}");
    }
    assert!(!close(1e-3 / (2.0 * 0.051_f64.tan()), exact, 1e-9));
}

#[test]
fn only_the_layers_that_face_each_other_touch() {
    // Closed boxes 0.4 mm thick, 0.2 mm apart: all four faces lie within 1 mm.
    let boxes = Parts::default().closed_box(0, 3, [0.0, 4e-4]).closed_box(1, 5, [6e-4, 1e-3]);
    let area = boxes.contact_area();
    assert!(close(area, 1.0, 1e-9), "{area}");
    // Two-faced sheets that lie on each other.
    let sheet = |parts: Parts, part: u32, cells: usize| {
        parts
            .grid(part, [cells; 2], false, |x, y| DVec3::new(x, y, 0.0))
            .grid(part, [cells; 2], true, |x, y| DVec3::new(y, x, 0.0))
    };
    for cells in [[3, 3], [3, 6], [5, 4]] {
        let area = sheet(sheet(Parts::default(), 0, cells[0]), 1, cells[1]).contact_area();
        assert!(close(area, 1.0, 1e-9), "{cells:?}: {area}");
    }
    // A sheet between two others touches both, and those do not touch each other. One pattern may name all three on both sides.
    let level = |parts: Parts, part: u32, cells: usize, height: f64| {
        parts.grid(part, [cells; 2], false, move |x, y| DVec3::new(x, y, height))
    };
    let three = level(level(level(Parts::default(), 0, 3, 0.0), 1, 4, 3e-4), 2, 5, 6e-4);
    let total = |between: [&[u32]; 2]| {
        let contact = three.contact(between, ContactConductance::PerArea(H));
        three.shell(&[contact]).unwrap().summary.contacts[0].2
    };
    assert!(close(total([&[1], &[0, 2]]), 2.0 * H, 1e-9));
    assert!(close(total([&[0, 1, 2], &[0, 1, 2]]), 2.0 * H, 1e-9), "{}", total([&[0, 1, 2], &[0, 1, 2]]));
    assert!(close(total([&[0], &[2]]), H, 1e-9), "what a contact does not name is not in its way");
    assert!(close(total([&[0], &[1, 2]]), H, 1e-9), "and what it names is");
    // A step: a half of the lower box is 0.2 mm higher, so the sheet above touches one height or the other everywhere.
    let half = |parts: Parts, from: f64, height: f64| {
        parts.grid(0, [3, 4], false, move |x, y| DVec3::new(from + 0.5 * x, y, height))
    };
    let whole = level(Parts::default(), 0, 4, 0.0);
    let stepped = level(half(whole, 0.25, 2e-4), 1, 7, 5e-4);
    assert!(close(stepped.contact_area(), 1.0, 1e-9), "{}", stepped.contact_area());
}

#[test]
fn edges_in_contact_have_their_length_at_any_density() {
    let flat = |x: f64, y: f64| DVec3::new(x, y, 0.0);
    for [first, second] in DENSITIES {
        let floor = |parts: Parts| parts.grid(0, [first; 2], false, flat);
        let joint = |place: &dyn Fn(f64, f64) -> DVec3| {
            floor(Parts::default()).grid(1, [second; 2], true, place).contact_area() / METAL.outer.thickness
        };
        let corner = joint(&|x, y| DVec3::new(0.0, x, y));
        let middle = joint(&|x, y| DVec3::new(0.37, 0.1 + 0.8 * x, y));
        let beside = joint(&|x, y| DVec3::new(1.0 + x - 1e-7, y, 0.0));
        let spaced = joint(&|x, y| DVec3::new(1.0 + x + 5e-4, y, 0.0));
        for (name, computed, length) in
            [("corner", corner, 1.0), ("middle", middle, 0.8), ("beside", beside, 1.0), ("spaced", spaced, 1.0)]
        {
            assert!(close(computed, length, 1e-6), "{name}, {first} and {second} cells: {computed} m, not {length}");
        }
        // Where an edge leaves the other side it counts until it is 1 mm away.
        let leaving = joint(&|x, y| DVec3::new(1.0 + x + 5e-4, 0.5 + y, 0.0));
        assert!((0.5..0.502).contains(&leaving), "{first} and {second} cells: {leaving}");
    }
    assert!(!close(1.0 + 2e-6, 1.0, 1e-6));
}

#[test]
fn points_share_a_total_and_refuse_an_area() {
    // A triangle that stands on one corner.
    let parts = Parts::default()
        .grid(0, [2, 2], false, |x, y| DVec3::new(x, y, 0.0))
        .grid(1, [1, 1], false, |x, y| DVec3::new(0.4, 0.5 + (x - y) * 0.5, (x + y) * 0.5));
    let make = |conductance| parts.shell(&[parts.contact([&[0], &[1]], conductance)]);
    let shell = make(ContactConductance::Total(3.0)).unwrap();
    assert_eq!(shell.summary.contacts[0].1, 1);
    assert!(close(shell.summary.contacts[0].2, 3.0, 1e-12));
    assert!(matches!(make(ContactConductance::PerArea(3.0)), Err(ShellError::NoArea { .. })));
}

#[test]
fn the_work_grows_with_the_mesh_and_not_with_its_square() {
    let seconds = |lower: usize, upper: usize| {
        let parts = plates(lower, upper, 0.02);
        let contact = parts.contact([&[0], &[1]], ContactConductance::PerArea(H));
        let materials = vec![0; parts.positions.len()];
        let nodes: Vec<u32> = (0..parts.positions.len() as u32).collect();
        let (positions, triangles) = (&parts.positions, &parts.triangles);
        let surface = ShellSurface { positions, triangles, parts: &parts.parts, materials: &materials };
        let measure = || {
            let start = Instant::now();
            let conductors = contact.conductors(&surface, &[Some(METAL)], &nodes).unwrap();
            assert!(close(conductors.iter().map(|one| one.conductance).sum(), H * SIDE * SIDE, 1e-9));
            start.elapsed().as_secs_f64()
        };
        let best = measure().min(measure());
        println!("{} triangles: {best:.3} s", parts.triangles.len());
        best
    };
    // Four times the triangles take some four times as long. Comparing all pairs would take sixteen times.
    let cells = if cfg!(debug_assertions) { 30 } else { 80 };
    assert!(seconds(2 * cells, 2 * cells + 2) < 10.0 * seconds(cells, cells + 1));
    assert!(seconds(1, 2 * cells) < 10.0 * seconds(1, cells), "a plate of two triangles against many");
}
