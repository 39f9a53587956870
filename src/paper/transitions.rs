//! Figures 5 and 6: a node with the paper's thermal inertia whose target jumps once.

use crate::output::OutputError;
use crate::output::panels::Panels;
use crate::output::plot::{Plot, PlotLine};
use crate::output::plot_axis::Axis;
use crate::thermal::function::Function;
use crate::thermal::material::{Domain, Profile, Retarget, Transition};

use super::checks::{PaperCheck, Tolerance};

/// Last step of every transition, and of the values in docs/numerics.md 1.
pub(crate) const LAST_STEP: usize = 1000;

/// Last step on the axis of shorter transitions. The paper's orbit has 360 steps. The longest transition in the paper ends at step 361, if
/// transitions of 1000 steps are left out.
const SHORT_AXIS: usize = 361;

/// Largest error of an f32 device [K] (docs/numerics.md 6).
const DEVICE_TOLERANCE: f64 = 2e-4;

/// A node at rest that gets a new target at step 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Jump {
    /// Number in the paper: figure and jump.
    pub(crate) figure: [u8; 2],
    /// Temperature at step 0 [K].
    pub(crate) from: f64,
    /// Target from step 1 on [K].
    pub(crate) to: f64,
    /// Duration [steps].
    pub(crate) t_max: f64,
    /// Equations 3 and 4 at [`QUADRATIC_STEPS`] [K] with six decimals (docs/numerics.md 1).
    quadratic: [f64; 7],
    /// Equations 1 and 2 at [`LINEAR_STEPS`] [K], if docs/numerics.md 1 gives them.
    linear: Option<[f64; 5]>,
}

const QUADRATIC_STEPS: [usize; 7] = [0, 1, 50, 100, 180, 361, 1000];
const LINEAR_STEPS: [usize; 5] = [1, 50, 100, 180, 361];

const fn jump(
    figure: [u8; 2],
    [from, to]: [f64; 2],
    t_max: f64,
    quadratic: [f64; 7],
    linear: Option<[f64; 5]>,
) -> Jump {
    Jump { figure, from, to, t_max, quadratic, linear }
}

/// The ten transitions of figures 5 and 6.
pub(crate) const JUMPS: [Jump; 10] = [
    jump(
        [5, 1],
        [2.7, 267.0],
        361.0,
        [2.7, 4.162238, 70.843124, 128.845901, 200.558427, 267.0, 267.0],
        Some([3.432133, 39.306648, 75.913296, 134.483934, 267.0]),
    ),
    jump([5, 2], [2.7, 267.0], 100.0, [2.7, 7.959570, 200.925, 267.0, 267.0, 267.0, 267.0], None),
    jump(
        [5, 3],
        [2.7, 267.0],
        1000.0,
        [2.7, 3.228336, 28.469250, 52.917, 89.284680, 159.080760, 267.0],
        Some([2.9643, 15.915, 29.13, 50.274, 98.1123]),
    ),
    jump(
        [5, 4],
        [500.0, 2.7],
        361.0,
        [500.0, 497.248691, 371.783673, 262.647156, 127.714735, 2.7, 2.7],
        Some([498.622438, 431.121884, 362.243767, 252.038781, 2.7]),
    ),
    jump([5, 5], [500.0, 2.7], 100.0, [500.0, 490.103730, 127.025, 2.7, 2.7, 2.7, 2.7], None),
    jump(
        [5, 6],
        [500.0, 2.7],
        1000.0,
        [500.0, 499.005897, 451.513250, 405.513, 337.084520, 205.758033, 2.7],
        Some([499.5027, 475.135, 450.27, 410.486, 320.4747]),
    ),
    jump([6, 1], [2.7, 1000.0], 100.0, [2.7, 22.546270, 750.675, 1000.0, 1000.0, 1000.0, 1000.0], None),
    jump([6, 2], [1000.0, 2.7], 100.0, [1000.0, 980.153730, 252.025, 2.7, 2.7, 2.7, 2.7], None),
    jump([6, 3], [2.7, 5.0], 100.0, [2.7, 2.745770, 4.425, 5.0, 5.0, 5.0, 5.0], None),
    jump([6, 4], [5.0, 2.7], 100.0, [5.0, 4.954230, 3.275, 2.7, 2.7, 2.7, 2.7], None),
];

/// A transition and its temperatures [K] at steps 0 to [`LAST_STEP`].
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Computed {
    pub(crate) jump: Jump,
    /// Temperatures with the quadratic function, as in the figures.
    pub(crate) quadratic: Vec<f64>,
    /// Temperatures with the linear function, if docs/numerics.md 1 gives values for comparison.
    pub(crate) linear: Option<Vec<f64>>,
}

/// Computes all transitions. `respond` takes an initial temperature [K] and a target [K] for each step. The result of `respond` is the temperature at
/// step 0 and after every step.
pub(crate) fn compute<E>(
    respond: impl Fn(&Transition, f64, &[f64]) -> Result<Vec<f64>, E>,
) -> Result<Vec<Computed>, E> {
    let one = |jump: Jump| {
        let with = |function| {
            let profile = Profile { function, t_max_steps: jump.t_max };
            let (heating, cooling) = (profile.clone(), profile);
            let transition = Transition { heating, cooling, retarget: Retarget::Merge, domain: Domain::Temperature };
            respond(&transition, jump.from, &[jump.to; LAST_STEP])
        };
        let quadratic = with(Function::Quadratic)?;
        let linear = jump.linear.map(|_| with(Function::Linear)).transpose()?;
        Ok(Computed { jump, quadratic, linear })
    };
    JUMPS.into_iter().map(one).collect()
}

impl Jump {
    /// `5.1`.
    pub(crate) fn number(&self) -> String {
        format!("{}.{}", self.figure[0], self.figure[1])
    }

    fn describe(&self) -> String {
        format!("{} to {} K in {} steps", self.from, self.to, self.t_max)
    }
}

impl Computed {
    /// Compares the results with the values of docs/numerics.md 1.
    pub(crate) fn checks(&self) -> Vec<PaperCheck> {
        let check = |equations: &str, step: usize, expected: f64, computed: Option<&f64>| PaperCheck {
            statement: format!("figure {}, {}, {equations}, at step {step}", self.jump.number(), self.jump.describe()),
            expected,
            computed: computed.copied().unwrap_or(f64::NAN),
            tolerance: Tolerance::Computation(DEVICE_TOLERANCE),
            unit: "K",
        };
        let quadratic = QUADRATIC_STEPS
            .iter()
            .zip(self.jump.quadratic)
            .map(|(&step, expected)| check("quadratic", step, expected, self.quadratic.get(step)));
        let linear = self.linear.iter().zip(self.jump.linear).flat_map(|(computed, expected)| {
            let values = LINEAR_STEPS.iter().zip(expected);
            values.map(|(&step, expected)| check("but linear", step, expected, computed.get(step)))
        });
        quadratic.chain(linear).collect()
    }

    fn plot(&self) -> Plot {
        let Jump { from, to, t_max, .. } = self.jump;
        let last = if t_max as usize > SHORT_AXIS { LAST_STEP } else { SHORT_AXIS };
        let values = self.quadratic.iter().take(last + 1).enumerate();
        let line = PlotLine { points: values.map(|(step, &t)| [step as f64, t]).collect(), ..PlotLine::default() };
        let mut x = Axis::linear("step");
        x.range = Some([0.0, last as f64]);
        Plot {
            title: format!("{} {}", self.jump.number(), if to > from { "heating" } else { "cooling" }),
            subtitle: self.jump.describe(),
            x,
            y: Axis::linear("temperature [K]"),
            series: vec![line],
            shaded: Vec::new(),
        }
    }
}

/// A figure as SVG, arranged as in the paper: figure 5 has a row of heating and one of cooling, figure 6 has pairs.
pub(crate) fn figure(number: u8, computed: &[Computed], device: &str) -> Result<String, OutputError> {
    let (title, columns) = match number {
        5 => ("Figure 5: quadratic transitions of 361, 100 and 1000 steps", 3),
        _ => ("Figure 6: quadratic transitions over wide and narrow ranges in 100 steps", 2),
    };
    let plots = computed.iter().filter(|one| one.jump.figure[0] == number).map(Computed::plot).collect();
    let subtitle = format!("to step {SHORT_AXIS}, or to {LAST_STEP} where the transition lasts that long; on {device}");
    Panels { title: title.to_owned(), subtitle, columns, legends: false, plots }.svg()
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;
    use crate::thermal::transition::{TransitionState, transition_step};

    fn computed(slower: f64) -> Vec<Computed> {
        let respond = |transition: &Transition, initial: f64, targets: &[f64]| {
            let mut transition = transition.clone();
            for profile in [&mut transition.heating, &mut transition.cooling] {
                profile.t_max_steps *= slower;
            }
            let mut state = TransitionState::settled(initial, &transition);
            let mut temperatures = vec![initial];
            for &target in targets {
                let (next, t) = transition_step(state, target, 1.0, &transition);
                state = next;
                temperatures.push(t);
            }
            Ok::<_, Infallible>(temperatures)
        };
        compute(respond).unwrap()
    }

    fn disagreements(computed: &[Computed]) -> usize {
        computed.iter().flat_map(Computed::checks).filter(|check| !check.agrees()).count()
    }

    #[test]
    fn the_reference_agrees_with_every_value_and_a_slower_response_does_not() {
        let right = computed(1.0);
        assert_eq!(right.iter().map(|one| one.checks().len()).sum::<usize>(), 10 * 7 + 4 * 5);
        assert_eq!(disagreements(&right), 0);
        // Before its start and after its end a slower transition agrees too.
        assert!(disagreements(&computed(1.01)) > 40);
    }

    #[test]
    fn a_series_that_is_too_short_does_not_agree() {
        let mut short = computed(1.0);
        short[0].quadratic.truncate(400);
        assert_eq!(disagreements(&short), 1);
    }

    #[test]
    fn figures_have_their_panels() {
        let computed = computed(1.0);
        let five = figure(5, &computed, "device <1>").unwrap();
        let six = figure(6, &computed, "device").unwrap();
        assert!(five.contains("5.1 heating") && five.contains("5.6 cooling") && !five.contains("6.1"));
        assert!(six.contains("6.4 cooling") && six.contains("2.7 to 1000 K in 100 steps") && !six.contains("5.1"));
        assert!(five.contains("device &lt;1&gt;"));
    }
}
