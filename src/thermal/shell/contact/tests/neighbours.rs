//! Neighbours that no contact joins: those that touch, those with a gap, and those outside the network.

use super::*;

/// Neighbours of a surface with a rule of `H` an area, all of one joint but those listed.
fn neighbours(parts: &Parts, contacts: &[Contact], join: bool, joints: &[u32]) -> Shell {
    with_rule(parts, contacts, (join, 1e-3), joints, METAL)
}

/// The same of a material, where surfaces touch within a distance [m].
fn with_rule(
    parts: &Parts,
    contacts: &[Contact],
    (join, distance): (bool, f64),
    joints: &[u32],
    material: ShellMaterial,
) -> Shell {
    let materials = vec![0; parts.positions.len()];
    let surface = ShellSurface {
        positions: &parts.positions,
        triangles: &parts.triangles,
        parts: &parts.parts,
        materials: &materials,
    };
    let rule = NeighbourRule { distance, listed_distance: 5e-3, per_area: H, join, joints, all: &[material] };
    Shell::new(&surface, &[Some(material)], contacts, Some(rule), f64::INFINITY, 0.0).unwrap()
}

/// A plate, one over it, and one that continues the first in its plane: one pair by faces, one along an edge. A fourth lies apart.
#[test]
fn neighbours_are_listed_with_their_area_or_length_and_joined_on_request() {
    let flat = |x: f64, z: f64| move |u: f64, v: f64| DVec3::new(x + u, v, z);
    let parts = Parts::default()
        .grid(0, [4; 2], false, flat(0.0, 0.0))
        .grid(1, [3; 2], true, flat(0.0, 5e-4))
        .grid(2, [5; 2], false, flat(1.0, -4e-4))
        .grid(3, [2; 2], false, flat(0.0, 0.1));
    let apart = neighbours(&parts, &[], false, &[0; 4]).summary.neighbours;
    let of = |a: u32, b: u32| apart.iter().find(|pair| pair.groups == [[a, 0], [b, 0]]);
    let faces = of(0, 1).expect("faces");
    assert!((faces.area - 1.0).abs() < 1e-9 && faces.length.is_none(), "{faces:?}");
    // By hand: each plate radiates 4 eps sigma T^3 = 2.4494 W/K at 300 K; 1 / (1 + 100 x 2 / 2.4494).
    let radiation = 4.0 * 0.4 * STEFAN_BOLTZMANN * 300f64.powi(3);
    assert!((faces.remaining - 1.0 / (1.0 + 2.0 * H / radiation)).abs() < 1e-12, "{faces:?}");
    let edge = of(0, 2).expect("an edge");
    assert!((edge.length.expect("a length") - 1.0).abs() < 1e-3, "{edge:?}");
    assert!((edge.conductance - H * 0.002).abs() < 1e-3 * H * 0.002, "length x thickness: {edge:?}");
    assert!(apart.iter().all(|pair| !pair.groups.contains(&[3, 0])), "the fourth touches nothing: {apart:?}");
    // The closest first, and none that a contact names.
    assert!(apart.is_sorted_by(|a, b| a.remaining <= b.remaining));
    let stated = parts.contact([&[1], &[0]], ContactConductance::PerArea(H));
    let rest = neighbours(&parts, std::slice::from_ref(&stated), false, &[0; 4]).summary.neighbours;
    assert!(rest.len() + 1 == apart.len() && rest.iter().all(|pair| pair.groups != [[0, 0], [1, 0]]), "{rest:?}");

    // Joined, the pair has the conductors of a stated contact. A joint between them keeps them apart.
    let two = Parts::default().grid(0, [4; 2], false, flat(0.0, 0.0)).grid(1, [3; 2], true, flat(0.0, 5e-4));
    let joined = neighbours(&two, &[], true, &[0; 2]);
    let by_hand = two.shell(&[two.contact([&[0], &[1]], ContactConductance::PerArea(H))]).unwrap();
    assert_eq!(joined.network.linear.len(), by_hand.network.linear.len());
    let sum = |shell: &Shell| shell.network.linear.iter().map(|one| one.conductance).sum::<f64>();
    assert!((sum(&joined) / sum(&by_hand) - 1.0).abs() < 1e-12 && joined.summary.neighbours.is_empty());
    let across = neighbours(&two, &[], true, &[0, 1]);
    assert!(sum(&across) < 0.5 * sum(&joined) && across.summary.neighbours.len() == 1);
}

/// The two skins of a panel, each of half its thickness, are neighbours: they look away from each other and fill the gap.
#[test]
fn skins_that_fill_a_gap_are_neighbours() {
    // Sheets of 2 mm. The first looks up, and the second down.
    let area = |first: f64, second: f64| {
        let up = move |u: f64, v: f64| DVec3::new(u, v, first);
        let down = move |u: f64, v: f64| DVec3::new(v, u, second);
        let parts = Parts::default().grid(0, [4; 2], false, up).grid(1, [3; 2], true, down);
        let pairs = neighbours(&parts, &[], false, &[0; 2]).summary.neighbours;
        pairs.iter().filter(|pair| pair.apart_by == ApartBy::NoContact).map(|pair| pair.area).sum::<f64>()
    };
    assert!((area(0.004, 0.0) - 1.0).abs() < 1e-9, "{}", area(0.004, 0.0));
    // A gap that they do not fill, and two skins that look at each other.
    assert_eq!([area(0.0041, 0.0), area(0.0, 0.004)].map(f64::abs), [0.0; 2]);
}

/// A gap above 1 mm is told and not joined, and from 5 mm on nothing is told. A distance that covers it joins.
#[test]
fn gaps_of_millimetres_are_told() {
    let plates = |gap: f64| {
        let up = |height: f64| move |u: f64, v: f64| DVec3::new(u, v, height);
        let down = move |u: f64, v: f64| DVec3::new(v, u, gap);
        Parts::default().grid(0, [4; 2], false, up(0.0)).grid(1, [3; 2], true, down)
    };
    let told = |gap: f64, join: bool, distance: f64| {
        let summary = with_rule(&plates(gap), &[], (join, distance), &[0; 2], METAL).summary;
        summary.neighbours.iter().map(|pair| (pair.apart_by, (pair.area * 1e6).round())).collect::<Vec<_>>()
    };
    for join in [false, true] {
        for gap in [0.0011, 0.002, 0.0049] {
            assert_eq!(told(gap, join, 1e-3), [(ApartBy::Gap, 1e6)], "{gap} m, {join}");
        }
        assert_eq!(told(0.0051, join, 1e-3), []);
    }
    assert_eq!(told(0.0005, false, 1e-3), [(ApartBy::NoContact, 1e6)]);
    assert_eq!([told(0.002, true, 2.5e-3), told(0.0005, true, 1e-3)], [[], []]);
}

/// What a joint divides may have a gap.
#[test]
fn a_gap_at_a_joint_is_not_told() {
    let flat = |height: f64| move |u: f64, v: f64| DVec3::new(u, v, height);
    let plates = Parts::default().grid(0, [4; 2], false, flat(0.0)).grid(1, [3; 2], true, flat(0.003));
    let told = |joints| with_rule(&plates, &[], (true, 1e-3), joints, METAL).summary.neighbours.len();
    assert_eq!([told(&[0, 0]), told(&[0, 1])], [1, 0]);
}

/// Both faces of a slab of one material and one part are joined through it where the sheets behind them fill it, and its rim is not.
#[test]
fn a_slab_of_one_material_conducts_through_itself() {
    let slab = |thickness: f64| Parts::default().closed_box(0, 4, [0.0, thickness]);
    let own = |thickness: f64| {
        let pairs = neighbours(&slab(thickness), &[], false, &[0]).summary.neighbours;
        assert!(pairs.iter().all(|pair| pair.groups == [[0, 0]; 2]), "{pairs:?}");
        pairs.iter().map(|pair| pair.area).sum::<f64>()
    };
    // Sheets of 2 mm. The sides of a slab this thin lie a metre apart.
    assert!((own(0.004) - 1.0).abs() < 1e-9, "{}", own(0.004));
    assert_eq!(own(0.0041), 0.0);
    let sum = |shell: &Shell| shell.network.linear.iter().map(|one| one.conductance).sum::<f64>();
    let joined = neighbours(&slab(0.004), &[], true, &[0]);
    let alone = slab(0.004).shell(&[]).unwrap();
    assert!((sum(&joined) - sum(&alone) - H).abs() < 1e-9 * H, "{} and {}", sum(&joined), sum(&alone));
    assert!(joined.summary.neighbours.is_empty());
    // A material that does not conduct, and a slab in which another part lies.
    let insulator = ShellMaterial { outer: Sheet { conductance: 0.0, ..METAL.outer }, ..METAL };
    assert!(with_rule(&slab(0.004), &[], (false, 1e-3), &[0], insulator).summary.neighbours.is_empty());
    let filled = slab(0.004).grid(1, [3; 2], false, |u, v| DVec3::new(u, v, 0.002));
    let pairs = neighbours(&filled, &[], false, &[0; 2]).summary.neighbours;
    assert!(pairs.iter().all(|pair| pair.groups[0] != pair.groups[1]), "{pairs:?}");
}

/// Pieces of one part and material that share no vertex touch like those of two parts.
#[test]
fn pieces_of_one_part_touch_each_other() {
    let flat = |height: f64| move |u: f64, v: f64| DVec3::new(u, v, height);
    let three = |gap: f64| {
        let parts = Parts::default().grid(0, [4; 2], false, flat(0.0)).grid(0, [3; 2], true, flat(gap));
        parts.grid(0, [5; 2], false, flat(2.0 * gap))
    };
    let area = |gap: f64| {
        let pairs = neighbours(&three(gap), &[], false, &[0]).summary.neighbours;
        pairs.iter().map(|pair| pair.area).sum::<f64>()
    };
    // The first touches the second, and that one the third, which the second hides from the first.
    assert!((area(5e-4) - 2.0).abs() < 1e-9, "{}", area(5e-4));
    assert_eq!(area(0.05), 0.0);
}

/// The drawn surface of a sheet with two faces is its middle: two of them touch where their halves fill the gap.
#[test]
fn sheets_with_two_faces_touch_where_they_fill_the_gap() {
    let both = ShellMaterial { both_sides: true, ..METAL };
    let area = |material: ShellMaterial, gap: f64, turned: bool| {
        let flat = |height: f64| move |u: f64, v: f64| DVec3::new(u, v, height);
        let other = move |u: f64, v: f64| if turned { DVec3::new(v, u, gap) } else { DVec3::new(u, v, gap) };
        let parts = Parts::default().grid(0, [4; 2], false, flat(0.0)).grid(1, [3; 2], true, other);
        let pairs = with_rule(&parts, &[], (false, 1e-3), &[0; 2], material).summary.neighbours;
        let touching = pairs.iter().filter(|pair| pair.apart_by == ApartBy::NoContact);
        touching.map(|pair| pair.area).sum::<f64>()
    };
    for turned in [false, true] {
        let areas = [area(both, 0.0019, turned), area(both, 0.0021, turned)];
        assert!((areas[0] - 1.0).abs() < 1e-9 && areas[1] == 0.0, "{turned}: {areas:?}");
    }
    // The sheet behind the upper surface reaches the lower one. Turned, both look at each other across a gap.
    let skins = [area(METAL, 0.0019, false), area(METAL, 0.0021, false), area(METAL, 0.0019, true)];
    assert!((skins[0] - 1.0).abs() < 1e-9 && skins[1..] == [0.0; 2], "{skins:?}");
}

/// A part outside the network is told where it lies at one of the network, and not where it lies at another outside.
#[test]
fn what_lies_outside_the_network_is_told() {
    let flat = |height: f64| move |u: f64, v: f64| DVec3::new(u, v, height);
    let parts = Parts::default().grid(0, [4; 2], false, flat(0.0)).grid(1, [3; 2], true, flat(0.0005)).grid(
        2,
        [5; 2],
        false,
        flat(0.001),
    );
    let materials: Vec<u32> = parts.parts.iter().map(|part| part.min(&1)).copied().collect();
    let surface = ShellSurface {
        positions: &parts.positions,
        triangles: &parts.triangles,
        parts: &parts.parts,
        materials: &materials,
    };
    let all = [METAL, METAL];
    let rule =
        NeighbourRule { distance: 1e-3, listed_distance: 5e-3, per_area: H, join: true, joints: &[0; 3], all: &all };
    let shell = Shell::new(&surface, &[Some(METAL), None], &[], Some(rule), f64::INFINITY, 0.0).unwrap();
    let [pair] = &shell.summary.neighbours[..] else { panic!("{:?}", shell.summary.neighbours) };
    assert_eq!((pair.groups, pair.apart_by), ([[0, 0], [1, 1]], ApartBy::Response));
    assert!((pair.area - 1.0).abs() < 1e-9, "{pair:?}");
}
