//! `index.html`: figures, checks and explanations on one page that needs no network.

use super::checks::PaperCheck;
use super::files::{FIGURE_7, plot_name, tables};
use crate::output::html::{Html, kelvin};

#[derive(Debug, Clone, Copy)]
pub(crate) struct PaperPage<'a> {
    pub(crate) device: &'a str,
    /// The SVG of figures 2 to 6.
    pub(crate) plots: &'a [(u8, String)],
    /// Figure 7 as PNG, and its caption.
    pub(crate) picture: (&'a [u8], &'a str),
    pub(crate) transitions: &'a [PaperCheck],
    pub(crate) scenario: &'a [PaperCheck],
    /// Assumptions about the scenario.
    pub(crate) assumed: &'a [String],
}

impl PaperPage<'_> {
    pub(crate) fn html(&self) -> String {
        let mut html = Html::page("The paper's figures - isotherm");
        html.element("h1", "The paper's figures, made again");
        html.element(
            "p",
            "Vural, Martin, Dunstan, Sanchez-Gestido: Real-time rasterization simulation of TIR images, 2023",
        );
        html.element("p", &format!("isotherm {} on {}", env!("CARGO_PKG_VERSION"), self.device));
        html.raw("</header>\n<main>\n");
        self.headline(&mut html);
        for (number, svg) in self.plots {
            html.figure(svg, &format!("Figure {number}"), &plot_name(*number));
        }
        html.picture(self.picture.0, self.picture.1, FIGURE_7);
        html.element("h2", "What the paper says of its scenario");
        html.element(
            "p",
            "Figures 2 to 4: a thermal network of the cube's six panels in its periodic state. Numbers that the paper \
             gives only in a plot or as \"about\" are held against ours as closely as they can be read. Its altitude \
             and its period do not belong together, and its eclipse is the night of the face itself, not the shadow \
             of the planet. Physics gives neither a faster fall with conduction nor an exit from eclipse near step \
             264; both rows say so.",
        );
        for line in self.assumed {
            html.element("p", line);
        }
        table(&mut html, self.scenario);
        html.element("h2", "Figures 5 and 6, and the linear function over the same transitions");
        html.element("p", "Expected: equations 1 to 4, held at the target from t_max on; computed on the device.");
        table(&mut html, self.transitions);
        html.files(tables().iter().map(String::as_str));
        html.into_page()
    }

    fn headline(&self, html: &mut Html) {
        let agree = |checks: &[PaperCheck]| checks.iter().filter(|check| check.agrees()).count();
        let worst = self.transitions.iter().map(|check| check.difference().abs()).fold(0.0, f64::max);
        let (worst, unit) = kelvin(worst);
        let share = |checks: &[PaperCheck]| format!("{} of {}", agree(checks), checks.len());
        let figures = [
            (share(self.transitions), "", "values of figures 5 and 6 agree"),
            (worst, unit, "largest difference among them"),
            (share(self.scenario), "", "statements on the scenario agree"),
        ];
        html.headline(figures.into_iter().map(|(value, unit, what)| (value, unit.to_owned(), what.to_owned())));
    }
}

fn table(html: &mut Html, checks: &[PaperCheck]) {
    let row = |check: &PaperCheck| {
        let [expected, computed, difference] = check.numbers();
        let agrees = if check.agrees() { "yes" } else { "no" };
        vec![check.statement_with_unit(), expected, computed, difference, agrees.to_owned()]
    };
    html.table(&["statement", "expected", "computed", "difference", "agrees"], checks.iter().map(row));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::checks::Tolerance;

    #[test]
    fn the_page_counts_what_agrees_and_needs_nothing_else() {
        let check = |computed| PaperCheck {
            statement: "a <b>".into(),
            expected: 1.0,
            computed,
            tolerance: Tolerance::Computation(1e-3),
            unit: "K",
        };
        let page = PaperPage {
            device: "device <1>",
            plots: &[(5, "<svg></svg>".to_owned())],
            picture: (&[1, 2, 3], "picture"),
            transitions: &[check(1.0), check(1.0005), check(3.0)],
            scenario: &[check(2.0)],
            assumed: &["k < 1".to_owned()],
        };
        let html = page.html();
        assert!(html.contains("2 of 3") && html.contains("0 of 1") && html.contains("2.00 <small>K"));
        assert!(html.contains("device &lt;1&gt;") && html.contains("a &lt;b&gt;") && html.contains("k &lt; 1"));
        assert!(html.contains("data:image/png;base64,AQID") && html.contains("<svg></svg>"));
        assert!(!html.contains("http"));
    }
}
