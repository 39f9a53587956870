//! The work of a network in words.

use super::NetworkRun;
use super::left::OnePassExit;
use crate::thermal::network::one_pass::{Estimate, Halving};

/// Name of the estimated error of a network in one pass, in a description.
pub(crate) const ESTIMATED: &str = "estimated error";
/// Name of the remark that this error is beyond the tolerance.
pub(crate) const BEYOND: &str = "beyond the tolerance";

impl NetworkRun {
    /// The work so far in words, as pairs of name and value.
    pub fn description(&self) -> Vec<(String, String)> {
        if self.is_in_frames() {
            let integrated = "in one pass a step on the device, f32 with carried rest";
            let mut lines = vec![("integrated".to_owned(), integrated.to_owned())];
            lines.extend(self.told.iter().flat_map(|(estimate, halving)| told(estimate, halving)));
            lines.extend(self.switches_line());
            return lines;
        }
        if let Some(one_pass) = &self.one_pass {
            let integrated = "in one pass a step, f64 on the processor".to_owned();
            let mut lines = vec![("integrated".to_owned(), integrated)];
            lines.extend(told(&one_pass.estimate(), one_pass.halving()));
            lines.extend(self.switches_line());
            return lines;
        }
        let mut lines = vec![("integrated".to_owned(), "f64 on the processor".to_owned())];
        for (name, used) in ["Euler", "RKL2", "TR-BDF2"].iter().zip(&self.course.uses) {
            if let Some(used) = used {
                let [short, long] = used.range;
                let [fewest, most] = used.stages;
                lines.push((
                    (*name).to_owned(),
                    format!("{} sub-steps of {short:.3} to {long:.3} s, {fewest} to {most} stages", used.sub_steps),
                ));
            }
        }
        let counts = self.worker.counts();
        lines.push(("sub-steps taken back".to_owned(), self.course.rejected.to_string()));
        lines.push(("stages".to_owned(), counts.stages.to_string()));
        lines.extend(self.left_lines());
        lines.extend(self.switches_line());
        lines
    }

    fn switches_line(&self) -> Option<(String, String)> {
        (!self.course.on.is_empty()).then(|| ("switches of thermostats".to_owned(), self.course.switches.to_string()))
    }

    /// Where the network left the one pass, in words.
    fn left_lines(&self) -> Vec<(String, String)> {
        let Some(OnePassExit { time, estimate: Estimate { rms, most, node } }) = self.course.left else {
            return Vec::new();
        };
        let entry = |name: &str, value: String| (name.to_owned(), value);
        vec![
            entry(ESTIMATED, format!("{rms:.1e} K rms, at most {most:.1e} K at node {node}, until {time:.1} s")),
            entry(
                BEYOND,
                format!(
                    "the estimate stayed above {} K at an eighth of the step, so the network takes sub-steps from {time:.1} s on",
                    self.scene.settings.tolerance
                ),
            ),
        ]
    }
}

/// The estimated error of steps in one pass, in words.
fn told(estimate: &Estimate, halving: &Halving) -> Vec<(String, String)> {
    let Estimate { rms, most, node } = estimate;
    let mut lines = vec![(ESTIMATED.to_owned(), format!("{rms:.1e} K rms, at most {most:.1e} K at node {node}"))];
    if halving.least + halving.most > 0 {
        let name = "steps of a step of the scene".to_owned();
        lines.push((
            name,
            format!("{} now, {} at most", halving.parts() << halving.least, 1 << (halving.least + halving.most)),
        ));
    }
    if halving.exceeded > 0 {
        let beyond = format!(
            "the estimate exceeds {} K at an eighth of the step; integrator = \"accurate\" follows its tolerance",
            halving.tolerance
        );
        lines.push((BEYOND.to_owned(), beyond));
    }
    lines
}
