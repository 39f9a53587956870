//! Fits of measurements that do not fit.

use super::craft::{ABOVE, orbiting, write_png};
use super::{CPU, FIT_NETWORK, network};
use crate::craft::Folder;
use crate::program::{end, isotherm, refusal, succeed};

#[test]
fn what_does_not_fit_is_refused_and_nothing_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("a file");
    write("network.toml", &network(120.0, 0.0085, 0.35, &[0.0, 1000.0]));
    let good = "time,sensor,temperature,sigma\n0,panel,285,0.5\n500,panel,290,0.5\n";
    let one = "[[parameter]]\nvary = \"capacitance\"\nnode = \"panel\"\npercent = 40\n";
    let head = "time,sensor,temperature,sigma\n";
    let cases = [
        (String::new(), one.to_owned(), "t.csv:1: time: is missing in the header"),
        (head.to_owned(), one.to_owned(), "t.csv:1: table: has no rows"),
        (format!("{head}0,panel,285,-1\n"), one.to_owned(), "t.csv:2: sigma: must be above 0 K"),
        (
            "time,sensor,temperature\n0,panel,285\n".to_owned(),
            one.to_owned(),
            "t.csv:2: sigma: is missing for sensor 'panel'",
        ),
        (format!("{head}0,panel,warm,1\n"), one.to_owned(), "t.csv:2: temperature: 'warm' is no number"),
        (
            "time,sensor,temperature,temperature_degC,sigma\n0,panel,285,100,1\n".to_owned(),
            one.to_owned(),
            "t.csv:1: temperature: stands beside temperature_degC",
        ),
        (format!("{head}0,panel,-4,1\n"), one.to_owned(), "must be above 0 K"),
        (format!("{good}1001,panel,285,1\n"), one.to_owned(), "t.csv:4: time: 1001 s lies outside the run"),
        (format!("{head}-1,panel,285,1\n"), one.to_owned(), "-1 s lies outside the run"),
        (format!("{head}2026-01-01,panel,285,1\n"), one.to_owned(), "needs time.start"),
        (format!("{good}0,pannel,285,1\n"), one.to_owned(), "no [[sensor]] says where 'pannel' is"),
        (good.to_owned(), format!("{one}[[sensor]]\nname = \"panel\"\nnode = \"panle\"\n"), "did you mean 'panel'?"),
        (
            good.to_owned(),
            format!("{one}[[sensor]]\nname = \"idle\"\nnode = \"panel\"\n"),
            "no measured row is of sensor 'idle'",
        ),
        (good.to_owned(), format!("{one}[[sensor]]\nname = \"panel\"\npart = \"panel\"\n"), "the model has no parts"),
        (good.to_owned(), format!("{one}[[sensor]]\nname = \"panel\"\n"), "needs one place"),
        (
            good.to_owned(),
            format!("{one}[[image]]\nfile = \"*.exr\"\nsigma = 1\n"),
            "has no meaning for a network file",
        ),
        (
            good.to_owned(),
            one.replace("panel", "panels"),
            "the network has no capacitance of 'panels'; did you mean 'panel'?",
        ),
        (
            good.to_owned(),
            one.replace("capacitance", "absorptivity").replace("node", "material"),
            "the network has no absorptivity",
        ),
        (good.to_owned(), format!("{one}prior_value = 100\n"), "prior_sigma: is missing"),
        (good.to_owned(), format!("{one}[fit]\nhold_out = [600, 700]\n"), "keeps 0 of 2 measured values out"),
        (good.to_owned(), format!("{one}[fit]\nhold_out = [0, 700]\n"), "keeps 2 of 2 measured values out"),
        (good.to_owned(), format!("{one}[fit]\nloss = \"hubber\"\n"), "fit.loss: 'hubber' is not one of"),
        // The structure is not measured, and its capacitance is not the panel's.
        (
            head.to_owned() + "0,panel,285,0.5\n",
            format!("{one}prior = \"none\"\n"),
            "the fit is singular: the data do not fix 'capacitance of panel'",
        ),
    ];
    for (table, parameters, why) in cases {
        write("t.csv", &table);
        write("p.toml", &parameters);
        let (code, line) = refusal(&end(isotherm(folder.path(), &[&["fit"], &FIT_NETWORK[..], &["out"]].concat())));
        assert!(code == Some(2) && line.contains(why), "{why}: {line}");
        assert!(!folder.path().join("out").exists(), "{why}");
    }
    write("t.csv", good);
    write("p.toml", one);
    let twice = ["fit", "network.toml", "--measured", "t.csv", "./t.csv", "--parameters", "p.toml", "-o", "out"];
    let (code, line) = refusal(&end(isotherm(folder.path(), &twice)));
    assert!(code == Some(2) && line.contains("t.csv: is given twice"), "{line}");
}

#[test]
fn images_that_do_not_fit_are_refused_and_nothing_is_written() {
    let folder = Folder::new(&orbiting([1.0; 6], ABOVE));
    folder.write("small.toml", &orbiting([1.0; 6], ABOVE).replace("width = 48", "width = 40"));
    succeed(folder.0.path(), &[&["run", "small.toml", "-o", "small"], &CPU[..]].concat());
    write_png(&folder.path("a.png"), vec![30000; 48 * 36]);
    write_png(&folder.path("dark.png"), vec![0; 48 * 36]);
    folder.write("b.exr", "no image");
    folder.write("t.csv", "time,sensor,temperature,sigma\n60,far,285,0.5\n");
    let one = "[[parameter]]\nvary = \"emissivity\"\nmaterial = \"skin\"\npercent = 60\n";
    let small = "small/frames/image_000000.exr";
    for (image, rule, why) in [
        (small, "file = \"*.exr\"\nsigma = 0.05", "is an image of 40 x 36 pixels, and the scene's camera has 48 x 36"),
        (small, "file = \"*.png\"\nsigma = 0.05", "no [[image]] has a pattern that fits its name"),
        ("a.png", "file = \"*.png\"\nsigma = 0.05", "does not say how many kelvins a count is"),
        ("a.png", "file = \"*.png\"\nsigma = 0.05\nscale = 0.01", "states no time"),
        ("a.png", "file = \"*.png\"\nsigma = 0.05\nscale = 0.01\ntime = 9e6", "lies outside the run"),
        ("a.png", "file = \"*.png\"\nscale = 0.01\ntime = 9", "image.sigma: is missing"),
        ("a.png", "file = \"*.png\"\nsigma = -1\nscale = 0.01\ntime = 9", "image.sigma: must be above 0"),
        (
            "a.png",
            "file = \"*.png\"\nsigma = 1\nscale = 0.01\ntime = 9\npose = [0, 0, 0, 2, 0, 0, 0]",
            "a quaternion of length 1",
        ),
        ("dark.png", "file = \"*.png\"\nsigma = 1\nscale = 0.01\ntime = 9", "no pixel counts"),
        ("b.exr", "file = \"*.exr\"\nsigma = 0.05", "is no frame of isotherm"),
        (
            "t.csv",
            "file = \"*.exr\"\nsigma = 0.05\n[[sensor]]\nname = \"far\"\nposition = [50, 50, 0]",
            "sensor.position: lies off the craft",
        ),
    ] {
        folder.write("p.toml", &format!("{one}[[image]]\n{rule}\n"));
        let arguments =
            ["fit", "scene.toml", "--measured", image, "--parameters", "p.toml", "-o", "out", "--device", "cpu"];
        let (code, line) = refusal(&end(isotherm(folder.0.path(), &arguments)));
        assert!(code == Some(2) && line.contains(why), "{why}: {line}");
        assert!(!folder.path("out").exists(), "{why}");
    }
}
