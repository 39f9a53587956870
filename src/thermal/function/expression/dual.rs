//! A number with its derivative by s: forward differentiation of every function that an expression may call.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A value and its rate of change with s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual {
    /// The value; 1 or 0 for true and false.
    pub value: f64,
    /// Its derivative by s.
    pub rate: f64,
}

impl Dual {
    /// A constant.
    pub fn constant(value: f64) -> Self {
        Self { value, rate: 0.0 }
    }

    /// True or false.
    pub fn truth(value: bool) -> Self {
        Self::constant(f64::from(u8::from(value)))
    }

    /// Whether it is true.
    pub fn is_true(self) -> bool {
        self.value != 0.0
    }

    /// A function of this number, from its value and its derivative there.
    fn map(self, value: f64, slope: f64) -> Self {
        // 0 x infinity is a constant under a steep function: its rate is 0.
        let rate = if self.rate == 0.0 { 0.0 } else { self.rate * slope };
        Self { value, rate }
    }

    /// A function of one number by its GLSL name; `None` for one that is not offered.
    pub fn call(self, name: Unary) -> Self {
        let x = self.value;
        match name {
            Unary::Abs => self.map(x.abs(), if x < 0.0 { -1.0 } else { 1.0 }),
            Unary::Sign => Self::constant(if x == 0.0 { 0.0 } else { x.signum() }),
            Unary::Floor => Self::constant(x.floor()),
            Unary::Ceil => Self::constant(x.ceil()),
            Unary::Round => Self::constant(x.round_ties_even()),
            Unary::Trunc => Self::constant(x.trunc()),
            Unary::Fract => self.map(x - x.floor(), 1.0),
            Unary::Saturate => self.map(x.clamp(0.0, 1.0), f64::from(u8::from((0.0..=1.0).contains(&x)))),
            Unary::Radians => self.map(x.to_radians(), 1f64.to_radians()),
            Unary::Degrees => self.map(x.to_degrees(), 1f64.to_degrees()),
            Unary::Sin => self.map(x.sin(), x.cos()),
            Unary::Cos => self.map(x.cos(), -x.sin()),
            Unary::Tan => self.map(x.tan(), x.cos().powi(-2)),
            Unary::Asin => self.map(x.asin(), 1.0 / (1.0 - x * x).sqrt()),
            Unary::Acos => self.map(x.acos(), -1.0 / (1.0 - x * x).sqrt()),
            Unary::Atan => self.map(x.atan(), 1.0 / (1.0 + x * x)),
            Unary::Sinh => self.map(x.sinh(), x.cosh()),
            Unary::Cosh => self.map(x.cosh(), x.sinh()),
            Unary::Tanh => self.map(x.tanh(), x.cosh().powi(-2)),
            Unary::Asinh => self.map(x.asinh(), 1.0 / (x * x + 1.0).sqrt()),
            Unary::Acosh => self.map(x.acosh(), 1.0 / (x * x - 1.0).sqrt()),
            Unary::Atanh => self.map(x.atanh(), 1.0 / (1.0 - x * x)),
            Unary::Exp => self.map(x.exp(), x.exp()),
            Unary::Exp2 => self.map(x.exp2(), std::f64::consts::LN_2 * x.exp2()),
            Unary::Log => self.map(x.ln(), 1.0 / x),
            Unary::Log2 => self.map(x.log2(), 1.0 / (std::f64::consts::LN_2 * x)),
            Unary::Sqrt => self.map(x.sqrt(), 0.5 / x.sqrt()),
            Unary::InverseSqrt => self.map(1.0 / x.sqrt(), -0.5 / (x * x.sqrt())),
        }
    }

    /// x^y, as GLSL has it: for x of 0 or above.
    pub fn pow(self, exponent: Self) -> Self {
        let (x, y) = (self.value, exponent.value);
        if x < 0.0 {
            return Self::constant(f64::NAN);
        }
        let power = x.powf(y);
        let by_base = self.map(power, y * x.powf(y - 1.0));
        let by_exponent = exponent.map(power, if x > 0.0 { power * x.ln() } else { 0.0 });
        Self { value: power, rate: by_base.rate + by_exponent.rate }
    }

    /// The smaller of two.
    pub fn min(self, other: Self) -> Self {
        if other.value < self.value { other } else { self }
    }

    /// The larger of two.
    pub fn max(self, other: Self) -> Self {
        if other.value > self.value { other } else { self }
    }

    /// x (1 - a) + y a.
    pub fn mix(self, other: Self, share: Self) -> Self {
        self * (Self::constant(1.0) - share) + other * share
    }

    /// 0 below an edge, 1 from there.
    pub fn step(edge: Self, x: Self) -> Self {
        Self::truth(x.value >= edge.value)
    }

    /// t^2 (3 - 2t) with t = (x - low) / (high - low) held in [0, 1].
    pub fn smoothstep(low: Self, high: Self, x: Self) -> Self {
        let t = ((x - low) / (high - low)).call(Unary::Saturate);
        t * t * (Self::constant(3.0) - Self::constant(2.0) * t)
    }

    /// Direction of (x, y).
    pub fn atan2(self, x: Self) -> Self {
        let square = x.value * x.value + self.value * self.value;
        let rate = (self.rate * x.value - self.value * x.rate) / square;
        Self { value: self.value.atan2(x.value), rate }
    }

    /// Remainder with the sign of the dividend.
    pub fn remainder(self, divisor: Self) -> Self {
        let quotient = Self::constant((self.value / divisor.value).trunc());
        self - divisor * quotient
    }
}

/// Functions of one number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "GLSL's own names")]
pub enum Unary {
    Abs,
    Sign,
    Floor,
    Ceil,
    Round,
    Trunc,
    Fract,
    Saturate,
    Radians,
    Degrees,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Sinh,
    Cosh,
    Tanh,
    Asinh,
    Acosh,
    Atanh,
    Exp,
    Exp2,
    Log,
    Log2,
    Sqrt,
    InverseSqrt,
}

impl Add for Dual {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, rate: self.rate + other.rate }
    }
}

impl Sub for Dual {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self { value: self.value - other.value, rate: self.rate - other.rate }
    }
}

impl Mul for Dual {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self { value: self.value * other.value, rate: self.rate * other.value + self.value * other.rate }
    }
}

impl Div for Dual {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        Self { value, rate: (self.rate - value * other.rate) / other.value }
    }
}

impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        Self { value: -self.value, rate: -self.rate }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every rate against the central difference of the values.
    #[test]
    fn rates_are_derivatives() {
        use Unary::*;
        let all = [
            Abs,
            Fract,
            Saturate,
            Radians,
            Degrees,
            Sin,
            Cos,
            Tan,
            Asin,
            Acos,
            Atan,
            Sinh,
            Cosh,
            Tanh,
            Asinh,
            Atanh,
            Exp,
            Exp2,
            Log,
            Log2,
            Sqrt,
            InverseSqrt,
        ];
        let at = |x: f64| Dual { value: x, rate: 1.0 };
        let difference = |f: &dyn Fn(Dual) -> Dual, x: f64| (f(at(x + 1e-6)).value - f(at(x - 1e-6)).value) / 2e-6;
        for name in all {
            let f = |x: Dual| x.call(name);
            assert!((f(at(0.4)).rate - difference(&f, 0.4)).abs() < 1e-6, "{name:?}");
        }
        let acosh = |x: Dual| x.call(Acosh);
        assert!((acosh(at(1.7)).rate - difference(&acosh, 1.7)).abs() < 1e-6);
        let c = Dual::constant;
        let two: [(&str, &dyn Fn(Dual) -> Dual); 9] = [
            ("pow base", &|x| x.pow(c(2.5))),
            ("pow exponent", &|x| c(2.5).pow(x)),
            ("min", &|x| x.min(c(0.5))),
            ("max", &|x| (x * x).max(c(0.1))),
            ("mix", &|x| c(3.0).mix(x, x * x)),
            ("smoothstep", &|x| Dual::smoothstep(c(-1.0), c(2.0), x)),
            ("atan2", &|x| x.atan2(c(1.0) + x)),
            ("remainder", &|x| x.remainder(c(0.3))),
            ("quotient", &|x| (c(1.0) - x) / (c(1.0) + x * x)),
        ];
        for (name, f) in two {
            assert!((f(at(0.4)).rate - difference(f, 0.4)).abs() < 1e-6, "{name}");
        }
        assert!((at(0.4).call(Sin).rate - difference(&|x| x.call(Cos), 0.4)).abs() > 0.1, "a wrong rate shows");
    }
}
