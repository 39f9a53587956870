//! The files that cases name.

use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};

/// The materials table of the tests.
pub const TABLE: &str = include_str!("../../../tests/it/scene/surfaces.toml");

/// The buffer of a tetrahedron: four corners, then the indices of four triangles.
pub fn tetrahedron() -> Vec<u8> {
    let corners: [[f32; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let indices: [u16; 12] = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3];
    let corners = corners.as_flattened().iter().flat_map(|value| value.to_le_bytes());
    corners.chain(indices.iter().flat_map(|index| index.to_le_bytes())).collect()
}

/// A temporary folder that goes with its value.
pub struct Folder(PathBuf);

impl Folder {
    pub fn new(name: &str) -> std::io::Result<Self> {
        // Two tests of one process run at a time: the first to end would remove the files of the other.
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let folder = std::env::temp_dir().join(format!("isotherm_fuzz_{}_{number}_{name}", std::process::id()));
        std::fs::create_dir(&folder)?;
        let tle = include_str!("../../../models/iss.tle");
        let files: [(&str, &[u8]); 8] = [
            ("craft.glb", b""),
            ("station.glb", b""),
            ("table.toml", TABLE.as_bytes()),
            ("iss.tle", tle.as_bytes()),
            ("materials.toml", include_bytes!("../../../models/materials.toml")),
            ("cooling.csv", b"time,temperature\n0,300\n10,290\n30,275\n90,262\n200,260\n"),
            ("schedule.csv", b"time,angle_deg\n0,0\n100,90\n"),
            ("model.bin", &tetrahedron()),
        ];
        for (name, content) in files {
            std::fs::write(folder.join(name), content)?;
        }
        Ok(Self(folder))
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // What stays in the temporary folder harms nobody.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
