//! Values of every kind against its formula, and refused input.

use super::*;

fn samples(points: &[(f64, f64)]) -> Vec<TemperatureSample> {
    points.iter().map(|&(time, temperature)| TemperatureSample { time, temperature }).collect()
}

/// Name, function, and its formula.
type Kinds = (&'static str, Function, fn(f64) -> f64);

/// The formulas: exponential (1 - e^-ks) / (1 - e^-k), logarithmic ln(1 + ks) / ln(1 + k).
#[test]
fn values_are_those_of_the_formulas() {
    let kinds: [Kinds; 5] = [
        ("exponential", Function::exponential(3.0).unwrap(), |s| (1.0 - (-3.0 * s).exp()) / (1.0 - (-3f64).exp())),
        ("logarithmic", Function::logarithmic(9.0).unwrap(), |s| (1.0 + 9.0 * s).ln() / 10f64.ln()),
        ("polynomial", Function::polynomial(&[0.0, 0.0, 3.0, -2.0]).unwrap(), |s| s * s * (3.0 - 2.0 * s)),
        ("expression", Function::expression("s*s*(3.0-2.0*s)").unwrap(), |s| s * s * (3.0 - 2.0 * s)),
        ("quadratic", Function::Quadratic, |s| s * (2.0 - s)),
    ];
    for (name, function, f) in kinds {
        assert_eq!(function.kind_name(), name);
        for i in 0..=1000 {
            let s = f64::from(i) / 1000.0;
            assert!((function.done(s) - f(s)).abs() < 1e-14, "{name} at {s}: {} {}", function.done(s), f(s));
            assert!(i != 500 || (function.done(s) - f(s + 1e-9)).abs() > 1e-11, "a wrong place shows");
        }
    }
}

/// The share left keeps its relative accuracy near the end, because the span of a merged transition multiplies it.
#[test]
fn the_end_is_relatively_accurate() {
    let r = 1e-9;
    let exponential = Function::exponential(3.0).unwrap().remaining(r);
    let series = 3.0 * r * (1.0 + 1.5 * r) / 3f64.exp_m1();
    assert!((exponential / series - 1.0).abs() < 1e-14);
    let logarithmic = Function::logarithmic(9.0).unwrap().remaining(r);
    assert!((logarithmic / (0.9 * r * (1.0 + 0.45 * r) / 10f64.ln()) - 1.0).abs() < 1e-14);
    let curve = Function::polynomial(&[0.0, 0.0, 3.0, -2.0]).unwrap().remaining(r);
    assert!((curve / (r * r * (3.0 - 2.0 * r)) - 1.0).abs() < 1e-14);
}

#[test]
fn a_table_goes_through_its_points_without_a_bump() {
    let points = [(5.0, 300.0), (6.0, 290.0), (9.0, 289.0), (9.5, 250.0), (15.0, 250.0), (25.0, 200.0)];
    let table = Function::table(&samples(&points), None).unwrap();
    for (time, temperature) in points {
        let done = table.done((time - 5.0) / 20.0);
        assert!((done - (300.0 - temperature) / 100.0).abs() < 1e-14, "{time}: {done}");
    }
    let done: Vec<f64> = (0..=20_000).map(|i| table.done(f64::from(i) / 20_000.0)).collect();
    assert!(done.windows(2).all(|pair| pair[1] >= pair[0]));
    // Pieces reproduce a straight line exactly.
    let line = Function::table(&samples(&[(0.0, 1.0), (1.0, 2.0), (7.0, 8.0), (10.0, 11.0)]), None).unwrap();
    assert!((0..100).all(|i| (line.done(f64::from(i) / 100.0) - f64::from(i) / 100.0).abs() < 1e-14));
}

/// Measured for 150 K on the way to 100 K, with -10 K a second at the end. Five more seconds remain.
#[test]
fn a_table_that_stops_short_goes_on_at_its_last_rate() {
    let points = [(0.0, 300.0), (5.0, 200.0), (10.0, 150.0)];
    let table = Function::table(&samples(&points), Some(100.0)).unwrap();
    for (time, temperature) in [(0.0, 300.0), (5.0, 200.0), (10.0, 150.0), (12.0, 130.0), (15.0, 100.0)] {
        let done = table.done(time / 15.0);
        assert!((300.0 - 200.0 * done - temperature).abs() < 1e-9, "{time}: {}", 300.0 - 200.0 * done);
    }
    let still = Function::table(&samples(&[(0.0, 300.0), (5.0, 200.0), (6.0, 200.0)]), Some(100.0));
    assert!(matches!(still, Err(FunctionError::Table { .. })));
    let beyond = Function::table(&samples(&[(0.0, 300.0), (5.0, 200.0)]), Some(250.0));
    assert!(matches!(beyond, Err(FunctionError::Row { row: 2, .. })), "{beyond:?}");
}

#[test]
fn bad_tables_say_which_row() {
    let row = |points: &[(f64, f64)]| match Function::table(&samples(points), None) {
        Err(FunctionError::Row { row, message, .. }) => (row, message),
        other => panic!("{other:?}"),
    };
    assert!(row(&[(0.0, 1.0), (1.0, 2.0), (1.0, 3.0)]).1.contains("stands twice"));
    assert_eq!(row(&[(0.0, 1.0), (2.0, 2.0), (1.0, 3.0)]).0, 3);
    let (number, message) = row(&[(0.0, 1.0), (1.0, 2.0), (2.0, 1.9), (3.0, 3.0)]);
    assert!(number == 3 && message.contains("must not turn back"), "{message}");
    assert_eq!(row(&[(0.0, 1.0), (1.0, f64::NAN), (2.0, 3.0)]).0, 2);
    assert!(Function::table(&samples(&[(0.0, 1.0)]), None).is_err());
    assert!(Function::table(&samples(&[(0.0, 1.0), (1.0, 1.0)]), None).is_err());

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("noise.csv");
    std::fs::write(&path, "# a comment\ntime,temperature\n0,300\n1,200\n2,210\n3,100\n").unwrap();
    let error = Function::read_table(&path, None).unwrap_err().to_string();
    assert!(error.contains("noise.csv: row 5: 210 K at time 2"), "{error}");
    std::fs::write(&path, "t,temperature\n0,300\n").unwrap();
    assert!(Function::read_table(&path, None).unwrap_err().to_string().contains("there is no 'time'"));
    std::fs::write(&path, "temperature , time\n300,0\nabc,1\n").unwrap();
    assert!(Function::read_table(&path, None).unwrap_err().to_string().contains("row 3: temperature: 'abc'"));
}

#[test]
fn expressions_are_evaluated_as_glsl() {
    let done = |text: &str, s: f64| Function::expression(text).unwrap_or_else(|error| panic!("{error}")).done(s);
    for (text, expected) in [
        ("s", 0.3),
        ("pow(s, 2.0)", 0.09),
        ("s < 0.5 ? 2.0*s*s : 1.0 - 2.0*(1.0-s)*(1.0-s)", 0.18),
        ("smoothstep(0.0, 1.0, s)", 0.216),
        ("mix(s, s*s, 0.5)", 0.195),
        ("(1.0 - exp(-3.0*s)) / (1.0 - exp(-3.0))", (1.0 - (-0.9f64).exp()) / (1.0 - (-3f64).exp())),
        ("log(1.0 + 9.0*s) / log(10.0)", 3.7f64.ln() / 10f64.ln()),
        ("min(1.0, 2.0*s)", 0.6),
        ("sqrt(s*(s+3.0))/2.0", (0.3 * 3.3f64).sqrt() / 2.0),
        ("1.0 - acos(s)/1.57079633", 0.3f64.asin() / std::f64::consts::FRAC_PI_2),
        ("step(0.2, s)*0.0 + mod(s, 2.0) + floor(0.5*s) - fract(0.0)", 0.3),
        ("atan(s, 1.0)/atan(1.0, 1.0)", 0.3f64.atan() / std::f64::consts::FRAC_PI_4),
        ("clamp(s, -1.0, 2.0) + sign(s - 2.0) + 1.0", 0.3),
        ("max(s, 0.5*s) + abs(0.0) + trunc(0.5)", 0.3),
        ("sinh(s)/sinh(1.0)", 0.3f64.sinh() / 1f64.sinh()),
        ("exp2(s) - 1.0", 0.3f64.exp2() - 1.0),
    ] {
        assert!((done(text, 0.3) - expected).abs() < 1e-7, "{text}: {}", done(text, 0.3));
    }
}

#[test]
fn bad_expressions_are_refused_with_the_reason() {
    for (text, reason) in [
        ("", "is empty"),
        ("s +", "is not GLSL"),
        ("s; discard", "';' has no place"),
        ("s) + (s", "unbalanced"),
        ("t", "is not GLSL"),
        ("1.0 - s", "falls at s = 0"),
        ("s*(1.5 - 0.8*s)", "falls at s = 0.9"),
        ("0.5*s", "f(1) must be 1"),
        ("0.1 + 0.9*s", "f(0) must be 0"),
        ("step(0.5, s)", "jumps at s = 0.5"),
        ("pow(s, 0.2)", "jumps at s = 0.0"),
        ("0.5 + 0.5*sign(s-0.5)*pow(abs(2.0*s-1.0), 0.6)", "changes too fast near s = 0.49"),
        ("s / (s - 0.5)", "falls"),
        ("log(s)", "not finite at s = 0"),
        ("vec2(s, s).x", "single numbers"),
        ("float(gl_GlobalInvocationID.x) + s", "nothing but s"),
    ] {
        let error = Function::expression(text).expect_err(text).to_string();
        assert!(error.contains(reason), "'{text}': {error}");
    }
    let long = format!("s{}", "*s".repeat(300));
    assert!(Function::expression(&long).unwrap_err().to_string().contains("at most 200"));
}

/// A function that reaches its target early stays there.
#[test]
fn a_function_that_reaches_its_target_early_says_so() {
    assert!((Function::expression("min(1.0, 2.0*s)").unwrap().active() - 0.5).abs() < 1e-12);
    let held = Function::table(&samples(&[(0.0, 300.0), (3.0, 200.0), (4.0, 200.0)]), None).unwrap();
    assert!((held.active() - 0.75).abs() < 1e-9 && held.remaining(0.25) == 0.0);
    assert!(held.pieces().remaining(0.0) == 0.0 && (held.pieces().remaining(0.5) - held.remaining(0.625)).abs() < 1e-7);
    for whole in [Function::Linear, Function::exponential(60.0).unwrap(), Function::expression("s*s").unwrap()] {
        assert_eq!(whole.active(), 1.0, "{whole}");
    }
}

/// What the full set of pieces refuses is refused when the function is made, in the same words; what it takes is taken.
#[test]
fn a_quick_look_refuses_what_the_pieces_refuse() {
    let corner =
        |place: f64, jump: f64| format!("s < {place} ? s : min(1.0, s + {jump}*clamp((s-{place})*1e8, 0.0, 1.0))");
    let mut texts: Vec<String> =
        ["s", "s*s*s*s", "sqrt(s)", "tanh(20.0*s)/tanh(20.0)", "pow(s, 0.2)", "min(1.0, 2.0*s)"]
            .map(str::to_owned)
            .into();
    for place in [0.001, 0.123_456_7, 0.3, 0.499_999, 0.777_77, 0.999] {
        texts.extend([1e-7, 5e-6, 1.5e-5, 3e-5, 6e-5, 9e-5].map(|jump| corner(place, jump)));
    }
    let (mut refused, mut lazy) = (0, 0);
    for text in &texts {
        let computed = Function::expression(text);
        let Ok(whole) = Expression::new(text) else {
            assert!(computed.is_err());
            continue;
        };
        let kind = FunctionKind::Expression(whole);
        let active = 1.0 - idle_share(&kind);
        let eager = FunctionShape { kind, active, pieces: OnceLock::new() };
        assert_eq!(computed.as_ref().err(), eager.check().err().as_ref(), "{text}");
        refused += u32::from(computed.is_err());
        lazy += u32::from(matches!(computed, Ok(Function::Shaped(shape)) if shape.pieces.get().is_none()));
    }
    assert!(refused >= 12 && lazy >= 3, "{refused} refused, {lazy} without pieces");
}

/// A table of materials has many functions that a scene does not use, and pieces take a millisecond or more.
#[test]
fn pieces_are_made_when_they_are_asked_for() {
    let points = [(0.0, 300.0), (10.0, 290.0), (30.0, 275.0), (90.0, 262.0), (200.0, 260.0)];
    for function in [
        Function::exponential(500.0),
        Function::logarithmic(1e4),
        Function::polynomial(&[0.0, 0.0, 3.0, -2.0]),
        Function::expression("s*s*(3.0-2.0*s)"),
        Function::table(&samples(&points), None),
    ] {
        let Ok(Function::Shaped(shape)) = function else { panic!("{function:?}") };
        assert!(shape.pieces.get().is_none(), "{}", shape.kind.name());
        assert_eq!(shape.check(), Ok(()));
        assert!(shape.pieces.get().is_some(), "{}", shape.kind.name());
    }
}
