//! The planes of an image, which a scene or a page asks for, are those of the façade, also after time went back.

use isotherm::internals::{CHANNELS, read_exr};
use isotherm::{Image, Pose, Target};
use serde_json::{Value, json};

use super::client::{Page, Server, expected, images};
use crate::craft::{Folder, SCENE, scene_with};
use crate::mesh_network::{CELLS, SKIN, TRANSITION};
use crate::program::succeed;

/// The page has the errors of the temperatures where the scene asks, also after time went back.
#[test]
fn errors_are_those_of_the_facade() {
    let scene = scene_with(&[("draw_every = 4", "draw_every = 4\nwarm_up_orbits = 0.1")]);
    let folder = Folder::new(&format!("{scene}\n[shadows]\n[output]\nerror = true\n"));
    let server = Server::new(&folder, &Target::Reference);
    let mut page = Page::open(server.address);
    assert_eq!(page.hello["error"], true);
    let own = images(&folder, &Target::Reference, &[3, 9], &Pose::OfCamera);
    let largest = own.iter().flat_map(|image| &image.error).copied().fold(0.0, f32::max);
    assert!(largest > 0.01, "{largest} K");
    for step in [9, 3, 9] {
        let image = page.seek(step);
        let differs = |own: &Image| {
            let pairs = image.plane("error").iter().zip(&own.error);
            pairs.map(|(a, b)| (*a as f32 - b).abs()).fold(0.0, f32::max)
        };
        // Half a number, whose value is 0.1 mK or more with the largest error.
        let half = 1e-4f32.max(largest / f32::from(u16::MAX));
        let [early, late] = [differs(&own[0]), differs(&own[1])];
        let [right, other] = if step == 3 { [early, late] } else { [late, early] };
        assert!(right <= half && other > 10.0 * half, "step {step}: {right} and {other} K");
    }
    server.end();
    let server = Server::new(&Folder::new(SCENE), &Target::Reference);
    let mut page = Page::open(server.address);
    assert_eq!(page.hello["error"], false);
    assert!(page.image().planes.iter().all(|(name, _)| name != "error"));
    server.end();
}

/// The page has the budgets of the pixels where the scene asks, also after time went back.
#[test]
fn budgets_are_those_of_the_facade() {
    let scene = scene_with(&[("draw_every = 4", "draw_every = 4\nwarm_up_orbits = 0.1")]);
    let folder = Folder::new(&format!("{scene}\n[shadows]\n[output]\nbudget = true\n"));
    let server = Server::new(&folder, &Target::Reference);
    let mut page = Page::open(server.address);
    assert_eq!(page.hello["causes"].as_array().map(Vec::len), Some(8));
    let own = images(&folder, &Target::Reference, &[3, 9], &Pose::OfCamera);
    for step in [9, 3, 9] {
        let image = page.seek(step);
        let differs = |own: &Image, cause: usize| {
            let pairs = image.plane(CHANNELS[cause]).iter().zip(&own.budget);
            pairs.map(|(a, b)| (*a as f32 - b[cause]).abs()).fold(0.0, f32::max)
        };
        for (cause, name) in CHANNELS.into_iter().enumerate() {
            let (right, other) = if step == 3 { (&own[0], &own[1]) } else { (&own[1], &own[0]) };
            assert!(differs(right, cause) <= 0.05, "{name} at step {step}: {}", differs(right, cause));
            assert!(cause != 7 || differs(other, cause) > 1.0, "another step emits otherwise");
        }
    }
    server.end();
    let server = Server::new(&Folder::new(SCENE), &Target::Reference);
    let mut page = Page::open(server.address);
    assert_eq!(page.hello["causes"].as_array().map(Vec::len), Some(0));
    assert!(page.image().planes.iter().all(|(name, _)| name != "Q_sun"));
    server.end();
}

/// The page has the uncertainty of the pixels once it asks, and `isotherm render` finds the same by images instead of nodes.
#[test]
fn the_uncertainty_is_that_of_render() {
    let one = |name: &str| {
        format!(
            "[[uncertainty.parameter]]\nname = \"{name}\"\nvary = \"emissivity\"\nmaterial = \"{name}\"\npercent = 5\n"
        )
    };
    let asks = format!("[uncertainty]\n{}{}", one("skin"), one("cells"));
    let cells = (CELLS, "response = \"radiative\"\nheat_capacity_per_area = 1500\n");
    let folder = Folder::new(&format!("{}{asks}", scene_with(&[(TRANSITION, SKIN), cells])));
    let drawn = [3, 9].map(|step: u32| {
        let time = (60 * step).to_string();
        succeed(folder.0.path(), &["render", "scene.toml", "--time", &time, "-o", "a.exr", "--device", "cpu"]);
        read_exr(&folder.path("a.exr")).expect("an image").0
    });
    let server = Server::new(&folder, &Target::Reference);
    let mut page = Page::open(server.address);
    assert_eq!(page.hello["uncertainty"], true);
    assert!(page.image().planes.iter().all(|(name, _)| name != "sigma"));
    page.ask(&json!({ "do": "sigma" }));
    page.ask(&json!({ "do": "sigma" }));
    assert!(page.text("problem")["message"].as_str().is_some_and(|text| text.contains("under way")));
    let causes = loop {
        let told = page.text("sigma");
        assert_eq!(told["failed"], Value::Null);
        if told["causes"] != Value::Null {
            break told["causes"].clone();
        }
    };
    assert_eq!([&causes[0]["name"], &causes[1]["name"]], ["skin", "cells"]);
    for step in [9, 3, 9] {
        page.ask(&json!({ "do": "seek", "time": 60.0 * step as f64 }));
        let image = page.image_where(|image| image.step() == step && image.planes.len() > 3);
        let differs = |own: &Image| {
            let pairs = image.plane("sigma").iter().zip(&own.sigma.temperature);
            pairs.map(|(a, b)| (*a as f32 - b).abs()).fold(0.0, f32::max)
        };
        let (right, other) = if step == 3 { (&drawn[0], &drawn[1]) } else { (&drawn[1], &drawn[0]) };
        assert!(differs(right) < 1e-3 && differs(other) > 5e-3, "{} and {} K", differs(right), differs(other));
        let craft = right.part.iter().filter(|part| **part != 0).count();
        let causes = image.plane("cause").iter().zip(&right.sigma.cause).zip(&right.part);
        let alike = causes.filter(|((a, b), part)| **part != 0 && **a as u32 == **b).count();
        assert!(alike as f64 > 0.99 * craft as f64, "{alike} of {craft}");
        assert!([1, 2].iter().all(|cause| right.sigma.cause.contains(cause)), "both causes are shown");
    }
    assert!(Page::open(server.address).text("sigma")["causes"].is_array(), "a page that comes later is told");
    server.end();
    let server = Server::new(&Folder::new(SCENE), &Target::Reference);
    let mut page = Page::open(server.address);
    assert_eq!(page.hello["uncertainty"], false);
    page.ask(&json!({ "do": "sigma" }));
    assert_eq!(page.text("problem")["message"], "the scene has no [uncertainty]");
    server.end();
}

/// The first image of a sensor is that of the façade, digital number by digital number.
#[test]
fn digital_numbers_are_those_of_the_sensor() {
    let folder = Folder::new(&format!("{SCENE}\n[sensor]\nnetd = 0.05\nrange = [150, 400]\n"));
    let server = Server::new(&folder, &Target::Reference);
    let mut page = Page::open(server.address);
    page.ask(&json!({ "do": "show", "quantity": "counts" }));
    let image = page.image_where(|image| image.planes.len() == 4);
    let own = expected(&folder, &Target::Reference, 0, &Pose::OfCamera).digital_numbers.expect("a sensor");
    let found: Vec<u16> = image.plane("counts").iter().map(|value| *value as u16).collect();
    let off = found.iter().zip(&own).map(|(a, b)| a.abs_diff(*b)).max().expect("pixels");
    let span = own.iter().max().unwrap() - own.iter().min().unwrap();
    assert!(off <= span / 100, "{off} of {span}");
    server.end();
}
