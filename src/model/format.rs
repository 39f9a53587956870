//! Names the format of a model file that is no glTF 2.0, from its first bytes or its name.

use std::path::Path;

use super::ModelFault;

pub(super) const GLTF_1: &str = "glTF 1.0";
/// Wrappings of many formats, which the name of the file tells apart.
const ZIP: &str = "a zip archive, as 3MF and USDZ files are";
const COMPOUND: &str = "a compound file, as those of SolidWorks and Inventor are";
const COMPRESSED: &str = "a file compressed by gzip";

/// First bytes of formats.
const BEGINNINGS: [(&[u8], &str); 27] = [
    (b"ISO-10303-21", "a STEP file"),
    (b"DBRep_DrawableShape", "a BREP file of Open CASCADE"),
    (b"CASCADE Topology", "a BREP file of Open CASCADE"),
    (b"Open CASCADE Topology", "a BREP file of Open CASCADE"),
    (b"**ABCDEFGHIJKLMNOPQRSTUVWXYZ", "a Parasolid file"),
    (b"PS\0\0", "a Parasolid file"),
    (b"ACIS BinaryFile", "an ACIS file"),
    (b"\xD0\xCF\x11\xE0\xA1\xB1\x1A\xE1", COMPOUND),
    (b"V5_CFV2", "a CATIA file"),
    (b"3D Geometry File Format", "a Rhino file"),
    (b"AC10", "an AutoCAD drawing"),
    (b"OFF\n", "an OFF file"),
    (b"MM\0", "a 3DS file"),
    (b"Kaydara FBX", "an FBX file"),
    (b"; FBX", "an FBX file"),
    (b"PK\x03\x04", ZIP),
    (b"PXR-USDC", "a USD file"),
    (b"#usda", "a USD file"),
    (b"BLENDER", "a file of Blender"),
    (b"(\xB5/\xFD", "a compressed file, as newer files of Blender are"),
    (b"\x1F\x8B", COMPRESSED),
    (b"ply\n", "a PLY file"),
    (b"ply\r", "a PLY file"),
    (b"solid", "an STL file"),
    (b"#VRML", "a VRML file"),
    (b"\x89HDF", "an HDF5 file"),
    (b"xof ", "a DirectX file"),
];
/// Header and one triangle of a binary STL file.
const STL: [usize; 2] = [84, 50];
/// Lines of an OBJ file that are looked at, and the words that begin them.
const LINES: usize = 200;
const OBJ: [&str; 8] = ["v", "vn", "vt", "f", "o", "g", "mtllib", "usemtl"];

/// Endings of names, where the bytes say nothing or name a wrapping alone.
const ENDINGS: [(&[&str], &str); 21] = [
    (&["step", "stp", "p21"], "a STEP file"),
    (&["stpz"], "a compressed STEP file"),
    (&["iges", "igs"], "an IGES file"),
    (&["brep", "brp"], "a BREP file of Open CASCADE"),
    (&["x_t", "x_b", "xmt_txt", "xmt_bin"], "a Parasolid file"),
    (&["sat", "sab"], "an ACIS file"),
    (&["sldprt", "sldasm"], "a SolidWorks file"),
    (&["ipt", "iam"], "an Inventor file"),
    (&["catpart", "catproduct"], "a CATIA file"),
    (&["prt", "asm"], "a file of Creo or NX"),
    (&["jt"], "a JT file"),
    (&["fcstd"], "a FreeCAD file"),
    (&["3dm"], "a Rhino file"),
    (&["dxf", "dwg"], "an AutoCAD drawing"),
    (&["3mf"], "a 3MF file"),
    (&["stl"], "an STL file"),
    (&["obj"], "an OBJ file"),
    (&["fbx"], "an FBX file"),
    (&["blend"], "a file of Blender"),
    (&["usdz", "usd"], "a USD file"),
    (&["3ds", "dae", "ply", "off", "wrl", "x3d"], "a mesh of another format"),
];

/// The fault of a file that is no glTF 2.0, with the format that its name tells where its bytes do not.
pub(super) fn named(fault: ModelFault, path: &Path) -> ModelFault {
    let unclear = match &fault {
        ModelFault::Json(_) => true,
        ModelFault::Format(format) => [ZIP, COMPOUND, COMPRESSED].contains(format),
        _ => false,
    };
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
    let known = ENDINGS.iter().find(|(endings, _)| endings.contains(&ending.as_str()));
    known.filter(|_| unclear).map_or(fault, |(_, format)| ModelFault::Format(format))
}

/// What is in a file that was to hold a model, where a download failed.
pub(super) fn not_fetched(bytes: &[u8]) -> Option<&'static str> {
    let begins = |word: &str| {
        bytes.trim_ascii_start().get(..word.len()).is_some_and(|begin| begin.eq_ignore_ascii_case(word.as_bytes()))
    };
    if begins("version https://git-lfs") {
        Some("a pointer of Git LFS (git lfs pull fetches the file)")
    } else if begins("<html") || begins("<!doctype html") {
        Some("a web page, as a download without login gives")
    } else {
        None
    }
}

/// The name of a format that is not glTF. `None` where the bytes may be glTF 2.0.
pub(super) fn other(bytes: &[u8]) -> Option<&'static str> {
    let begins = BEGINNINGS.iter().find(|(beginning, _)| bytes.starts_with(beginning)).map(|(_, name)| *name);
    begins.or_else(|| is_stl(bytes).then_some("an STL file")).or_else(|| of_text(bytes))
}

/// Whether the number of triangles in a binary STL file's header explains its length.
fn is_stl(bytes: &[u8]) -> bool {
    let count = bytes.get(80..84).and_then(|count| count.first_chunk::<4>());
    let length = |count: &[u8; 4]| (u32::from_le_bytes(*count) as usize).checked_mul(STL[1])?.checked_add(STL[0]);
    count.and_then(length) == Some(bytes.len())
}

fn of_text(bytes: &[u8]) -> Option<&'static str> {
    let start = &bytes[..bytes.len().min(1 << 16)];
    let text = String::from_utf8_lossy(start);
    if text.trim_start().starts_with('<') {
        return Some(if text.contains("<COLLADA") { "a COLLADA file" } else { "an XML file" });
    }
    // Columns 73 and 74 of an IGES file's first line.
    if start.get(72..74) == Some(b"S ") && start.iter().take(72).all(u8::is_ascii) {
        return Some("an IGES file");
    }
    let said = text.lines().take(LINES).map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    let mut words = said.map(|line| line.split_whitespace().next().unwrap_or_default()).peekable();
    (words.peek().is_some() && words.all(|word| OBJ.contains(&word) || word == "s" || word == "l"))
        .then_some("an OBJ file")
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{BEGINNINGS, ModelFault, ZIP, named, not_fetched, other};

    #[test]
    fn formats_are_told_by_their_bytes() {
        let mut stl = vec![b'x'; 84 + 50];
        stl[80..84].copy_from_slice(&1_u32.to_le_bytes());
        let iges = format!("{:72}S      1\n", "made by hand");
        for (bytes, name) in [
            (&b"solid cube\nfacet normal 0 0 1"[..], "STL"),
            (&stl, "STL"),
            (b"# by hand\nmtllib a.mtl\no cube\nv 0 0 0\nv 1 0 0\nf 1 2 3\n", "OBJ"),
            (b"ISO-10303-21;\nHEADER;", "STEP"),
            (iges.as_bytes(), "IGES"),
            (b"<?xml version=\"1.0\"?>\n<COLLADA xmlns", "COLLADA"),
            (b"Kaydara FBX Binary  \0", "FBX"),
            (b"ply\nformat ascii 1.0", "PLY"),
            (b"DBRep_DrawableShape\n\nCASCADE Topology V1", "BREP"),
            (b"**ABCDEFGHIJKLMNOPQRSTUVWXYZ****", "Parasolid"),
        ] {
            assert!(other(bytes).is_some_and(|told| told.contains(name)), "{name}: {:?}", other(bytes));
        }
        stl.push(0);
        for bytes in [&b"{\"asset\": {}}"[..], b"glTF\x02\0\0\0", b"", b"nonsense", &stl] {
            assert_eq!(other(bytes), None, "{:?}", String::from_utf8_lossy(bytes));
        }
    }

    #[test]
    fn what_stands_in_place_of_a_model_is_told() {
        let told = |bytes: &[u8]| not_fetched(bytes).unwrap_or_default();
        assert!(
            told(b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n").contains("git lfs pull")
        );
        assert!(told(b"\n<!DOCTYPE HTML>\n<html lang=\"en\">").contains("web page"));
        assert_eq!(not_fetched(b"<?xml version=\"1.0\"?>"), None);
    }

    #[test]
    fn formats_are_told_by_their_names_where_bytes_say_nothing() {
        let json = || ModelFault::Json(serde_json::from_str::<u8>("x").unwrap_err());
        let told = |fault: ModelFault, name: &str| named(fault, Path::new(name)).to_string();
        for (name, format) in [("a.STP", "STEP"), ("a.x_t", "Parasolid"), ("a.sldprt", "SolidWorks"), ("a.jt", "JT")] {
            let text = told(json(), name);
            assert!(text.contains(format) && text.contains("docs/cad.md"), "{text}");
        }
        assert!(told(ModelFault::Format(ZIP), "a.3mf").contains("a 3MF file"));
        assert!(told(ModelFault::Format(ZIP), "a.zip").contains("a zip archive"));
        // Bytes that are clear count more than a name, and a glTF file with an error has that error.
        assert!(told(ModelFault::Format("an OBJ file"), "a.stl").contains("an OBJ file"));
        assert!(
            told(json(), "a.gltf").contains("cannot be parsed") && told(ModelFault::Empty, "a.stl").contains("empty")
        );
        assert!(BEGINNINGS.iter().all(|(bytes, _)| other(bytes).is_some()));
    }
}
