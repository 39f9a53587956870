//! Networks on the device against their f64 twin: stiff sheets with slivers, and steps too small for plain f32.

use isotherm::internals::{LinearConductor, Network, NetworkStepper, NodeKind, ReferenceStepper, StepMethod, Stepper};

use super::device::{cube, run, worst};
use crate::device::context;

/// A sheet of aluminium, 1 mm thick, with square cells of 1 cm, that radiates on one side (2700 kg/m3, 896 J/kg/K, 167
/// W/m/K: ECSS-E-HB-31-01 Part 5A). `slivers` replaces every 13th column by a sliver of 0.2 mm.
fn sheet(side: usize, slivers: bool) -> Network {
    let thin = |x: usize| slivers && x % 13 == 6;
    let width = |x: usize| if thin(x) { 0.02 } else { 1.0 };
    let at = |x: usize, y: usize| (y * side + x) as u32;
    let mut network = Network { space_temperature: 2.7, ..Network::default() };
    for y in 0..side {
        for x in 0..side {
            let share = width(x);
            network.kinds.push(NodeKind::Diffusive);
            network.capacitances.push(2700.0 * 896.0 * 1e-3 * 1e-4 * share);
            network.emissive_areas.push(0.8e-4 * share);
            network.temperatures.push(290.0 + 5.0 * ((7 * x + 3 * y) as f64 * 0.1).sin());
            let mut join = |there, conductance| {
                network.linear.push(LinearConductor { nodes: [at(x, y), there], conductance });
            };
            if x + 1 < side {
                join(at(x + 1, y), 0.167 * 2.0 / (share + width(x + 1)));
            }
            if y + 1 < side {
                join(at(x, y + 1), 0.167 * share);
            }
        }
    }
    network
}

/// Sheets of 1296 nodes. Stiff ones need hundreds of stages of RKL2 or one step of TR-BDF2.
#[test]
#[ignore = "long: tools/test --all"]
fn stiff_sheets_agree_with_the_twin() {
    let context = context();
    for slivers in [false, true] {
        let network = sheet(36, slivers);
        let mut device = NetworkStepper::new(&context, &network, &[]).expect("a network for the device");
        let mut twin = ReferenceStepper::new(network.clone(), &[]);
        let (tried, found) = run(&mut device, &network, StepMethod::TrBdf2, 2.0);
        let (expected_try, expected) = run(&mut twin, &network, StepMethod::TrBdf2, 2.0);
        worst(&found, &expected).within(3e-4, "K", &format!("slivers: {slivers}"));
        assert!((tried.error - expected_try.error).abs() <= 1e-2 * expected_try.error + 1e-4, "{slivers}");
        // A conductance that is off by 1 % is detected.
        let mut other = network.clone();
        other.linear.iter_mut().step_by(3).for_each(|conductor| conductor.conductance *= 1.01);
        let mut device = NetworkStepper::new(&context, &other, &[]).expect("a network for the device");
        let (_, found) = run(&mut device, &other, StepMethod::TrBdf2, 2.0);
        assert!(worst(&found, &expected).difference > 3e-4);
    }
}

/// 1e-5 K a step, a third of what a float at 284 K resolves, is not lost: every method.
#[test]
fn tiny_steps_of_every_method_do_not_stagnate() {
    let context = context();
    let network = Network { emissive_areas: vec![0.0; 6], ..cube(3.0) };
    let power: Vec<f64> = network.capacitances.iter().map(|capacitance| 1e-4 * capacitance).collect();
    for (method, count) in [(StepMethod::Euler, 2000), (StepMethod::Rkl2 { stages: 3 }, 500), (StepMethod::TrBdf2, 100)]
    {
        let mut device = NetworkStepper::new(&context, &network, &[]).expect("a network for the device");
        device.set_heat(&power, &[0.0; 6]).expect("heat");
        for _ in 0..count / 20 {
            device.attempt(method, 0.0, 0.1, 20).expect("an attempt");
            device.keep().expect("kept");
        }
        let expected: Vec<f64> = network.temperatures.iter().map(|start| start + 1e-5 * f64::from(count)).collect();
        let allowed = 1e-3 * 1e-5 * f64::from(count);
        worst(&device.temperatures().expect("found"), &expected).within(allowed, "K", &format!("{method}"));
    }
}
