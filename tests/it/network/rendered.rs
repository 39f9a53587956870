//! A model of another program from its TMD to an image: imported, solved, and its temperatures rendered on a device and on the f64 reference.

use std::path::Path;

use isotherm::internals::Tmd;
use serde_json::json;

use super::tmd::{LIMIT, deck, small};
use crate::craft::Folder;
use crate::model::make::Maker;
use crate::program::succeed;
use crate::shown::images;

/// Columns of the squares that stand for nodes.
const COLUMNS: usize = 11;

/// A square for each node, 1 m apart, with the node's name.
fn squares(names: &[String]) -> Maker {
    let mut maker = Maker::new();
    let corners = maker.floats(&[[0.05, 0.05, 0.0], [0.95, 0.05, 0.0], [0.95, 0.95, 0.0], [0.05, 0.95, 0.0]]);
    let fields = json!({"componentType": 5121, "count": 6, "type": "SCALAR"});
    let indices = maker.accessor(&[0u8, 1, 2, 0, 2, 3], fields);
    maker.push("materials", json!({"name": "paint"}));
    maker.primitive(json!({"attributes": {"POSITION": corners}, "indices": indices, "material": 0}));
    let node = |(number, name): (usize, &String)| json!({"name": name, "mesh": 0, "translation": [number % COLUMNS, number / COLUMNS, 0]});
    maker.json["nodes"] = names.iter().enumerate().map(node).collect();
    maker.json["scenes"][0]["nodes"] = (0..names.len()).collect();
    maker
}

/// Imports, solves and renders a TMD as a user does. Returns the greatest difference between what a pixel shows and the solution of the file [K], and the same
/// from the solution one time later.
fn rendered(tmd: &Tmd, bytes: &Path) -> [f64; 2] {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::copy(bytes, folder.path().join("deck.TMD")).expect("copied");
    succeed(folder.path(), &["network", "import", "deck.TMD", "-o", "deck.toml"]);
    succeed(folder.path(), &["network", "deck.toml", "--device", "cpu", "-o", "deck.csv"]);
    let series = std::fs::read_to_string(folder.path().join("deck.csv")).expect("a series");
    let names: Vec<String> = series.lines().next().expect("a header").split(',').skip(1).map(str::to_owned).collect();
    squares(&names).save(folder.path());
    let last = tmd.times.len() - 1;
    let scene = format!(
        "[model]\npath = \"made.glb\"\n[time]\nstep = 100\nsteps = {last}\ndraw_steps = [0, {}, {last}]\n[orbit]\naltitude = 408e3\n[attitude]\n\
         mode = \"nadir\"\n[environment]\nbackground_temperature = 0\n[camera]\nwidth = 132\nheight = 120\nfov_deg = 34\n\
         position = [5.5, 5, 20]\nlook_at = [5.5, 5, 0]\nup = [0, 1, 0]\n[[material]]\nmatch = \"paint\"\nabsorptivity = 0.5\n\
         emissivity = 0.9\nsides = \"outside\"\n[temperatures]\nfile = \"deck.csv\"\n",
        last / 2
    );
    let folder = Folder(folder);
    folder.write("scene.toml", &scene);
    let prepared = folder.prepared();
    let mut worst = [0.0f64; 2];
    for images in images(&prepared) {
        let mut seen = vec![0; names.len()];
        for image in &images {
            let time = (image.time / 100.0).round() as usize;
            for (part, kelvin) in &image.pixels {
                let node = tmd.nodes.iter().find(|node| node.name == prepared.parts[*part]).expect("a node of the TMD");
                for (worst, time) in worst.iter_mut().zip([time, (time + 1).min(last)]) {
                    *worst = worst.max((kelvin - node.temperatures[time]).abs());
                }
                seen[*part] += 1;
            }
        }
        let count = images.len();
        assert!(count == 3 && seen.iter().all(|pixels| *pixels > 3 * 20), "{count} images, pixels {seen:?}");
    }
    println!("rendered {:.3} mK off the solution of the file", 1e3 * worst[0]);
    worst
}

#[test]
fn a_small_file_is_imported_solved_and_rendered() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("small.TMD");
    std::fs::write(&path, small().bytes().expect("a file")).expect("written");
    let [off, late] = rendered(&small(), &path);
    assert!(off <= LIMIT, "{off} K");
    assert!(late > LIMIT, "the solution of another time must not pass");
}

#[test]
fn the_public_deck_is_rendered() {
    let Some(path) = deck() else { return };
    let [off, late] = rendered(&Tmd::load(&path).expect("the deck"), &path);
    assert!(off <= LIMIT, "{off} K");
    assert!(late > LIMIT, "the solution of another time must not pass");
}
