//! Cases of files that are refused, as texts list them: lines that are taken out, lines that take their place, and what the messages say.

/// A case of such a text.
pub struct Case {
    /// The case as it stands there.
    pub text: &'static str,
    /// The lines after `-`.
    pub out: String,
    /// The lines after `+`.
    pub put: String,
    /// The lines after `>`.
    pub expected: Vec<&'static str>,
}

impl Case {
    /// All cases of a text, which empty lines part.
    pub fn all(text: &'static str) -> Vec<Self> {
        let cases = text.split("\n\n").filter(|case| !case.starts_with('#'));
        let read = |text: &'static str| {
            let lines = |mark: &'static str| text.lines().filter_map(move |line| line.strip_prefix(mark));
            let joined = |mark| -> String { lines(mark).map(|line| format!("{line}\n")).collect() };
            Self { text, out: joined("- "), put: joined("+ "), expected: lines("> ").collect() }
        };
        cases.map(read).collect()
    }

    /// The file with the case in it, or nothing where it has no place.
    pub fn spoil(&self, file: &str) -> Option<String> {
        match self.out.is_empty() {
            true => Some(format!("{file}{}", self.put)),
            false => file.contains(&self.out).then(|| file.replacen(&self.out, &self.put, 1)),
        }
    }
}
