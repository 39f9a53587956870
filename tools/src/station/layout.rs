//! The station as a tree of named nodes and joints.
//!
//! Body axes: +X forward (velocity), +Y starboard, +Z nadir [m]. In the file's pose every joint frame is parallel to
//! the body frame, and the cells of all wings face zenith (-Z). Alpha joints turn about Y, beta joints and central
//! radiator joints about X, photovoltaic radiator joints about Z.

use glam::{DVec3, dvec3};

use crate::material::Material;
use crate::mesh::{Band, Lathe, Mesh};
use crate::{modules, panels, truss};

/// A node of the scene graph. Joints have no mesh, so only children move.
#[derive(Debug, Clone)]
pub struct Node {
    /// Unique name.
    pub name: String,
    /// Position in the parent's frame [m].
    pub translation: DVec3,
    /// Index into [`Station::meshes`].
    pub mesh: Option<usize>,
    /// Attached nodes.
    pub children: Vec<Node>,
}

/// The whole station. Identical parts share a mesh.
#[derive(Debug, Clone)]
pub struct Station {
    /// Meshes with their names.
    pub meshes: Vec<(String, Mesh)>,
    /// The node `station`, at the body origin.
    pub root: Node,
}

/// Middle of the truss [m].
const TRUSS: DVec3 = DVec3::new(0.0, 0.0, -3.0);
/// Height of the line of modules along X [m].
const MODULES_Z: f64 = 1.6;
/// Distance of an alpha joint from the middle of the truss [m].
const ALPHA_Y: f64 = 25.0;
/// Places of the beta joints outboard of an alpha joint [m].
const BETA_STATIONS: [f64; 2] = [8.0, 23.0];
/// Distance of a beta joint from the truss axis, along X [m].
const BETA_X: f64 = 2.0;
/// Places of the photovoltaic radiators outboard of an alpha joint [m].
const PV_RADIATOR_STATIONS: [f64; 2] = [11.5, 19.0];

impl Node {
    /// A node without a mesh.
    fn frame(name: impl Into<String>, translation: DVec3, children: Vec<Self>) -> Self {
        Self { name: name.into(), translation, mesh: None, children }
    }
}

/// Collects meshes while the tree grows.
#[derive(Default)]
struct Yard {
    meshes: Vec<(String, Mesh)>,
}

impl Yard {
    /// Stores a mesh for several nodes.
    fn share(&mut self, name: &str, mesh: Mesh) -> usize {
        self.meshes.push((name.to_owned(), mesh));
        self.meshes.len() - 1
    }

    /// A leaf node with a mesh of its own, in its parent's frame.
    fn part(&mut self, name: &str, mesh: Mesh) -> Node {
        let mesh = Some(self.share(name, mesh));
        Node { mesh, ..Node::frame(name, DVec3::ZERO, vec![]) }
    }
}

/// Builds the station; the same on every call.
pub fn station() -> Station {
    let mut yard = Yard::default();
    let mut children = pressurised_part(&mut yard);
    let mut truss_children = vec![yard.part("truss_central", truss::central())];
    truss_children.extend(outboard_parts(&mut yard));
    truss_children.extend(central_radiators(&mut yard));
    truss_children.push(antenna(&mut yard));
    truss_children.push(arm(&mut yard));
    children.push(Node::frame("truss", TRUSS, truss_children));
    Station { meshes: yard.meshes, root: Node::frame("station", DVec3::ZERO, children) }
}

/// Both rotating ends of the truss, with eight wings (1 to 4 to port, odd numbers forward) and four radiators.
fn outboard_parts(yard: &mut Yard) -> Vec<Node> {
    let wings = [1.0, -1.0]
        .map(|end| (end, yard.share(if end > 0.0 { "wing_forward" } else { "wing_aft" }, panels::wing(end))));
    let radiator = yard.share("photovoltaic_radiator", panels::photovoltaic_radiator());
    let mut nodes = vec![];
    let (mut wing_number, mut radiator_number) = (0, 0);
    for (side, side_name) in [(-1.0, "port"), (1.0, "starboard")] {
        let outboard = truss::outboard(side, BETA_STATIONS, BETA_X);
        let mut children = vec![yard.part(&format!("truss_{side_name}"), outboard)];
        for station in BETA_STATIONS {
            for (end, mesh) in wings {
                wing_number += 1;
                let wing =
                    Node { mesh: Some(mesh), ..Node::frame(format!("array_wing_{wing_number}"), DVec3::ZERO, vec![]) };
                let place = dvec3(BETA_X * end, station * side, 0.0);
                children.push(Node::frame(format!("beta_joint_{wing_number}"), place, vec![wing]));
            }
        }
        for station in PV_RADIATOR_STATIONS {
            radiator_number += 1;
            let panel = Node {
                mesh: Some(radiator),
                ..Node::frame(format!("pv_radiator_{radiator_number}"), DVec3::ZERO, vec![])
            };
            let place = dvec3(0.0, station * side, 1.5);
            children.push(Node::frame(format!("pv_radiator_joint_{radiator_number}"), place, vec![panel]));
        }
        nodes.push(Node::frame(format!("alpha_joint_{side_name}"), DVec3::Y * (ALPHA_Y * side), children));
    }
    nodes
}

/// Three groups of radiators aft of the truss: the outer two edge-on to the orbit plane, the middle one level.
fn central_radiators(yard: &mut Yard) -> Vec<Node> {
    [("port", -15.0, DVec3::Z), ("centre", 0.0, DVec3::Y), ("starboard", 15.0, DVec3::Z)]
        .into_iter()
        .map(|(name, y, across)| {
            let panels = yard.part(&format!("radiator_{name}"), panels::central_radiator(across));
            Node::frame(format!("radiator_joint_{name}"), dvec3(-2.2, y, 0.0), vec![panels])
        })
        .collect()
}

/// A dish on a mast above the truss that looks to zenith.
fn antenna(yard: &mut Yard) -> Node {
    let mut mast = Mesh::default();
    mast.strut(Material::ArrayMast, DVec3::ZERO, DVec3::Z * -3.0, 0.2);
    let mut dish = Mesh::default();
    dish.cylinder(Material::AnodizedAluminium, DVec3::Z * 0.2, DVec3::NEG_Z, 0.25, 0.5);
    // The profile follows the outside of the bowl from apex to rim, then the inside to the axis: r^2 / 4f with f = 1.4
    // m.
    let bowl = |radius: f64| 0.25 + radius * radius / 5.6;
    let outside = [0.5, 1.0, 1.5].map(|r| Band(Material::WhitePaint, bowl(r), r));
    let inside = [1.5, 1.0, 0.5, 0.0].map(|r| Band(Material::WhitePaint, bowl(r) + 0.06, r));
    let profile = [&outside[..], &inside[..]].concat();
    dish.turn(&Lathe::round(DVec3::ZERO, DVec3::NEG_Z, 24), bowl(0.0), &profile);
    dish.strut(Material::BlackPaint, DVec3::Z * -0.2, DVec3::Z * -1.5, 0.12);
    let children = vec![
        yard.part("antenna_mast", mast),
        Node::frame("antenna_joint", DVec3::Z * -3.2, vec![yard.part("antenna_dish", dish)]),
    ];
    Node::frame("antenna", dvec3(0.0, 4.0, -2.0), children)
}

/// A robotic arm on the forward face of the truss: shoulder, two booms, wrist with its end effector.
fn arm(yard: &mut Yard) -> Node {
    let boom = |to: DVec3| {
        let mut mesh = Mesh::default();
        let axis = to.normalize();
        mesh.cylinder(Material::AnodizedAluminium, DVec3::Y * -0.4, DVec3::Y, 0.3, 0.8);
        mesh.cylinder(Material::WhitePaint, axis * 0.2, axis, 0.19, to.length() - 0.4);
        mesh
    };
    let (upper, lower, hand) = (dvec3(3.2, -1.2, -5.6), dvec3(5.4, 2.6, 2.8), dvec3(0.6, 0.4, 1.2));
    let mut base = Mesh::default();
    base.cuboid(Material::AnodizedAluminium, dvec3(-0.5, 0.0, 0.0), dvec3(0.7, 3.0, 2.2));
    base.cylinder(Material::WhitePaint, DVec3::X * -0.2, DVec3::X, 0.4, 0.6);
    let effector = Node::frame("arm_wrist_joint", lower, vec![yard.part("arm_hand", boom(hand))]);
    let forearm = vec![yard.part("arm_forearm", boom(lower)), effector];
    let shoulder = vec![yard.part("arm_upper", boom(upper)), Node::frame("arm_elbow_joint", upper, forearm)];
    let children = vec![yard.part("arm_base", base), Node::frame("arm_shoulder_joint", DVec3::X * 0.5, shoulder)];
    Node::frame("arm", dvec3(2.8, -8.0, -0.4), children)
}

/// The modules and docked vehicles. Ports overlap by a few centimetres so that no two faces share a plane.
fn pressurised_part(yard: &mut Yard) -> Vec<Node> {
    let line = |x: f64| dvec3(x, 0.0, MODULES_Z);
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let central_node = line(-1.2);
    let forward_node = line(12.8);
    let port_node = central_node - y * 5.3;
    let mut hangers = Mesh::default();
    for (from, to) in [(2.0, 4.6), (-2.0, -2.6)] {
        for side in [-1.0, 1.0] {
            let top = TRUSS + dvec3(from, 2.0 * side, 2.0);
            hangers.strut(Material::AnodizedAluminium, top, line(to) + dvec3(0.0, 0.9 * side, -1.6), 0.2);
        }
    }
    let mut porch = Mesh::default();
    let deck = forward_node - y * 15.4 + z * 0.4;
    porch.cuboid(Material::MliBlanket, deck, dvec3(4.6, 5.4, 1.6));
    for (dx, dy) in [(-1.2, -1.6), (1.3, -1.4), (-1.3, 0.5), (1.2, 0.9)] {
        porch.cuboid(Material::WhitePaint, deck + dvec3(dx, dy, -1.4), dvec3(1.5, 1.4, 1.5));
    }
    [
        ("adapter_forward", modules::adapter(line(15.5), x, 2.0)),
        ("node_forward", modules::pressurised(line(10.0), x, 5.6, 2.2)),
        ("laboratory_central", modules::laboratory(line(1.5), x, 8.6, 2.2)),
        ("node_central", modules::pressurised(line(-4.0), x, 5.6, 2.2)),
        ("adapter_aft", modules::adapter(line(-3.95), -x, 2.05)),
        ("storage_module", modules::pressurised(line(-5.95), -x, 12.0, 1.95)),
        ("node_aft", modules::sphere(line(-19.2), 1.7)),
        ("service_module", modules::service(line(-20.5))),
        ("docking_compartment", modules::pressurised(line(-19.2) + z * 1.5, z, 4.4, 1.25)),
        ("laboratory_starboard", modules::laboratory(forward_node + y * 2.1, y, 7.0, 2.2)),
        ("laboratory_port", modules::laboratory(forward_node - y * 2.1, -y, 10.6, 2.2)),
        ("logistics_module", modules::pressurised(forward_node - y * 9.0 - z * 2.1, -z, 4.2, 2.0)),
        ("porch", porch),
        ("airlock", modules::pressurised(central_node + y * 2.1, y, 5.6, 1.75)),
        ("node_port", modules::pressurised(central_node - y * 2.1, -y, 6.4, 2.2)),
        ("adapter_port", modules::adapter(central_node - y * 8.45, -y, 1.8)),
        ("cupola", modules::cupola(port_node + z * 2.1)),
        ("cargo_module", modules::pressurised(central_node + z * 2.1, z, 6.6, 2.1)),
        ("capsule", modules::capsule(line(17.45))),
        ("hangers", hangers),
    ]
    .into_iter()
    .map(|(name, mesh)| yard.part(name, mesh))
    .collect()
}

/// Triangles of all instances.
pub fn triangles_drawn(station: &Station) -> usize {
    fn below(node: &Node, station: &Station) -> usize {
        let own = node.mesh.map_or(0, |mesh| station.meshes[mesh].1.surfaces.iter().map(|s| s.triangles.len()).sum());
        own + node.children.iter().map(|child| below(child, station)).sum::<usize>()
    }
    below(&station.root, station)
}
