//! Tapes: their derivatives against dual numbers, their simplification, and numbers that are no tapes.
#![expect(clippy::float_cmp, reason = "the numbers are compared to the bit")]

use metriplectic_fields::Real;
use metriplectic_recording::{Op, Recorded, Tape, TapeError, record};
use num_dual::DualNum;
use proptest::prelude::*;

/// The derivatives of the first output by hyper-dual numbers: value, gradient and Hessian.
fn by_dual_numbers(tape: &Tape, x: &[f64]) -> (f64, Vec<f64>, Vec<f64>) {
    let n = x.len();
    let (mut value, mut df, mut hf) = (f64::NAN, vec![0.0; n], vec![0.0; n * n]);
    for i in 0..n {
        for j in 0..n {
            let part = |k, direction| if k == direction { 1.0 } else { 0.0 };
            let seeded: Vec<Real> =
                (0..n).map(|k| Real::new(x[k], part(k, i), part(k, j), 0.0)).collect();
            let mut y = [Real::from(0.0)];
            tape.evaluate(&seeded, &mut y);
            value = y[0].re;
            (df[i], hf[i * n + j]) = (y[0].eps1, y[0].eps1eps2);
        }
    }
    (value, df, hf)
}

/// The derivatives of the first output by sweeps.
fn by_sweeps(tape: &Tape, x: &[f64]) -> (f64, Vec<f64>, Vec<f64>) {
    let n = x.len();
    let (mut df, mut hf) = (vec![0.0; n], vec![0.0; n * n]);
    let value = tape.hessian(x, &mut df, &mut hf);
    (value, df, hf)
}

fn is_near(a: f64, b: f64, bound: f64) -> bool {
    a.to_bits() == b.to_bits() || (a - b).abs() <= bound
}

#[track_caller]
fn assert_near(a: &[f64], b: &[f64], bound: f64, what: &str) {
    for (k, (&a, &b)) in a.iter().zip(b).enumerate() {
        assert!(is_near(a, b, bound), "{what} {k}: {a:e} and {b:e}");
    }
}

#[test]
fn each_operation_has_the_derivatives_of_dual_numbers() {
    let constants = [0.0, 1.0, 2.0, 3.0, 5.0, -1.0, -2.0];
    let points = [[0.3, 0.7, -0.4], [0.9, -0.2, 1.4], [1.7, 2.3, 0.6], [-0.6, -1.2, 3.0]];
    let mut compared = 0;
    for &op in Op::ALL {
        let operands: Vec<[u32; 3]> = match op.operands() {
            0 => vec![[0, 0, 0]],
            1 => vec![[0, 0, 0], [1, 0, 0]],
            2 => vec![[0, 1, 0], [1, 0, 0], [2, 2, 0]],
            _ => vec![[0, 1, 2], [2, 0, 0], [1, 1, 1]],
        };
        for operands in operands {
            for &k in if op.has_constant() { &constants[..] } else { &[0.0] } {
                // Outside it the weight of the operation is not 1, and varies.
                let code = [
                    (op.code(), operands, k),
                    (Op::Sin.code(), [3, 0, 0], 0.0),
                    (Op::Multiplication.code(), [3, 4, 0], 0.0),
                ];
                let tape = Tape::from_parts(3, code, vec![5]).unwrap();
                for x in &points {
                    let (value, df, hf) = by_dual_numbers(&tape, x);
                    let numbers = [value].into_iter().chain(df.clone()).chain(hf.clone());
                    if numbers.clone().all(f64::is_finite) {
                        let bound = 1e-13 * numbers.fold(1.0, |most: f64, x| most.max(x.abs()));
                        let what = format!("{op:?} {operands:?} {k} at {x:?}");
                        let (y, dy, hy) = by_sweeps(&tape, x);
                        let mut slope = [f64::NAN; 3];
                        assert!(is_near(tape.gradient(x, &mut slope), value, bound), "{what}");
                        assert!(is_near(y, value, bound), "{what}: {y:e}, {value:e}");
                        assert_near(&slope, &df, bound, &what);
                        assert_near(&dy, &df, bound, &what);
                        assert_near(&hy, &hf, bound, &what);
                        compared += 1;
                    }
                }
            }
        }
    }
    assert!(compared > 700, "{compared} comparisons");
}

#[test]
fn slopes_keep_their_digits_at_the_edges() {
    let slopes = |op: Op, x: f64| {
        let tape = Tape::from_parts(1, [(op.code(), [0; 3], 0.0)], vec![1]).unwrap();
        let (_, df, _) = by_sweeps(&tape, &[x]);
        let mut slope = [f64::NAN];
        tape.gradient(&[x], &mut slope);
        [df[0], slope[0]]
    };
    let near = 1.0 - 2.0_f64.powi(-40);
    for (op, x, exact) in [
        (Op::ExpM1, -40.0, (-40.0_f64).exp()),
        (Op::Tanh, 30.0, 4.0 * (-60.0_f64).exp()),
        (Op::Tanh, 800.0, 0.0),
        (Op::Asin, near, 2.0_f64.powf(19.5)),
        (Op::Acos, near, -(2.0_f64.powf(19.5))),
        (Op::Atanh, near, 2.0_f64.powi(39)),
        (Op::Acosh, 2.0 - near, 2.0_f64.powf(19.5)),
    ] {
        for slope in slopes(op, x) {
            assert!(
                (slope - exact).abs() <= 1e-12 * exact.abs(),
                "{op:?}: {slope:e} and {exact:e}"
            );
        }
    }
}

#[test]
fn a_branch_that_is_not_taken_leaves_nothing() {
    // where(p > 0, √p, 0) at −1.
    let code = [
        (Op::Literal.code(), [0; 3], 0.0),
        (Op::Less.code(), [1, 0, 0], 0.0),
        (Op::Sqrt.code(), [0; 3], 0.0),
        (Op::Select.code(), [2, 3, 1], 0.0),
    ];
    let tape = Tape::from_parts(1, code, vec![4]).unwrap();
    for tape in [tape.simplified(), tape] {
        for x in [-1.0, 0.0] {
            assert_eq!(by_sweeps(&tape, &[x]), (0.0, vec![0.0], vec![0.0]));
            let mut slope = [f64::NAN];
            assert_eq!(tape.gradient(&[x], &mut slope), 0.0);
            assert_eq!(slope, [0.0]);
        }
        let (value, df, hf) = by_sweeps(&tape, &[4.0]);
        assert_eq!((value, df[0], hf[0]), (2.0, 0.25, -1.0 / 32.0));
    }
}

#[test]
fn a_weight_that_is_zero_at_the_point_alone_counts() {
    // x²y² at x = 0: the weight of x is zero, and its derivative is not.
    let tape = record(&[0.0, 3.0], |x| vec![x[0] * x[0] * (x[1] * x[1])]).unwrap();
    assert_eq!(by_sweeps(&tape, &[0.0, 3.0]), (0.0, vec![0.0; 2], vec![18.0, 0.0, 0.0, 0.0]));
    let mut lists = [[0.0; 2]; 2];
    let [df, hv] = &mut lists;
    tape.gradient_along(&[0.0, 3.0], &[2.0, 1.0], df, hv);
    assert_eq!(lists, [[0.0; 2], [36.0, 0.0]]);
}

#[test]
fn several_outputs_have_one_sweep_back() {
    let tape = record(&[1.0, 2.0], |x| vec![x[0] * x[1], x[0] + x[1], x[1], 7.0.into()]).unwrap();
    let (mut y, mut df) = ([0.0; 4], [0.0; 2]);
    tape.pull_back(&[3.0, 5.0], &[1.0, 10.0, 100.0, 1000.0], &mut y, &mut df);
    assert_eq!(y, [15.0, 8.0, 5.0, 7.0]);
    assert_eq!(df, [15.0, 113.0]);
}

#[test]
fn a_simplified_tape_is_short() {
    let text = |f: fn(&[Recorded]) -> Recorded| {
        let tape = record(&[0.3, 0.4], |x| vec![f(x)]).unwrap();
        tape.to_string().replace('\n', "; ")
    };
    assert_eq!(text(|x| x[0] + 0.0), "return r0");
    assert_eq!(text(|x| x[0] * 1.0 / 1.0 - 0.0), "return r0");
    assert_eq!(text(|x| -(-x[0])), "return r0");
    assert_eq!(text(|x| x[0] + (-x[1])), "r2 = sub(r0, r1); return r2");
    assert_eq!(text(|x| x[0] / 4.0), "r2 = mul(r0, 0.25); return r2");
    assert_eq!(text(|x| x[0] / 3.0), "r2 = div(r0, 3.0); return r2");
    assert_eq!(text(|x| x[0] * 0.0), "r2 = mul(r0, 0.0); return r2");
    assert_eq!(
        text(|x| x[0] * x[1] - x[1] * x[0]),
        "r2 = mul(r0, r1); r3 = sub(r2, r2); return r3"
    );
    assert_eq!(text(|x| x[0] + x[1] * 0.5), "r2 = scale_add(r1, r0, 0.5); return r2");
    assert_eq!(text(|x| x[0] - x[1] * 0.5), "r2 = scale_add(r1, r0, -0.5); return r2");
    assert_eq!(text(|x| x[0] + x[1] * x[0]), "r2 = mul_add(r0, r1, r0); return r2");
    let cube = "r2 = mul(r0, r0); r3 = mul(r0, r2); return r3";
    assert_eq!(text(|x| DualNum::powi(&x[0], 3)), cube);
    // An operation that no output needs, and one on a constant.
    assert_eq!(text(|x| (x[0].exp(), x[1]).1), "return r1");
    assert_eq!(
        text(|_| Recorded::from(2.0).sqrt()),
        "r2 = constant(1.4142135623730951); return r2"
    );
}

/// Numbers that are a tape of `inputs` inputs.
fn parts(inputs: u32) -> impl Strategy<Value = Vec<(u32, [u32; 3], f64)>> {
    let constant = prop_oneof![
        Just(0.0),
        Just(-0.0),
        Just(1.0),
        Just(-1.0),
        Just(2.0),
        Just(3.0),
        Just(-2.0),
        Just(0.25),
        Just(f64::INFINITY),
        Just(f64::NAN),
        -3.0..3.0_f64,
    ];
    let one = (proptest::sample::select(Op::ALL), any::<[u32; 3]>(), constant);
    proptest::collection::vec(one, 1..24).prop_map(move |list| {
        let mut parts = Vec::new();
        for (defined, (op, places, constant)) in (inputs..).zip(list) {
            let mut operands = [0; 3];
            for (operand, place) in operands.iter_mut().zip(places).take(op.operands()) {
                *operand = place % defined;
            }
            let constant = match op {
                Op::PowI if constant.is_finite() => constant.trunc() + 0.0,
                Op::PowI => 7.0,
                _ if op.has_constant() => constant,
                _ => 0.0,
            };
            parts.push((op.code(), operands, constant));
        }
        parts
    })
}

/// Returns whether two numbers are the same, where the signs of zero and the kinds of NaN do not count.
fn is_same(a: f64, b: f64) -> bool {
    a == b || (a.is_nan() && b.is_nan())
}

/// Compares the derivatives of the last register by sweeps with those by dual numbers, where the numbers are of the size of 1.
fn agree(parts: Vec<(u32, [u32; 3], f64)>, x: &[f64]) -> Result<(), TestCaseError> {
    let n = x.len();
    let registers: Vec<u32> = (0..).take(n + parts.len()).collect();
    let tape =
        Tape::from_parts(n, parts, registers[registers.len() - 1..].to_vec()).expect("a tape");
    // A condition may rest on a number that rounds differently at a dual number, so none is near zero.
    let mut numbers = vec![0.0; registers.len()];
    let (inputs, code, _) = tape.to_parts();
    Tape::from_parts(inputs, code, registers).expect("a tape").evaluate(x, &mut numbers);
    let size = numbers.iter().fold(1.0, |most: f64, y| most.max(y.abs()));
    let least = numbers.iter().fold(1.0, |least: f64, y| least.min(y.abs()));
    if size > 1e3 || least < 1e-3 {
        return Ok(());
    }
    let (value, df, hf) = by_dual_numbers(&tape, x);
    for tape in [tape.simplified(), tape] {
        let (y, dy, hy) = by_sweeps(&tape, x);
        let all = || df.iter().chain(&hf).chain(&dy).chain(&hy);
        if !all().all(|x| x.is_finite()) {
            continue;
        }
        let most = all().fold(size, |most: f64, x| most.max(x.abs()));
        let bound = 1e-8 * most * most;
        prop_assert!(is_near(y, value, bound), "{y:e} {value:e}\n{tape}");
        for (a, b) in dy.iter().chain(&hy).zip(df.iter().chain(&hf)) {
            prop_assert!(is_near(*a, *b, bound), "{a:e} and {b:e}\n{tape}");
        }
    }
    Ok(())
}

proptest! {
    // With eleven inputs the directions are more than those of one pair of sweeps.
    #[test]
    fn more_directions_than_lanes_agree_too(
        parts in parts(11),
        x in proptest::array::uniform11(0.2..1.8_f64),
    ) {
        agree(parts, &x)?;
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn a_simplified_tape_has_the_same_bits(
        parts in parts(3),
        x in proptest::array::uniform3(prop_oneof![-3.0..3.0_f64, Just(0.5), Just(f64::INFINITY)]),
    ) {
        let registers = 3 + parts.len();
        let tape = Tape::from_parts(3, parts, (0..).take(registers).collect()).unwrap();
        let simple = tape.simplified();
        prop_assert!(simple.code().len() <= 3 * tape.code().len());
        let (mut y, mut z) = (vec![0.0; registers], vec![0.0; registers]);
        tape.evaluate(&x, &mut y);
        simple.evaluate(&x, &mut z);
        // The sign of a zero may differ after `−0 + 0`, and then an infinity, an angle, a sign and all after it.
        let has_zero = y.contains(&0.0);
        for (k, (y, z)) in y.iter().zip(&z).enumerate() {
            prop_assert!(has_zero || is_same(*y, *z), "register {k}: {y:e} and {z:e}\n{tape}\n{simple}");
        }
        // Twice simplified is simplified.
        prop_assert_eq!(simple.simplified().code().len(), simple.code().len());
        // A recording of the tape is the same function; conditions ask for values.
        let asks = |op: Op| matches!(op, Op::Sign | Op::LogicalNot | Op::Min | Op::Max | Op::Less | Op::LessEqual
            | Op::Equal | Op::LogicalAnd | Op::LogicalOr | Op::Select);
        let again = record(&x, |x| {
            let mut y = vec![Recorded::from(0.0); registers];
            tape.evaluate(x, &mut y);
            y
        });
        if tape.code().iter().any(|one| asks(one.op)) {
            if let Ok(again) = again { prop_assert_eq!(again.outputs().len(), registers); }
        } else {
            let again = again.unwrap();
            again.evaluate(&x, &mut z);
            for (y, z) in y.iter().zip(&z) {
                prop_assert!(has_zero || is_same(*y, *z), "{y:e} and {z:e}\n{tape}\n{again}");
            }
        }
    }

    #[test]
    fn derivatives_are_those_of_dual_numbers(
        parts in parts(3),
        x in proptest::array::uniform3(0.2..1.8_f64),
    ) {
        agree(parts, &x)?;
    }

    #[test]
    fn any_numbers_are_a_tape_or_an_error(
        inputs in 0..4_usize,
        code in proptest::collection::vec((0..60_u32, proptest::array::uniform3(0..12_u32), any::<f64>()), 0..8),
        outputs in proptest::collection::vec(0..12_u32, 0..3),
    ) {
        if let Ok(tape) = Tape::from_parts(inputs, code, outputs) {
            let x = vec![0.5; inputs];
            let mut y = vec![Real::from(0.0); tape.outputs().len()];
            tape.evaluate(&vec![Real::from(0.5); inputs], &mut y);
            tape.simplified().evaluate(&vec![Real::from(0.5); inputs], &mut y);
            if tape.outputs().len() == 1 {
                by_sweeps(&tape, &x);
                by_sweeps(&tape.simplified(), &x);
            }
            prop_assert!(tape.to_string().ends_with(|c: char| c.is_ascii_digit()) || tape.outputs().is_empty());
        }
    }
}

#[test]
fn a_million_instructions_work() {
    // x ← x + sin(x)/4 + y, many times over.
    let steps = 250_000;
    let tape = record(&[0.1, 1e-6], |x| {
        let mut sum = x[0];
        for _ in 0..steps {
            sum = sum + sum.sin() * 0.25 + x[1];
        }
        vec![sum]
    })
    .unwrap();
    assert_eq!(tape.code().len(), 3 * steps);
    let (inputs, code, outputs) = tape.to_parts();
    let again = Tape::from_parts(inputs, code, outputs).unwrap();
    assert_eq!(again, tape);
    let mut slopes = [f64::NAN; 2];
    let value = again.gradient(&[0.1, 1e-6], &mut slopes);
    let (mut sum, mut along) = (0.1_f64, 0.0_f64);
    for _ in 0..steps {
        (sum, along) = (sum + sum.sin() * 0.25 + 1e-6, along * (1.0 + sum.cos() * 0.25) + 1.0);
    }
    assert_eq!(value, sum);
    assert!((slopes[1] - along).abs() < 1e-12 * along.abs(), "{slopes:?} and {along}");
    let constant = (Op::Literal.code(), [0; 3], 1.0);
    let long =
        Tape::from_parts(0, std::iter::repeat_n(constant, 1_000_000), vec![999_999]).unwrap();
    assert_eq!(long.simplified().code().len(), 1);
}

#[test]
fn an_error_is_a_sentence() {
    let error = Tape::from_parts(1, [(99, [0; 3], 0.0)], vec![]).unwrap_err();
    assert_eq!(error, TapeError::UnknownOperation { instruction: 0, code: 99 });
    assert_eq!(error.to_string(), "instruction 0 has the operation 99: the operations are 0 to 46");
}
