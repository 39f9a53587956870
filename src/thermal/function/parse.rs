//! Parses response functions of the command line: `quadratic`, `exponential=3`, `polynomial=0,2,-1`, `table=FILE`, `expression=s*s`.

use std::path::Path;

use super::{Function, FunctionError};

/// Names of all kinds, in the order of the documentation.
pub(crate) const KINDS: [&str; 7] =
    ["linear", "quadratic", "polynomial", "exponential", "logarithmic", "table", "expression"];

impl Function {
    /// Parses a function. The file of a table is relative to the working directory.
    ///
    /// # Errors
    /// An unknown name, a missing or unexpected value, or an error of the kind itself.
    pub(crate) fn parse(text: &str) -> Result<Self, FunctionError> {
        let (name, value) = match text.split_once('=') {
            Some((name, value)) => (name.trim(), Some(value.trim())),
            None => (text.trim(), None),
        };
        let needs = |what: &str| {
            value
                .filter(|value| !value.is_empty())
                .ok_or_else(|| FunctionError::Syntax(format!("'{name}' needs {what}")))
        };
        match name {
            "linear" | "quadratic" => {
                if value.is_some() {
                    return Err(FunctionError::Syntax(format!("'{name}' takes no value")));
                }
                Ok(if name == "linear" { Self::Linear } else { Self::Quadratic })
            }
            "polynomial" => {
                let list = needs("its coefficients: polynomial=c0,c1,...")?;
                let coefficients = list.split(',').map(number).collect::<Result<Vec<_>, _>>()?;
                Self::polynomial(&coefficients)
            }
            "exponential" => Self::exponential(number(needs("its rate: exponential=K")?)?),
            "logarithmic" => Self::logarithmic(number(needs("its rate: logarithmic=K")?)?),
            "table" => Self::read_table(Path::new(needs("a CSV file: table=FILE")?), None),
            "expression" => Self::expression(needs("GLSL text of s: expression=s*s")?),
            _ => Err(FunctionError::Syntax(format!("'{name}' is no function; there are {}", KINDS.join(", ")))),
        }
        .and_then(|function| function.check().map(|()| function))
    }
}

fn number(text: &str) -> Result<f64, FunctionError> {
    let text = text.trim();
    text.parse().map_err(|_| FunctionError::Syntax(format!("'{text}' is not a number")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_is_read() {
        assert_eq!(Function::parse("linear"), Ok(Function::Linear));
        assert_eq!(Function::parse(" quadratic "), Ok(Function::Quadratic));
        assert_eq!(Function::parse("polynomial=0,2,-1"), Function::polynomial(&[0.0, 2.0, -1.0]));
        assert_eq!(Function::parse("exponential=3"), Function::exponential(3.0));
        assert_eq!(Function::parse("logarithmic=9"), Function::logarithmic(9.0));
        assert_eq!(Function::parse("expression=s <= 0.5 ? s : s"), Function::expression("s <= 0.5 ? s : s"));
        for wrong in ["cubic", "linear=1", "exponential", "exponential=", "exponential=x", "polynomial=0,,1", "table="]
        {
            assert!(matches!(Function::parse(wrong), Err(FunctionError::Syntax(_))), "{wrong}");
        }
        assert!(matches!(Function::parse("exponential=0"), Err(FunctionError::Rate { .. })));
        assert!(matches!(Function::parse("table=/nowhere.csv"), Err(FunctionError::Unreadable { .. })));
    }
}
