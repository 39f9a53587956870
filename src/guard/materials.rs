//! The values of materials: thickness, density, balance temperature, and the time constant beside the step.

use std::collections::BTreeMap;

use super::finding::{Finding, named, short};
use super::shapes::PartShape;
use crate::model::nodes::GROUP;
use crate::simulation::prepare::Prepared;
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::balance::{balance_temperature, emissivity_sum};
use crate::thermal::material::{InnerStructure, Material, Response, Sides};

/// Temperature at which time constants are stated [K].
pub(crate) const AT: f64 = 300.0;
/// Thickness of a shell as a share of its part, above which it is no shell.
const THICK: f64 = 0.1;
/// Density below which it is probably in g/cm3 [kg/m3].
const LIGHT: f64 = 20.0;
/// Balance temperature that few surfaces stand [K].
const HOT: f64 = 500.0;

#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub(crate) struct MaterialFacts {
    pub(crate) name: String,
    pub(crate) response: &'static str,
    pub(crate) area_m2: f64,
    /// Balance temperature in full sunlight from straight ahead, without conduction [K].
    pub(crate) hottest_k: f64,
    /// Heat capacity per area [J/(m2 K)]. `None` where the response needs none, or a transition moves it.
    pub(crate) capacity: Option<f64>,
    /// Time constant: heat capacity over radiative conductance at 300 K, or the `t_max` of its transition [s].
    pub(crate) time_constant_s: Option<f64>,
    pub(crate) time_constant_steps: Option<f64>,
    /// Length over which conduction evens temperatures out: sqrt(k d / 4 eps sigma T^3) at 300 K [m].
    pub(crate) conduction_length_m: Option<f64>,
}

/// Conductance per area by radiation at 300 K [W/(m2 K)].
fn radiative_conductance(material: &Material) -> f64 {
    4.0 * emissivity_sum(material) * STEFAN_BOLTZMANN * AT.powi(3)
}

pub(super) fn facts(prepared: &Prepared) -> Vec<MaterialFacts> {
    let mut areas = vec![0.0; prepared.materials.len()];
    for (slot, area) in prepared.nodes.areas.iter().enumerate() {
        areas[prepared.nodes.group_material[slot / GROUP] as usize] += area;
    }
    let step = prepared.scene.time.step;
    let environment = &prepared.scene.environment;
    let fact = |(material, area): (&Material, f64)| {
        let sun = environment.solar_constant.unwrap_or(0.0);
        let back = match material.sides {
            Sides::Outside => 0.0,
            Sides::Both { back } => back.absorptivity,
        };
        let absorbed = material.front.absorptivity.max(back) * sun;
        let space = environment.background_temperature.unwrap_or(0.0);
        let conductance = radiative_conductance(material);
        let bulk = &material.bulk;
        let stored = matches!(material.response, Response::Network | Response::Radiative(_));
        let capacity = bulk.capacity_per_area().ok().filter(|_| stored);
        let time_constant = match &material.response {
            Response::Instant | Response::Given => None,
            Response::Transition(transition) => {
                Some(step * transition.heating.t_max_steps.min(transition.cooling.t_max_steps))
            }
            Response::Network | Response::Radiative(_) => capacity.map(|capacity| capacity / conductance),
        };
        let sheet = |(conductivity, thickness): (f64, f64)| (conductivity * thickness / conductance).sqrt();
        let conducts = matches!(material.response, Response::Network);
        MaterialFacts {
            name: material.name.clone(),
            response: material.response.name(),
            area_m2: area,
            hottest_k: balance_temperature(absorbed, emissivity_sum(material), space),
            capacity,
            time_constant_s: time_constant,
            time_constant_steps: time_constant.map(|seconds| seconds / step),
            conduction_length_m: bulk.conductivity.filter(|_| conducts).zip(bulk.thickness).map(sheet),
        }
    };
    prepared.materials.iter().zip(areas).map(fact).collect()
}

/// Materials with the same fault, and the smallest and largest number that it is about.
#[derive(Debug, Default)]
struct Same<'a> {
    names: Vec<&'a str>,
    least: f64,
    most: f64,
}

impl<'a> Same<'a> {
    fn add(&mut self, name: &'a str, number: f64) {
        (self.least, self.most) = match self.names.is_empty() {
            true => (number, number),
            false => (self.least.min(number), self.most.max(number)),
        };
        self.names.push(name);
    }

    /// The numbers, as one or as a range.
    fn numbers(&self) -> String {
        if self.least == self.most {
            short(self.least)
        } else {
            format!("{} to {}", short(self.least), short(self.most))
        }
    }

    /// The finding, where any material is named.
    fn finding(self, check: &'static str, message: &str, remedy: &str) -> Option<Finding> {
        let about = named("material", &self.names);
        let message = message.replace("{}", &self.numbers());
        (!self.names.is_empty()).then(|| Finding { check, about, message, remedy: remedy.to_owned() })
    }
}

/// The values of a key of a material that stores heat, and of the structure below it.
fn of_layers(
    material: &Material,
    value: fn(&Material) -> Option<f64>,
    below: fn(&InnerStructure) -> f64,
) -> [(&'static str, Option<f64>); 2] {
    let stores = matches!(material.response, Response::Network | Response::Radiative(_));
    let over = material.bulk.over.as_ref().filter(|_| stores);
    [("", value(material).filter(|_| stores)), ("over.", over.map(below))]
}

pub(super) fn check(prepared: &Prepared, shapes: &[PartShape], facts: &[MaterialFacts]) -> Vec<Finding> {
    let mut findings = thicknesses(prepared, shapes);
    let used = || prepared.materials.iter().zip(facts).filter(|(_, fact)| fact.area_m2 > 0.0);
    let mut light = [Same::default(), Same::default()];
    let [mut hot, mut quick] = [Same::default(), Same::default()];
    for (material, fact) in used() {
        let stated =
            |material: &Material| material.bulk.density.filter(|_| material.bulk.heat_capacity_per_area.is_none());
        let densities = of_layers(material, stated, |over| over.density).map(|(_, density)| density);
        let is_light = |density: &f64| *density > 0.0 && *density < LIGHT;
        for (same, density) in light.iter_mut().zip(densities) {
            density.filter(is_light).into_iter().for_each(|density| same.add(&material.name, density));
        }
        if fact.hottest_k > HOT {
            hot.add(&material.name, fact.hottest_k);
        }
        // A density in the wrong unit explains a short time constant.
        let explained = densities.iter().flatten().any(is_light);
        if let Some((seconds, steps)) = fact.time_constant_s.zip(fact.time_constant_steps)
            && seconds > 0.0
            && steps < 1.0
            && !explained
        {
            quick.add(&material.name, seconds);
        }
    }
    let unit = "density is in kg/m3: multiply a value in g/cm3 by 1000";
    let [above, below] = light;
    findings.extend(above.finding("density", "density = {} kg/m3 is less than that of foam", unit));
    findings.extend(below.finding("density", "over.density = {} kg/m3 is less than that of foam", unit));
    findings.extend(hot.finding(
        "balance",
        "the balance temperature in full sunlight is {} K",
        "check absorptivity and emissivity; a second face (sides = \"both\") or a structure below (over) would cool it",
    ));
    let step = prepared.scene.time.step;
    findings.extend(quick.finding(
        "step",
        &format!("the time constant of {{}} s is shorter than time.step = {step} s"),
        "state a shorter time.step, or response = \"instant\"; if the value surprises, check thickness, density and specific_heat",
    ));
    findings
}

/// Finds shells that are thick beside their parts. Materials with the same thickness share a finding.
fn thicknesses(prepared: &Prepared, shapes: &[PartShape]) -> Vec<Finding> {
    let mut thick: BTreeMap<(&str, u64), (Vec<&str>, &PartShape)> = BTreeMap::new();
    for (number, material) in (0u32..).zip(&prepared.materials) {
        let layers = of_layers(material, |material| material.bulk.thickness, |over| over.thickness);
        for (layer, thickness) in layers.into_iter().filter_map(|(layer, thickness)| Some((layer, thickness?))) {
            let is_thick = |shape: &&PartShape| {
                shape.materials.contains_key(&number) && thickness > THICK * shape.extent().min(shape.area.sqrt())
            };
            let smallest = shapes.iter().filter(is_thick).min_by(|a, b| a.extent().total_cmp(&b.extent()));
            let Some(smallest) = smallest else { continue };
            let (names, shape) = thick.entry((layer, thickness.to_bits())).or_insert((Vec::new(), smallest));
            names.push(&material.name);
            if smallest.extent() < shape.extent() {
                *shape = smallest;
            }
        }
    }
    let finding = |((layer, bits), (names, shape)): ((&str, u64), (Vec<&str>, &PartShape))| Finding {
        check: "thickness",
        about: named("material", &names),
        message: format!(
            "{layer}thickness = {} m is over a tenth of the part '{}', which measures {} m",
            f64::from_bits(bits),
            prepared.parts[shape.part as usize],
            short(shape.extent())
        ),
        remedy: "thickness is that of the sheet or wall in metres: state 0.002 for 2 mm".to_owned(),
    };
    thick.into_iter().map(finding).collect()
}
