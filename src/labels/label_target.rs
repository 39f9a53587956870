//! Targets of a data set: sets of parts that labels tell apart as craft of their own.

use wildmatch::WildMatch;

use super::craft::{Craft, LabelTarget};

/// A target as somebody states it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct StatedTarget {
    pub(crate) name: String,
    /// Patterns of names of parts.
    pub(crate) patterns: Vec<String>,
}

/// Why targets can not be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum LabelTargetError {
    #[error("[[target]] '{target}': no part has a name like '{pattern}'; the parts are: {known}")]
    NoPart { target: String, pattern: String, known: String },
    #[error("[[target]] '{first}' and [[target]] '{second}' both take the part '{part}'")]
    Twice { first: String, second: String, part: String },
}

/// The targets of a craft. Without stated ones there are none, and the craft as a whole is the only target.
///
/// # Errors
/// A pattern that fits no part, or a part of two targets.
pub(crate) fn targets(craft: &Craft, stated: &[StatedTarget]) -> Result<Vec<LabelTarget>, LabelTargetError> {
    let mut targets: Vec<LabelTarget> = Vec::new();
    for one in stated {
        let mut parts = vec![false; craft.parts.len()];
        for pattern in &one.patterns {
            let matches = WildMatch::new(pattern);
            let mut fits = 0;
            for (part, name) in craft.parts.iter().enumerate().filter(|(_, name)| matches.matches(name)) {
                if let Some(first) = targets.iter().find(|other| other.parts[part]) {
                    let (first, second) = (first.name.clone(), one.name.clone());
                    return Err(LabelTargetError::Twice { first, second, part: name.clone() });
                }
                (parts[part], fits) = (true, fits + 1);
            }
            if fits == 0 {
                let (target, pattern, known) = (one.name.clone(), pattern.clone(), craft.parts.join(", "));
                return Err(LabelTargetError::NoPart { target, pattern, known });
            }
        }
        targets.push(LabelTarget { name: one.name.clone(), parts });
    }
    Ok(targets)
}

#[cfg(test)]
mod tests {
    use super::super::image::tests::small_craft;
    use super::*;

    #[test]
    fn a_pattern_without_a_part_and_a_part_of_two_targets_are_refused() {
        let stated =
            |name: &str, pattern: &str| StatedTarget { name: name.to_owned(), patterns: vec![pattern.to_owned()] };
        let craft = small_craft();
        let made = targets(&craft, &[stated("a", "w*"), stated("b", "hull")]).expect("targets");
        assert_eq!([&made[0].parts[..], &made[1].parts[..]], [&[false, true][..], &[true, false][..]]);
        let message = |stated: &[StatedTarget]| targets(&craft, stated).expect_err("refused").to_string();
        assert!(message(&[stated("a", "sail")]).contains("the parts are: hull, wing"));
        assert!(message(&[stated("a", "w*"), stated("b", "*")]).contains("both take the part 'wing'"));
    }
}
