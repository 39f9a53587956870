//! Partial sets of thermal values, and how they combine into complete ones.

use std::path::PathBuf;

use crate::thermal::emissivity::BandEmissivity;
use crate::thermal::material::{
    Bulk, Domain, Gloss, InnerStructure, NoPlate, Optics, Radiative, Response, Retarget, Sides, Transition,
};

use super::emissivity;
use super::error::SceneError;
use super::keys;
use super::profile::{self, StatedProfile};
use super::quantity::Quantity;
use super::value_source::ValueSource;

pub(super) const SHARE: Quantity = Quantity::within(0.0, 1.0, "");

/// Smallest emissivity. Below it the balance temperature exceeds f32. No real surface comes near.
const LEAST_EMISSIVITY: f64 = 1e-6;

/// Which sides exchange heat, without the optics of the back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum SidesKind {
    Outside,
    Both,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ResponseKind {
    Instant,
    Transition,
    Radiative,
    Network,
}

const RESPONSES: [(&str, ResponseKind); 4] = [
    ("instant", ResponseKind::Instant),
    ("transition", ResponseKind::Transition),
    ("radiative", ResponseKind::Radiative),
    ("network", ResponseKind::Network),
];

fn structure(over: &impl ValueSource) -> Result<InnerStructure, SceneError> {
    let value =
        |key: &str, quantity: Quantity, what: &str| over.number(key, quantity)?.ok_or_else(|| over.missing(key, what));
    Ok(InnerStructure {
        effective_emittance: value("effective_emittance", SHARE, "the effective emittance towards the structure")?,
        thickness: value("thickness", Quantity::positive("m"), "the thickness of the structure [m]")?,
        density: value("density", Quantity::non_negative("kg/m3"), "the density of the structure [kg/m3]")?,
        specific_heat: value("specific_heat", Quantity::non_negative("J/(kg K)"), "that of the structure [J/(kg K)]")?,
        conductivity: value("conductivity", Quantity::non_negative("W/(m K)"), "that of the structure [W/(m K)]")?,
    })
}

/// Reads `normal_seed`, a whole number.
fn seed(source: &impl ValueSource) -> Result<Option<f64>, SceneError> {
    let seed = source.number("normal_seed", Quantity::within(0.0, f64::from(u32::MAX), ""))?;
    match seed {
        Some(seed) if seed.fract() != 0.0 => {
            Err(source.error("normal_seed", format!("must be a whole number, found {seed}")))
        }
        seed => Ok(seed),
    }
}

#[derive(Debug, Clone, Default, PartialEq)]
struct PartialOptics {
    absorptivity: Option<f64>,
    emissivity: Option<f64>,
    specular: Option<f64>,
    roughness: Option<f64>,
    slope_variance: Option<f64>,
    drawn: Option<bool>,
    seed: Option<f64>,
    in_band: BandEmissivity,
    /// Ranges of absorptivity and emissivity.
    ranges: [Option<[f64; 2]>; 2],
}

impl PartialOptics {
    fn read(source: &impl ValueSource) -> Result<Self, SceneError> {
        Ok(Self {
            absorptivity: source.number("absorptivity", SHARE)?,
            emissivity: source.number("emissivity", SHARE)?,
            specular: source.number("specular", SHARE)?,
            roughness: source.number("roughness", SHARE)?,
            slope_variance: source.number("normal_slope_variance", SHARE)?,
            drawn: source.choice("normal_slope", &[("averaged", false), ("drawn", true)])?,
            seed: seed(source)?,
            in_band: emissivity::read(source)?,
            ranges: [range(source, "absorptivity")?, range(source, "emissivity")?],
        })
    }

    fn stated(&self) -> StatedOptics {
        StatedOptics { absorptivity: self.absorptivity, emissivity: self.emissivity }
    }

    fn or(self, fallback: &Self) -> Self {
        let in_band = &fallback.in_band;
        // A range belongs to the value beside it.
        let range = |at: usize, stated: Option<f64>| {
            self.ranges[at].or_else(|| fallback.ranges[at].filter(|_| stated.is_none()))
        };
        Self {
            ranges: [range(0, self.absorptivity), range(1, self.emissivity)],
            absorptivity: self.absorptivity.or(fallback.absorptivity),
            emissivity: self.emissivity.or(fallback.emissivity),
            specular: self.specular.or(fallback.specular),
            roughness: self.roughness.or(fallback.roughness),
            slope_variance: self.slope_variance.or(fallback.slope_variance),
            drawn: self.drawn.or(fallback.drawn),
            seed: self.seed.or(fallback.seed),
            in_band: BandEmissivity {
                by_angle: self.in_band.by_angle.or_else(|| in_band.by_angle.clone()),
                by_wavelength: self.in_band.by_wavelength.or_else(|| in_band.by_wavelength.clone()),
            },
        }
    }

    /// How the face reflects. The error is a key that lacks another one, and why.
    fn gloss(&self) -> Result<Gloss, (&'static str, &'static str)> {
        let specular = self.specular.unwrap_or(0.0);
        for (key, stated) in [("roughness", self.roughness), ("normal_slope_variance", self.slope_variance)] {
            if specular == 0.0 && stated.is_some() {
                return Err((key, "spreads the light of a mirror, and there is none: state 'specular' above 0 too"));
            }
        }
        let drawn = self.drawn.unwrap_or_default();
        if drawn && self.slope_variance.is_none() {
            return Err(("normal_slope", "draws slopes of a variance: state 'normal_slope_variance' too"));
        }
        if self.seed.is_some() && !drawn {
            return Err(("normal_seed", "is that of slopes that are drawn: state normal_slope = 'drawn' too"));
        }
        let [roughness, variance] = [self.roughness, self.slope_variance].map(Option::unwrap_or_default);
        let (slope_variance, drawn_variance) = if drawn { (0.0, variance) } else { (variance, 0.0) };
        let seed = self.seed.unwrap_or_default() as u32;
        Ok(Gloss { specular, roughness, slope_variance, drawn_variance, seed })
    }
}

/// The range of a value: as stated, or from the beginning of life to its end.
fn range(source: &impl ValueSource, value: &str) -> Result<Option<[f64; 2]>, SceneError> {
    let key = format!("{value}_range");
    let stated = source.list(&key)?;
    let (Some(first), aged) = (source.number(value, SHARE)?, source.number(&format!("{value}_eol"), SHARE)?) else {
        return match stated {
            Some(_) => Err(source.clash(&key, &[value], format!("is the range of a value: state '{value}' too"))),
            None => Ok(None),
        };
    };
    let Some(ends) = stated else {
        return Ok(aged.filter(|aged| *aged != first).map(|aged| [first.min(aged), first.max(aged)]));
    };
    match ends[..] {
        [low, high] if 0.0 <= low && low <= first && first <= high && high <= 1.0 && low < high => {
            Ok(Some([low, high]))
        }
        _ => Err(source.clash(
            &key,
            &[value],
            format!("must be two rising numbers from 0 to 1, about '{value}' = {first}"),
        )),
    }
}

/// The optics that one place states for a face.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct StatedOptics {
    pub(crate) absorptivity: Option<f64>,
    pub(crate) emissivity: Option<f64>,
}

/// The values that one place states: a rule, a table entry or glTF extras.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Values {
    front: PartialOptics,
    back: Option<PartialOptics>,
    sides: Option<SidesKind>,
    bulk: Bulk,
    response: Option<ResponseKind>,
    heating: Option<StatedProfile>,
    cooling: Option<StatedProfile>,
    retarget: Option<Retarget>,
    domain: Option<Domain>,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Complete {
    pub(super) front: Optics,
    pub(super) ranges: [Option<[f64; 2]>; 2],
    pub(super) sides: Sides,
    pub(super) gloss: [Gloss; 2],
    pub(super) in_band: [BandEmissivity; 2],
    pub(super) bulk: Bulk,
    pub(super) response: Response,
    pub(super) files: Vec<PathBuf>,
    /// The transition if both profiles are stated. The response may be another one.
    pub(super) transition: Option<Transition>,
    /// Whether the outside was assumed, because no place states the sides.
    pub(super) sides_assumed: bool,
    /// Whether merge was assumed for a target that moves.
    pub(super) retarget_assumed: bool,
    /// Whether temperature was assumed as the domain of a transition.
    pub(super) domain_assumed: bool,
}

/// A value that is missing or contradicts others.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Incomplete {
    /// Key of the material. For the optics of the back it is `back`.
    pub(super) key: &'static str,
    pub(super) message: String,
}

impl Incomplete {
    fn new(key: &'static str, message: impl Into<String>) -> Self {
        Self { key, message: message.into() }
    }
}

impl Values {
    /// Takes the instant response where none is stated.
    pub(super) fn assume_instant(&mut self) {
        self.response.get_or_insert(ResponseKind::Instant);
    }

    /// Reads the values of `source`. `step` [s] turns a `t_max` in seconds into steps.
    pub(super) fn read(source: &impl ValueSource, step: f64) -> Result<Self, SceneError> {
        let positive = |key: &str, unit| source.number(key, Quantity::positive(unit));
        Ok(Self {
            front: PartialOptics::read(source)?,
            back: source.group("back", keys::BACK)?.map(|back| PartialOptics::read(&back)).transpose()?,
            sides: source.choice("sides", &[("outside", SidesKind::Outside), ("both", SidesKind::Both)])?,
            bulk: Bulk {
                thickness: positive("thickness", "m")?,
                // The paper gives no density and no specific heat for multi-layer insulation, so 0 is valid.
                density: source.number("density", Quantity::non_negative("kg/m3"))?,
                specific_heat: source.number("specific_heat", Quantity::non_negative("J/(kg K)"))?,
                heat_capacity_per_area: source.number("heat_capacity_per_area", Quantity::non_negative("J/(m2 K)"))?,
                conductivity: source.number("conductivity", Quantity::non_negative("W/(m K)"))?,
                over: source.group("over", keys::OVER)?.map(|over| structure(&over)).transpose()?,
            },
            response: source.choice("response", &RESPONSES)?,
            heating: profile::read(source, "heating", step)?,
            cooling: profile::read(source, "cooling", step)?,
            retarget: source.choice("retarget", &[("merge", Retarget::Merge), ("restart", Retarget::Restart)])?,
            domain: source.choice("domain", &[("T", Domain::Temperature), ("T4", Domain::FourthPower)])?,
        })
    }

    /// Fills in missing values from `fallback`.
    pub(super) fn or(self, fallback: &Self) -> Self {
        Self {
            front: self.front.or(&fallback.front),
            back: match (self.back, &fallback.back) {
                (Some(back), Some(other)) => Some(back.or(other)),
                (back, other) => back.or_else(|| other.clone()),
            },
            sides: self.sides.or(fallback.sides),
            bulk: Bulk {
                thickness: self.bulk.thickness.or(fallback.bulk.thickness),
                density: self.bulk.density.or(fallback.bulk.density),
                specific_heat: self.bulk.specific_heat.or(fallback.bulk.specific_heat),
                heat_capacity_per_area: self.bulk.heat_capacity_per_area.or(fallback.bulk.heat_capacity_per_area),
                conductivity: self.bulk.conductivity.or(fallback.bulk.conductivity),
                over: self.bulk.over.or(fallback.bulk.over),
            },
            response: self.response.or(fallback.response),
            heating: self.heating.or_else(|| fallback.heating.clone()),
            cooling: self.cooling.or_else(|| fallback.cooling.clone()),
            retarget: self.retarget.or(fallback.retarget),
            domain: self.domain.or(fallback.domain),
        }
    }

    pub(super) fn stated_front(&self) -> StatedOptics {
        self.front.stated()
    }

    /// `outside` or `both`, as a file says it.
    pub(super) fn stated_sides(&self) -> Option<&'static str> {
        self.sides.map(|sides| match sides {
            SidesKind::Outside => "outside",
            SidesKind::Both => "both",
        })
    }

    pub(super) fn stated_back(&self) -> StatedOptics {
        self.back.as_ref().map(PartialOptics::stated).unwrap_or_default()
    }

    pub(super) fn bulk(&self) -> Bulk {
        self.bulk
    }

    pub(super) fn states_front(&self) -> bool {
        self.front != PartialOptics::default()
    }

    pub(super) fn states_back(&self) -> bool {
        self.back.is_some()
    }

    pub(super) fn states_bulk(&self) -> bool {
        self.bulk != Bulk::default()
    }

    /// The complete set of values for a scene with steps of `step` [s]. The error names the first missing value, or optics without a balance temperature.
    pub(super) fn complete(&self, step: f64) -> Result<Complete, Incomplete> {
        let missing = |key, name: &str| {
            Incomplete::new(key, format!("{name} is missing: state it, or name an entry of the table with 'use'"))
        };
        let front = Optics {
            absorptivity: self.front.absorptivity.ok_or_else(|| missing("absorptivity", "absorptivity"))?,
            emissivity: self.front.emissivity.ok_or_else(|| missing("emissivity", "emissivity"))?,
        };
        let sides = match self.sides {
            None | Some(SidesKind::Outside) => Sides::Outside,
            Some(SidesKind::Both) => {
                let message = "sides = 'both' needs the back's own optics: \
                               back = { absorptivity = .., emissivity = .. }";
                let back = self.back.as_ref().ok_or_else(|| Incomplete::new("back", message))?;
                Sides::Both {
                    back: Optics {
                        absorptivity: back.absorptivity.ok_or_else(|| missing("back", "absorptivity of the back"))?,
                        emissivity: back.emissivity.ok_or_else(|| missing("back", "emissivity of the back"))?,
                    },
                }
            }
        };
        check_emits(front, sides)?;
        let gloss = self.gloss(sides)?;
        let of_back = self.back.as_ref().filter(|_| matches!(sides, Sides::Both { .. })).unwrap_or(&self.front);
        let in_band = [&self.front, of_back].map(|face| face.in_band.clone());
        let response = self.response(step)?;
        let moves = matches!(response, Response::Transition(_));
        let stated = [&self.heating, &self.cooling].into_iter().flatten().filter(|_| moves);
        let files = stated.filter_map(|stated| stated.file.clone()).collect();
        Ok(Complete {
            front,
            ranges: self.front.ranges,
            sides,
            gloss,
            in_band,
            bulk: self.bulk,
            response,
            files,
            transition: self.transition(),
            sides_assumed: self.sides.is_none(),
            retarget_assumed: self.retarget.is_none() && moves,
            domain_assumed: self.domain.is_none() && moves,
        })
    }

    /// How front and back reflect. The back of a material that exchanges heat outside only is like its front.
    fn gloss(&self, sides: Sides) -> Result<[Gloss; 2], Incomplete> {
        let front = self.front.gloss().map_err(|(key, message)| Incomplete::new(key, message))?;
        let back = match (sides, &self.back) {
            (Sides::Both { .. }, Some(back)) => {
                back.gloss().map_err(|(key, message)| Incomplete::new("back", format!("{key} {message}")))?
            }
            _ => front,
        };
        Ok([front, back])
    }

    fn response(&self, step: f64) -> Result<Response, Incomplete> {
        let message = "response is missing: state 'network', 'radiative', 'transition' or 'instant' here, in the table's entry or \
                       in [materials]";
        match self.response.ok_or_else(|| Incomplete::new("response", message))? {
            ResponseKind::Instant => Ok(Response::Instant),
            ResponseKind::Network => Ok(Response::Network),
            ResponseKind::Radiative => self.plate(step).map(Response::Radiative),
            ResponseKind::Transition => {
                let missing = |key| {
                    let message = format!(
                        "response = 'transition' needs {key}, a function with t_max_steps or t_max: state it here, in \
                         the table's entry or in [materials]"
                    );
                    Incomplete::new(key, message)
                };
                for (key, profile) in [("heating", &self.heating), ("cooling", &self.cooling)] {
                    if profile.is_none() {
                        return Err(missing(key));
                    }
                }
                self.transition().map(Response::Transition).ok_or_else(|| missing("heating"))
            }
        }
    }

    /// The plate of a material with response 'radiative', in steps of `step` [s].
    fn plate(&self, step: f64) -> Result<Radiative, Incomplete> {
        Radiative::of(&self.bulk, step).map_err(|reason| match reason {
            NoPlate::Lacks(key) => {
                let message = format!(
                    "response = 'radiative' needs {key}: state thickness, density and specific_heat, or \
                     heat_capacity_per_area [J/(m2 K)], here or in the table's entry"
                );
                Incomplete::new(key, message)
            }
            NoPlate::StoresNothing => Incomplete::new(
                "response",
                "response = 'radiative' stores heat, and this material stores none: state response = 'instant', or an 'over' \
                 that stores heat",
            ),
            NoPlate::EmptyStructure => Incomplete::new(
                "over",
                "response = 'radiative' needs a structure that stores heat: density and specific_heat above 0",
            ),
        })
    }

    /// The transition if both profiles are stated.
    fn transition(&self) -> Option<Transition> {
        Some(Transition {
            heating: self.heating.as_ref()?.profile.clone(),
            cooling: self.cooling.as_ref()?.profile.clone(),
            retarget: self.retarget.unwrap_or(Retarget::Merge),
            domain: self.domain.unwrap_or(Domain::Temperature),
        })
    }

    /// Refuses back optics that nothing uses, because they are probably a mistake.
    pub(super) fn check_back_is_used(&self, complete: &Complete) -> Result<(), Incomplete> {
        if self.back.is_some() && complete.sides == Sides::Outside {
            return Err(Incomplete::new("back", "is used with sides = 'both' only: state that, or leave the back out"));
        }
        Ok(())
    }
}

/// Refuses a surface that neither absorbs nor emits, because it has no balance temperature.
fn check_emits(front: Optics, sides: Sides) -> Result<(), Incomplete> {
    let emissivity = match sides {
        Sides::Outside => front.emissivity,
        Sides::Both { back } => front.emissivity + back.emissivity,
    };
    if emissivity >= LEAST_EMISSIVITY {
        return Ok(());
    }
    let message = "an emissivity of 0 leaves no balance temperature, which 'instant' and 'transition' both need: \
                   what emits nothing cannot shed its heat";
    Err(Incomplete::new("emissivity", message))
}
