//! The text that says how the labels of a data set are to be read.

use std::fmt::Write;

use super::craft::Craft;
use super::silhouette::Solids;

const HEAD: &str = include_str!("conventions.txt");

/// The sentences about symmetries: the first where the SPEC states none, the second where it states some.
const SYMMETRIES: [&str; 2] = [
    "No symmetries are stated.",
    "symmetries  models_info.json has those of the geometry that the SPEC states. Temperatures need not have them.",
];

/// `README.txt` of a data set: the conventions, and the numbers of objects, parts and key points.
pub(crate) fn text(craft: &Craft, solids: &Solids) -> String {
    let mut text = HEAD.replace("{symmetries}", SYMMETRIES[usize::from(!craft.symmetries.is_empty())]);
    // A text takes everything that is written to it.
    let _ = writeln!(text, "\nOBJECTS OF BOP\nobj_id  link\n");
    for object in solids.objects() {
        let _ = writeln!(text, "{:6}  {}", object.id, object.name);
    }
    let targets = craft.target_names();
    if !craft.targets.is_empty() {
        text += "\nTARGETS\nThey take the place of the craft. A target has the number id in instance/*.png, in targets of label/*.json and as category of COCO; its class \
                 of YOLO is id - 1, and its type of KITTI its name. An object of BOP belongs to one target.\nid  target\n\n";
        for (target, name) in targets.iter().enumerate() {
            let _ = writeln!(text, "{:2}  {name}", target + 1);
        }
    }
    let _ = writeln!(text, "\nPARTS\npixel  COCO category  link  part\n");
    for (number, part) in craft.parts.iter().enumerate() {
        let link = &craft.links[craft.link_of_part[number] as usize];
        let _ = writeln!(text, "{:5}  {:13}  {link}  {part}", number + 1, number + 1 + targets.len());
    }
    let _ = writeln!(text, "\nMATERIALS\npixel  material\n");
    for (number, material) in craft.materials.iter().enumerate() {
        let _ = writeln!(text, "{:5}  {material}", number + 1);
    }
    let _ =
        writeln!(text, "\nKEY POINTS [m], body axes, joints as they are in the model's file\nname  link  x  y  z\n");
    for point in &craft.key_points {
        let link = &craft.links[point.link as usize];
        let [x, y, z] = point.position.to_array();
        let _ = writeln!(text, "{}  {link}  {x}  {y}  {z}", point.name);
    }
    text
}
