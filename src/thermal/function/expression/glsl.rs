//! GLSL of the first and second derivative of an expression by s: forward differentiation of its operations.
//!
//! What is 0 or 1 whatever s is stays out of the text, so that a polynomial's derivatives are about as long as itself.

use std::fmt::Write as _;

use super::dual::Unary;
use super::program::{Binary, Operation, Program, Slot, Statement};

/// GLSL function `vec2 NAME(float s)`: first and second derivative of a program.
pub(super) fn derivatives(program: &Program, name: &str) -> String {
    let mut writer = Writer { text: format!("vec2 {name}(float s) {{\n"), next: 0, slots: vec![None; program.slots] };
    for local in 0..program.locals {
        let _ = writeln!(writer.text, "float l{local} = 0.0; float dl{local} = 0.0; float el{local} = 0.0;");
    }
    writer.block(&program.body);
    writer.text.push_str("}\n");
    writer.text
}

/// A number of the text: the name of a variable, or a constant that arithmetic leaves out.
#[derive(Debug, Clone, PartialEq)]
enum Term {
    Zero,
    One,
    Other(String),
}

use Term::{One, Other, Zero};

impl Term {
    fn text(&self) -> &str {
        match self {
            Zero => "0.0",
            One => "1.0",
            Other(text) => text,
        }
    }
}

/// A value with its first and second derivative; truths have no derivative and are numbers, 1 or 0.
#[derive(Debug, Clone)]
struct Jet {
    value: Term,
    first: Term,
    second: Term,
}

impl Jet {
    fn constant(value: Term) -> Self {
        Self { value, first: Zero, second: Zero }
    }
}

/// A float as GLSL writes it.
pub fn literal(value: f64) -> String {
    let text = format!("{:.9e}", value as f32);
    if value < 0.0 { format!("({text})") } else { text }
}

struct Writer {
    text: String,
    next: usize,
    slots: Vec<Option<Jet>>,
}

impl Writer {
    fn block(&mut self, body: &[Statement]) {
        for statement in body {
            match statement {
                Statement::Set(slot, operation) => {
                    let jet = self.operation(operation);
                    self.slots[*slot] = Some(jet);
                }
                Statement::Store(local, slot) => {
                    let jet = self.slot(*slot);
                    let [value, first, second] = [jet.value, jet.first, jet.second].map(|term| term.text().to_owned());
                    let _ = writeln!(self.text, "l{local} = {value}; dl{local} = {first}; el{local} = {second};");
                }
                Statement::If(condition, accept, reject) => {
                    let _ = writeln!(self.text, "if ({} != 0.0) {{", self.slot(*condition).value.text());
                    self.block(accept);
                    self.text.push_str("} else {\n");
                    self.block(reject);
                    self.text.push_str("}\n");
                }
                Statement::Return(slot) => {
                    let jet = self.slot(*slot);
                    let _ = writeln!(self.text, "return vec2({}, {});", jet.first.text(), jet.second.text());
                }
            }
        }
    }

    fn slot(&self, slot: Slot) -> Jet {
        self.slots[slot].clone().unwrap_or(Jet::constant(Zero))
    }

    /// A new variable.
    fn variable(&mut self, text: &str) -> Term {
        let name = format!("t{}", self.next);
        self.next += 1;
        let _ = writeln!(self.text, "float {name} = {text};");
        Other(name)
    }

    fn add(&mut self, a: &Term, b: &Term) -> Term {
        match (a, b) {
            (Zero, other) | (other, Zero) => other.clone(),
            _ => self.variable(&format!("{} + {}", a.text(), b.text())),
        }
    }

    fn subtract(&mut self, a: &Term, b: &Term) -> Term {
        match (a, b) {
            (other, Zero) => other.clone(),
            _ => self.variable(&format!("{} - {}", a.text(), b.text())),
        }
    }

    fn multiply(&mut self, a: &Term, b: &Term) -> Term {
        match (a, b) {
            (Zero, _) | (_, Zero) => Zero,
            (One, other) | (other, One) => other.clone(),
            _ => self.variable(&format!("{} * {}", a.text(), b.text())),
        }
    }

    fn divide(&mut self, a: &Term, b: &Term) -> Term {
        match (a, b) {
            (Zero, _) => Zero,
            (other, One) => other.clone(),
            _ => self.variable(&format!("{} / {}", a.text(), b.text())),
        }
    }

    /// A function of x from the text of its value and of its derivatives by x.
    fn chain(&mut self, x: &Jet, value: Term, slope: &str, bend: &str) -> Jet {
        if x.first == Zero && x.second == Zero {
            return Jet::constant(value);
        }
        let slope = self.variable(slope);
        let first = self.multiply(&slope, &x.first);
        let mut second = self.multiply(&slope, &x.second);
        if bend != "0.0" {
            let square = self.multiply(&x.first, &x.first);
            let bend = self.variable(bend);
            let bent = self.multiply(&bend, &square);
            second = self.add(&second, &bent);
        }
        Jet { value, first, second }
    }

    fn sum(&mut self, x: &Jet, y: &Jet) -> Jet {
        Jet {
            value: self.add(&x.value, &y.value),
            first: self.add(&x.first, &y.first),
            second: self.add(&x.second, &y.second),
        }
    }

    fn difference(&mut self, x: &Jet, y: &Jet) -> Jet {
        Jet {
            value: self.subtract(&x.value, &y.value),
            first: self.subtract(&x.first, &y.first),
            second: self.subtract(&x.second, &y.second),
        }
    }

    fn product(&mut self, x: &Jet, y: &Jet) -> Jet {
        let value = self.multiply(&x.value, &y.value);
        let (left, right) = (self.multiply(&x.first, &y.value), self.multiply(&x.value, &y.first));
        let first = self.add(&left, &right);
        let both = self.multiply(&x.first, &y.first);
        let both = self.add(&both, &both);
        let (left, right) = (self.multiply(&x.second, &y.value), self.multiply(&x.value, &y.second));
        let outer = self.add(&left, &right);
        Jet { value, first, second: self.add(&outer, &both) }
    }

    fn quotient(&mut self, x: &Jet, y: &Jet) -> Jet {
        let value = self.divide(&x.value, &y.value);
        let moved = self.multiply(&value, &y.first);
        let moved = self.subtract(&x.first, &moved);
        let first = self.divide(&moved, &y.value);
        let twice = self.multiply(&first, &y.first);
        let twice = self.add(&twice, &twice);
        let bent = self.multiply(&value, &y.second);
        let rest = self.subtract(&x.second, &twice);
        let rest = self.subtract(&rest, &bent);
        Jet { value, first, second: self.divide(&rest, &y.value) }
    }

    /// The one or the other, by a condition on their values.
    fn select(&mut self, condition: &str, x: &Jet, y: &Jet) -> Jet {
        let mut choose = |a: &Term, b: &Term| {
            if a == b { a.clone() } else { self.variable(&format!("({condition}) ? {} : {}", a.text(), b.text())) }
        };
        Jet {
            value: choose(&x.value, &y.value),
            first: choose(&x.first, &y.first),
            second: choose(&x.second, &y.second),
        }
    }

    fn least(&mut self, x: &Jet, y: &Jet) -> Jet {
        self.select(&format!("{} < {}", y.value.text(), x.value.text()), y, x)
    }

    fn greatest(&mut self, x: &Jet, y: &Jet) -> Jet {
        self.select(&format!("{} > {}", y.value.text(), x.value.text()), y, x)
    }

    fn truth(&mut self, condition: &str) -> Jet {
        Jet::constant(self.variable(&format!("({condition}) ? 1.0 : 0.0")))
    }

    fn held(&mut self, x: &Jet) -> Jet {
        let low = self.greatest(x, &Jet::constant(Zero));
        self.least(&low, &Jet::constant(One))
    }

    fn operation(&mut self, operation: &Operation) -> Jet {
        match *operation {
            Operation::Constant(value) => Jet::constant(if value == 0.0 {
                Zero
            } else if value == 1.0 {
                One
            } else {
                Other(literal(value))
            }),
            Operation::Argument => Jet { value: Other("s".to_owned()), first: One, second: Zero },
            // A copy: the variable may be stored to again before the number is used.
            Operation::Load(local) => Jet {
                value: self.variable(&format!("l{local}")),
                first: self.variable(&format!("dl{local}")),
                second: self.variable(&format!("el{local}")),
            },
            Operation::Same(x) => self.slot(x),
            Operation::Negate(x) => self.difference(&Jet::constant(Zero), &self.slot(x)),
            Operation::Not(x) => {
                let x = self.slot(x);
                self.truth(&format!("{} == 0.0", x.value.text()))
            }
            Operation::Clamp(x, low, high) => {
                let held = self.greatest(&self.slot(x), &self.slot(low));
                self.least(&held, &self.slot(high))
            }
            Operation::Mix(x, y, share) => {
                let (x, y, share) = (self.slot(x), self.slot(y), self.slot(share));
                let rest = self.difference(&Jet::constant(One), &share);
                let (a, b) = (self.product(&x, &rest), self.product(&y, &share));
                self.sum(&a, &b)
            }
            Operation::SmoothStep(low, high, x) => {
                let (low, high, x) = (self.slot(low), self.slot(high), self.slot(x));
                let (above, width) = (self.difference(&x, &low), self.difference(&high, &low));
                let quotient = self.quotient(&above, &width);
                let t = self.held(&quotient);
                let twice = self.sum(&t, &t);
                let rest = self.difference(&Jet::constant(Other("3.0".to_owned())), &twice);
                let square = self.product(&t, &t);
                self.product(&square, &rest)
            }
            Operation::MultiplyAdd(x, y, z) => {
                let product = self.product(&self.slot(x), &self.slot(y));
                self.sum(&product, &self.slot(z))
            }
            Operation::Select(condition, accept, reject) => {
                let condition = format!("{} != 0.0", self.slot(condition).value.text());
                self.select(&condition, &self.slot(accept), &self.slot(reject))
            }
            Operation::Call(name, x) => {
                let x = self.slot(x);
                self.call(name, &x)
            }
            Operation::Binary(name, x, y) => {
                let (x, y) = (self.slot(x), self.slot(y));
                self.binary(name, &x, &y)
            }
        }
    }

    fn binary(&mut self, name: Binary, x: &Jet, y: &Jet) -> Jet {
        let (a, b) = (x.value.text().to_owned(), y.value.text().to_owned());
        match name {
            Binary::Add => self.sum(x, y),
            Binary::Subtract => self.difference(x, y),
            Binary::Multiply => self.product(x, y),
            Binary::Divide => self.quotient(x, y),
            Binary::Remainder => {
                let whole = self.variable(&format!("trunc({a} / {b})"));
                let taken = self.product(y, &Jet::constant(whole));
                self.difference(x, &taken)
            }
            Binary::Equal => self.truth(&format!("{a} == {b}")),
            Binary::NotEqual => self.truth(&format!("{a} != {b}")),
            Binary::Less => self.truth(&format!("{a} < {b}")),
            Binary::LessEqual => self.truth(&format!("{a} <= {b}")),
            Binary::And => self.truth(&format!("{a} != 0.0 && {b} != 0.0")),
            Binary::Or => self.truth(&format!("{a} != 0.0 || {b} != 0.0")),
            Binary::Step => self.truth(&format!("{b} >= {a}")),
            Binary::Min => self.least(x, y),
            Binary::Max => self.greatest(x, y),
            Binary::Pow => self.pow(x, y),
            Binary::Atan2 => {
                let value = self.variable(&format!("atan({a}, {b})"));
                let (xx, yy) = (self.multiply(&x.value, &x.value), self.multiply(&y.value, &y.value));
                let square = self.add(&xx, &yy);
                let turned = |writer: &mut Self, dx: &Term, dy: &Term| {
                    let (p, q) = (writer.multiply(dx, &y.value), writer.multiply(&x.value, dy));
                    writer.subtract(&p, &q)
                };
                let first = turned(self, &x.first, &y.first);
                let first = self.divide(&first, &square);
                let second = turned(self, &x.second, &y.second);
                let (p, q) = (self.multiply(&x.value, &x.first), self.multiply(&y.value, &y.first));
                let growth = self.add(&p, &q);
                let growth = self.multiply(&first, &growth);
                let growth = self.add(&growth, &growth);
                let second = self.subtract(&second, &growth);
                Jet { value, first, second: self.divide(&second, &square) }
            }
        }
    }

    /// x^y. Where the base is 0 its logarithm is left out, as in `Dual::pow`.
    fn pow(&mut self, x: &Jet, y: &Jet) -> Jet {
        let (a, b) = (x.value.text().to_owned(), y.value.text().to_owned());
        let value = self.variable(&format!("pow({a}, {b})"));
        if y.first == Zero && y.second == Zero {
            let above = format!("max({a}, 1e-9)");
            let slope = format!("{b} * pow({above}, {b} - 1.0)");
            let bend = format!("{b} * ({b} - 1.0) * pow({above}, {b} - 2.0)");
            return self.chain(x, value, &slope, &bend);
        }
        let base = Jet { value: self.variable(&format!("max({a}, 1e-9)")), ..x.clone() };
        let base_text = base.value.text().to_owned();
        let logarithm = self.variable(&format!("log({base_text})"));
        let logarithm =
            self.chain(&base, logarithm, &format!("1.0 / {base_text}"), &format!("-1.0 / ({base_text} * {base_text})"));
        let exponent = self.product(y, &logarithm);
        let text = value.text().to_owned();
        self.chain(&exponent, value, &text, &text)
    }

    fn call(&mut self, name: Unary, x: &Jet) -> Jet {
        let a = x.value.text().to_owned();
        let (call, slope, bend): (&str, &str, &str) = match name {
            Unary::Abs => ("abs(X)", "X < 0.0 ? -1.0 : 1.0", "0.0"),
            Unary::Sign => return Jet::constant(self.variable(&format!("sign({a})"))),
            Unary::Floor => return Jet::constant(self.variable(&format!("floor({a})"))),
            Unary::Ceil => return Jet::constant(self.variable(&format!("ceil({a})"))),
            Unary::Round => return Jet::constant(self.variable(&format!("roundEven({a})"))),
            Unary::Trunc => return Jet::constant(self.variable(&format!("trunc({a})"))),
            Unary::Saturate => return self.held(x),
            Unary::Fract => ("fract(X)", "1.0", "0.0"),
            Unary::Radians => ("radians(X)", "radians(1.0)", "0.0"),
            Unary::Degrees => ("degrees(X)", "degrees(1.0)", "0.0"),
            Unary::Sin => ("sin(X)", "cos(X)", "-sin(X)"),
            Unary::Cos => ("cos(X)", "-sin(X)", "-cos(X)"),
            Unary::Tan => ("tan(X)", "1.0 + V * V", "2.0 * V * (1.0 + V * V)"),
            Unary::Asin => ("asin(X)", "inversesqrt(1.0 - X * X)", "X * D * D * D"),
            Unary::Acos => ("acos(X)", "-inversesqrt(1.0 - X * X)", "X * D * D * D"),
            Unary::Atan => ("atan(X)", "1.0 / (1.0 + X * X)", "-2.0 * X * D * D"),
            Unary::Sinh => ("sinh(X)", "cosh(X)", "V"),
            Unary::Cosh => ("cosh(X)", "sinh(X)", "V"),
            Unary::Tanh => ("tanh(X)", "1.0 - V * V", "-2.0 * V * D"),
            Unary::Asinh => ("asinh(X)", "inversesqrt(X * X + 1.0)", "-X * D * D * D"),
            Unary::Acosh => ("acosh(X)", "inversesqrt(X * X - 1.0)", "-X * D * D * D"),
            Unary::Atanh => ("atanh(X)", "1.0 / (1.0 - X * X)", "2.0 * X * D * D"),
            Unary::Exp => ("exp(X)", "V", "V"),
            Unary::Exp2 => ("exp2(X)", "0.693147181 * V", "0.480453014 * V"),
            Unary::Log => ("log(X)", "1.0 / X", "-D * D"),
            Unary::Log2 => ("log2(X)", "1.442695041 / X", "-D / X"),
            Unary::Sqrt => ("sqrt(X)", "0.5 / V", "-0.5 * D / X"),
            Unary::InverseSqrt => ("inversesqrt(X)", "-0.5 * V / X", "-1.5 * D / X"),
        };
        let value = self.variable(&call.replace('X', &a));
        if x.first == Zero && x.second == Zero {
            return Jet::constant(value);
        }
        // X, V and D: argument, value and derivative.
        let filled = |text: &str, d: &str| text.replace('X', &a).replace('V', value.text()).replace('D', d);
        let slope = self.variable(&filled(slope, ""));
        let bend = filled(bend, slope.text());
        let slope = slope.text().to_owned();
        self.chain(x, value, &slope, &bend)
    }
}

#[cfg(test)]
mod tests;
