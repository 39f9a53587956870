//! `attitude.mode = "tumble"`: mean loads against the mean over directions, and temperatures of a convex craft against the closed form.

use glam::{DQuat, DVec3};
use isotherm::internals::{
    Attitude, CircularOrbit, Environment, STEFAN_BOLTZMANN, StepLoads, albedo_flux, planet_ir_flux, solar_flux,
};

use super::craft::{Folder, glb_of_box, scene_with};
use super::mesh_network::{SKIN, TRANSITION};
use super::program::{end, isotherm, refusal, succeed};

/// A lit planet, or the Sun alone. The means over 20,000 normals of a fixed craft are those of a craft that tumbles.
#[test]
fn the_load_is_the_mean_over_all_directions() {
    let orbit = CircularOrbit { altitude: 500e3, period: 5676.0, beta: 0.4, phase: 0.0 };
    let fixed = Attitude::Inertial { inertial_from_body: DQuat::IDENTITY };
    let environment = Environment {
        solar_constant: Some(1361.0),
        albedo: Some(0.3),
        planet_ir: Some(237.0),
        planet_radius: 6.371e6,
        eclipse: true,
        background_temperature: Some(2.7),
    };
    let [fixed, tumbling] =
        [fixed, Attitude::Tumble].map(|attitude| StepLoads::new(&orbit, &attitude, &environment).expect("an orbit"));
    const COUNT: u32 = 20_000;
    let normal = |i: u32| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(COUNT);
        let turn = f64::from(i) * std::f64::consts::PI * (3.0 - 5f64.sqrt());
        let across = (1.0 - z * z).sqrt();
        DVec3::new(across * turn.cos(), across * turn.sin(), z)
    };
    for time in [0.0, 1200.0, 1380.0, 2838.0] {
        let (load, mean) = (fixed.step_load(time, time + 60.0), tumbling.step_load(time, time + 60.0));
        let over = |of: &dyn Fn(DVec3) -> f64| (0..COUNT).map(|i| of(normal(i))).sum::<f64>() / f64::from(COUNT);
        let light = over(&|normal| solar_flux(&load, normal) + albedo_flux(&load, normal));
        let infrared = over(&|normal| planet_ir_flux(&load, normal));
        for normal in [DVec3::X, DVec3::new(0.6, 0.0, -0.8)] {
            let [of_light, of_planet] =
                [solar_flux(&mean, normal) + albedo_flux(&mean, normal), planet_ir_flux(&mean, normal)];
            assert!((of_light - light).abs() < 0.05, "{time} s: {of_light} for {light} W/m2");
            assert!((of_planet - infrared).abs() < 0.01, "{time} s: {of_planet} for {infrared} W/m2");
        }
        assert!(light == 0.0 || (solar_flux(&load, DVec3::X) - light).abs() > 1.0, "one direction must not pass");
    }
}

/// A box of area A shows A/4 to every direction: alpha S/4 + eps M (1 - cos rho)/2 = eps sigma (T^4 - T_space^4) on all its faces, as on a sphere.
#[test]
fn a_convex_craft_is_as_warm_as_a_sphere() {
    let ratio: f64 = 6371.0 / (6371.0 + 408.0);
    let planet = 237.0 * 0.5 * (1.0 - (1.0 - ratio * ratio).sqrt());
    let known = |area: f64| ((0.29 * 1361.0 * area / 0.83 + planet) / STEFAN_BOLTZMANN + 2.7f64.powi(4)).powf(0.25);
    let plate = "response = \"radiative\"\nheat_capacity_per_area = 900\n";
    for (response, device) in
        [("response = \"instant\"\n", "cpu"), ("response = \"instant\"\n", ""), (plate, ""), (SKIN, "")]
    {
        let periodic = "draw_every = 4\nwarm_up = \"periodic\"\nwarm_up_tolerance = 0.001\nwarm_up_orbits = 40";
        let text = scene_with(&[
            ("mode = \"nadir\"\nnadir_axis = \"+Z\"\nforward_axis = \"+X\"", "mode = \"tumble\""),
            ("albedo = 0.3\n", ""),
            ("eclipse = true", "eclipse = false"),
            ("draw_every = 4", periodic),
            (TRANSITION, response),
        ]);
        let text: String = text.split("[[material]]\nmatch = \"cells\"").next().expect("a half").to_owned()
            + "[radiance]"
            + text.split("[radiance]").nth(1).expect("the rest").split("[[probe]]").next().expect("no probe");
        let folder = Folder::new(&text);
        glb_of_box().save(folder.0.path());
        let device: &[&str] = if device.is_empty() { &[] } else { &["--device", device] };
        succeed(folder.0.path(), &[&["run", "scene.toml", "-o", "out"], device].concat());
        let mut reader = csv::Reader::from_path(folder.path("out/series.csv")).expect("a series");
        let heads = reader.headers().expect("heads").clone();
        let column = |name: &str| heads.iter().position(|head| head == name).expect("a column");
        let [low, high] = [column("all:min"), column("all:max")];
        for row in reader.records().map(|row| row.expect("a row")) {
            for cell in [&row[low], &row[high]] {
                let temperature: f64 = cell.parse().expect("a number");
                assert!((temperature - known(0.25)).abs() < 0.02, "{response}: {temperature} K for {} K", known(0.25));
            }
        }
        assert!(known(0.26) - known(0.25) > 1.0, "a hundredth of the area more must show");
    }
}

#[test]
fn what_needs_directions_is_refused() {
    for (more, why) in [
        ("[shadows]\n", "shadows: needs the direction of the light"),
        ("[output]\nbudget = true\n", "output: error and budget need"),
    ] {
        let axes = "mode = \"nadir\"\nnadir_axis = \"+Z\"\nforward_axis = \"+X\"";
        let folder = Folder::new(&(scene_with(&[(axes, "mode = \"tumble\"")]) + more));
        let arguments = ["run", "scene.toml", "-o", "out", "--device", "cpu"];
        let (code, line) = refusal(&end(isotherm(folder.0.path(), &arguments)));
        assert!(code == Some(2) && line.contains(why), "{line}");
    }
}
