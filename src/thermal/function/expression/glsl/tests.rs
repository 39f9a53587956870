//! The derivatives' text, read back operation by operation in f64, against the derivatives of dual numbers.

use super::*;

/// First or second derivative as a program: the function that the text is, returning one of its two numbers.
fn written(program: &Program, second: bool) -> Program {
    let text = derivatives(program, "slopes");
    let body = text.strip_prefix("vec2 slopes(float s) {\n").and_then(|text| text.strip_suffix("}\n"));
    let lines = body.expect("a function of s").lines().map(|line| {
        let Some(pair) = line.strip_prefix("return vec2(").and_then(|rest| rest.strip_suffix(");")) else {
            return line.to_owned();
        };
        let (first, bend) = pair.split_once(", ").expect("two numbers");
        format!("return {};", if second { bend } else { first })
    });
    Program::compile_body(&lines.collect::<Vec<_>>().join("\n")).expect("GLSL")
}

#[test]
fn the_text_of_the_derivatives_is_theirs() {
    let texts = [
        "s*s*(3.0-2.0*s)",
        "tanh(2.0*s)/tanh(2.0)",
        "pow(s, 1.5)",
        "pow(2.5, s)",
        "pow(s + 0.5, s)",
        "(1.0-exp(-3.0*s))/(1.0-exp(-3.0))",
        "1.0-acos(s)/1.5707963",
        "asin(0.9*s) + atan(3.0*s) + atan(s, 1.0+s*s)",
        "sin(s) - cos(2.0*s) + tan(s)",
        "sinh(s) + cosh(s) + asinh(s) + acosh(1.5+s) + atanh(0.5*s)",
        "exp2(s) + log(1.0+s) + log2(2.0+s) + sqrt(s) + inversesqrt(1.0+s)",
        "mix(s, s*s, s*s*s) + smoothstep(-0.5, 1.5, s) + clamp(s*s, 0.1, 0.3)",
        "s < 0.5 ? s*s : s - 0.25",
        "min(s, 0.7*s*s) + max(s*s, 0.3) + abs(s-0.55) + fract(3.0*s) + mod(s, 0.3) + radians(s*s)",
        "1.0/(1.0+s) + s/(2.0-s*s)",
    ];
    for text in texts {
        let program = Program::compile(text).expect(text);
        let [first, second] = [written(&program, false), written(&program, true)];
        for s in [0.07, 0.21, 0.43, 0.62, 0.83, 0.95] {
            let rate = program.run(s).rate;
            let bend = (program.run(s + 1e-5).rate - program.run(s - 1e-5).rate) / 2e-5;
            let (found, bent) = (first.run(s).value, second.run(s).value);
            assert!((found - rate).abs() < 1e-6 * (1.0 + rate.abs()), "{text} at {s}: rate {found}, {rate}");
            assert!((bent - bend).abs() < 1e-5 * (1.0 + bend.abs()), "{text} at {s}: bend {bent}, {bend}");
        }
    }
    let program = Program::compile("s*s").expect("GLSL");
    assert!((written(&program, false).run(0.5).value - program.run(0.6).rate).abs() > 0.1, "a wrong place shows");
}
