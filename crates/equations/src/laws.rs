//! The laws of an implementation of [`Equations`] and [`Model`], and the functions that check them.
//!
//! They tell whether an adapter answers what it is asked: each answer is compared with another one that follows from it.
//! Whether the model keeps the laws of a metriplectic system is what the [judge](crate::judge) says.

use crate::judge::{Derivatives, OF_SOLUTIONS, Row};
use crate::{
    BrokenLaw, Covectors, ENERGY, ENTROPY, Equations, Jet, Model, Part, Path, PathAt, PathSlopes,
    Paths, SecondLaw, Sizes,
};

/// The rest of terms that should cancel, relative to them: closures may lose some digits.
const CANCELS: f64 = 1e-9;

/// Checks a system at a state that is generic, along the direction `u`, which is to move each entry by some part of its size:
///
/// 1. every slice is filled; 2. `φ_x(0) = x`, and the coordinates of `φ_x(u)` are `u`; 3. the values of the differentials are
///    the values; 4. `⟨dF, u⟩` is the derivative of each law along `φ_x(su)`; 5. the velocity conserves the energy and
///    the further invariants, the production is not negative, and it is `⟨dS, x'⟩` of an
///    [exact](SecondLaw::Exact) second law; 6. `ψ_x(0) = x`, the rates
///    there are the velocity, the stage coordinates are the inverse of `ψ_x`, and the rates at `ψ_x(u)` are their derivative; 7. in a vector space both charts are `x + u`, the
///    rates in them are the velocity, and the sizes are `|x_i|`; 8. the power is the derivative of the energy along time.
///
/// The fifth law is that of a closed system.
///
/// # Errors
///
/// The first law that is broken.
pub fn equations(system: &dyn Equations, t: f64, x: &[f64], u: &[f64]) -> Result<(), BrokenLaw> {
    let Sizes { entries, directions: n, laws } = system.sizes();
    same("the state has its entries", x.len() as f64, entries as f64)?;
    same("the direction has as many numbers as the chart", u.len() as f64, n as f64)?;
    let (mut sizes, mut y, mut q) = (nan(n), nan(entries), nan(n));
    system.scales(x, &mut sizes);
    filled("the sizes of the entries", &sizes)?;
    system.chart(x, &vec![0.0; n], &mut y);
    near("φ_x(0) = x", &y, x)?;
    system.chart(x, u, &mut y);
    filled("the entries of φ_x(u)", &y)?;
    if system.coordinates(x, &y, &mut q) {
        near("φ_x⁻¹(φ_x(u)) = u", &q, u)?;
    }

    let (mut values, mut again, mut w) = (nan(laws), nan(laws), nan(laws * n));
    system.values(t, x, &mut values);
    system.differentials(t, x, &mut again, &mut w);
    filled("the values of all laws", &values)?;
    filled("the differentials of all laws", &w)?;
    for (law, row) in w.chunks_exact(n).enumerate() {
        same("the differentials come with the values", again[law], values[law])?;
        derivative("⟨dF, u⟩ is the derivative of F", &[dot(row, u)], &|s, to| {
            let mut y = nan(entries);
            system.chart(x, &scaled(u, s), &mut y);
            let mut values = nan(laws);
            system.values(t, &y, &mut values);
            to.push(values[law]);
        })?;
    }

    let unit = if t == 0.0 { 1.0 } else { t.abs() };
    derivative("∂_tH is the power", &[unit * system.power(t, x)], &|s, to| {
        let mut values = nan(laws);
        system.values(t + s * unit, x, &mut values);
        to.push(values[ENERGY]);
    })?;

    let (mut v, mut rates) = (nan(n), nan(n));
    let Some(production) = system.velocity(t, x, &mut v) else { return Ok(()) };
    filled("the velocity", &v)?;
    for (law, row) in w.chunks_exact(n).enumerate() {
        let (slope, terms) = (dot(row, &v), size_of(row, &v));
        if law == ENTROPY {
            BrokenLaw::unless("the production is not negative", -production, CANCELS * terms)?;
            if system.second_law() == SecondLaw::Exact {
                let size = (slope - production).abs();
                BrokenLaw::unless("⟨dS, x'⟩ is the production", size, CANCELS * terms)?;
            }
        } else {
            BrokenLaw::unless("the velocity conserves H and L_a", slope.abs(), CANCELS * terms)?;
        }
    }
    let still = vec![0.0; n];
    if system.stage_state(x, &still, &mut y) {
        near("ψ_x(0) = x", &y, x)?;
        system.stage_rates(x, &still, &y, &v, &mut rates);
        near("the rates at ψ_x(0) are the velocity", &rates, &v)?;
    }
    if system.stage_state(x, u, &mut y) {
        system.stage_coordinates(x, &y, &mut q);
        near("ψ_x⁻¹(ψ_x(u)) = u", &q, u)?;
        system.stage_rates(x, u, &y, &v, &mut rates);
        derivative(
            "the rates are the derivative of ψ_x⁻¹ along the velocity",
            &rates,
            &|s, to| {
                let (mut there, mut q) = (nan(entries), nan(n));
                system.chart(&y, &scaled(&v, s), &mut there);
                system.stage_coordinates(x, &there, &mut q);
                to.extend(q);
            },
        )?;
    }
    if system.is_vector_space() {
        same("a vector space has an entry in each direction", entries as f64, n as f64)?;
        let moved: Vec<f64> = x.iter().zip(u).map(|(x, u)| x + u).collect();
        system.chart(x, u, &mut y);
        near("φ_x(u) = x + u in a vector space", &y, &moved)?;
        system.stage_state(x, u, &mut y);
        near("ψ_x(u) = x + u in a vector space", &y, &moved)?;
        system.stage_rates(x, u, &y, &v, &mut rates);
        near("the rates of a vector space are the velocity", &rates, &v)?;
        let lengths: Vec<f64> = x.iter().map(|x| x.abs()).collect();
        near("the sizes of a vector space are |x_i|", &sizes, &lengths)?;
    }
    Ok(())
}

/// Checks a system whose parts are known apart in the same way:
///
/// 1. each law by itself has the values and differentials of all of them, and its Hessian is symmetric and the derivative of
///    the differential; 2. the columns of a tensor are the vectors of its part; 3. the derivatives of a part, of its tensor and of
///    the metric are those of their values; 4. the parts add up to the velocity, unless further invariants are projected out.
///
/// # Errors
///
/// The first law that is broken.
pub fn model(system: &dyn Model, t: f64, x: &[f64], u: &[f64]) -> Result<(), BrokenLaw> {
    let Sizes { directions: n, laws, .. } = system.sizes();
    let (mut values, mut w) = (nan(laws), nan(laws * n));
    system.differentials(t, x, &mut values, &mut w);
    for law in 0..laws {
        one_law(system, law, (t, x, u), (values[law], &w[law * n..][..n]))?;
    }

    let mut slopes = nan(n * n * n);
    if system.metric_slopes(x, &mut slopes) {
        let along: Vec<f64> = (0..n * n)
            .map(|entry| (0..n).map(|k| slopes[k * n * n + entry] * u[k]).sum())
            .collect();
        derivative("the slopes of the metric are its derivatives", &along, &|s, to| {
            let mut g = nan(n * n);
            system.metric(x, &scaled(u, s), &mut g);
            to.extend(g);
        })?;
    }

    if system.has_canonical_metric() {
        let mut g = nan(n * n);
        system.metric(x, &vec![0.0; n], &mut g);
        let one: Vec<f64> = (0..n * n).map(|k| if k % (n + 1) == 0 { 1.0 } else { 0.0 }).collect();
        near("a canonical metric is the identity", &g, &one)?;
    }

    let differentials = Covectors { energy: &w[..n], entropy: &w[n..2 * n] };
    let mut sum = vec![0.0; n];
    for (part, alpha) in [
        (Part::Reversible, differentials.energy),
        (Part::Gyroscopic, differentials.energy),
        (Part::Irreversible, differentials.entropy),
    ] {
        if system.is_zero(part) {
            continue;
        }
        let v = one_part(system, part, (t, x, u), differentials, alpha)?;
        sum.iter_mut().zip(v).for_each(|(sum, v)| *sum += v);
    }
    let mut velocity = nan(n);
    if laws == ENTROPY + 1 && system.velocity(t, x, &mut velocity).is_some() {
        near("the parts add up to the velocity", &sum, &velocity)?;
    }
    Ok(())
}

/// Checks the laws of the [`Paths`] of a model at a state `x`, for the unknown `u`, which a chart there reaches twice.
///
/// Laws: 1. the unknown zero stays at `x`; 2. the slopes are the derivatives of the path; 3. the curve starts at `x` with the velocity
/// `u` and ends where the path does, and its acceleration is the derivative of its velocity.
///
/// # Errors
///
/// The first law that is broken.
pub fn paths(
    system: &dyn Model,
    paths: &dyn Paths,
    path: Path,
    x: &[f64],
    u: &[f64],
) -> Result<(), BrokenLaw> {
    let Sizes { entries, directions: n, .. } = system.sizes();
    let exists = |_| BrokenLaw { law: "a path exists", size: f64::NAN, bound: 0.0 };
    let follow = |u: &[f64]| {
        let [mut z, mut d, mut end] = [nan(entries), nan(n), nan(entries)];
        let to = &mut PathAt { z: &mut z, d: &mut d, end: &mut end };
        paths.path(path, x, u, to).map(|()| [z, d, end])
    };
    let [z, d, end] = follow(&vec![0.0; n]).map_err(exists)?;
    near("the unknown zero stays", &z, x)?;
    near("the unknown zero stays", &end, x)?;
    near("the unknown zero stays", &d, &vec![0.0; n])?;

    let [mut z, mut d, mut end] = [nan(entries), nan(n), nan(entries)];
    let [mut dz, mut dd, mut dend] = [nan(n * n), nan(n * n), nan(n * n)];
    let to = &mut PathAt { z: &mut z, d: &mut d, end: &mut end };
    let slopes = &mut PathSlopes { dz: &mut dz, dd: &mut dd, dend: &mut dend };
    paths.path_jet(path, x, u, (to, slopes)).map_err(exists)?;
    let of_path = follow(u).map_err(exists)?;
    near("a path with slopes is the path", &[&z[..], &d, &end].concat(), &of_path.concat())?;
    let r: Vec<f64> = u.iter().rev().copied().collect();
    let along = |a: &[f64]| a.chunks_exact(n).map(|row| dot(row, &r)).collect::<Vec<_>>();
    let seen = |y: &[f64], from: &[f64], v: &[f64]| {
        let mut to = nan(n);
        paths.velocity_at(y, from, &vec![0.0; n], v, &mut to);
        to
    };
    let expected = [&dz, &dd, &dend].map(|a| along(a)).concat();
    derivative("slopes are the derivatives of a path", &expected, &|s, to| {
        let moved: Vec<f64> = u.iter().zip(&r).map(|(u, r)| u + s * r).collect();
        let Ok([there, turned, end_there]) = follow(&moved) else { return to.extend(nan(3 * n)) };
        let (mut q, mut q_end) = (nan(n), nan(n));
        system.coordinates(&z, &there, &mut q);
        system.coordinates(&end, &end_there, &mut q_end);
        to.extend(q.into_iter().chain(seen(&z, &there, &turned)).chain(q_end));
    })?;

    let curve = |t: f64| {
        let [mut y, mut v, mut a] = [nan(entries), nan(n), nan(n)];
        paths.curve(path, (x, u, t), &mut y, [&mut v, &mut a]).map(|()| [y, v, a])
    };
    let [start, v, _] = curve(0.0).map_err(exists)?;
    near("a curve starts at the state with the unknown as its velocity", &start, x)?;
    near("a curve starts at the state with the unknown as its velocity", &v, u)?;
    near("a curve ends where its path does", &curve(1.0).map_err(exists)?[0], &end)?;
    let [y, _, a] = curve(0.6).map_err(exists)?;
    derivative("the acceleration is the derivative of the velocity", &a, &|s, to| match curve(
        0.6 + s,
    ) {
        Ok([there, v, _]) => to.extend(seen(&y, &there, &v)),
        Err(_) => to.extend(nan(n)),
    })
}

/// Checks one law of a model.
fn one_law(
    system: &dyn Model,
    law: usize,
    (t, x, u): (f64, &[f64], &[f64]),
    (value, row): (f64, &[f64]),
) -> Result<(), BrokenLaw> {
    let n = u.len();
    let (mut df, mut second, mut hf) = (nan(n), nan(n), nan(n * n));
    same("a law by itself has its value", system.value(law, t, x), value)?;
    same("a differential comes with its value", system.jet(law, t, x, &mut df), value)?;
    near("a law by itself has its differential", &df, row)?;
    let beside = system.hessian(law, t, x, &mut second, &mut hf);
    near("a Hessian comes with its value and differential", &second, row)?;
    near("a Hessian comes with its value and differential", &[beside], &[value])?;
    filled("the Hessian", &hf)?;
    let transposed: Vec<f64> = (0..n * n).map(|k| hf[k % n * n + k / n]).collect();
    near("a Hessian is symmetric", &hf, &transposed)?;
    let along: Vec<f64> = hf.chunks_exact(n).map(|row| dot(row, u)).collect();
    let v: Vec<f64> = u.iter().rev().copied().collect();
    let expected = [value, dot(&df, u), dot(&df, &v), dot(&along, &v)];
    near(
        "a law along two vectors has its derivatives",
        &system.along(law, t, x, [u, &v]),
        &expected,
    )?;
    derivative("a Hessian is the derivative of the differential", &along, &|s, to| {
        let mut df = nan(n);
        system.differential_at(law, t, x, &scaled(u, s), &mut df);
        to.extend(df);
    })
}

/// Checks one part of a model, and returns its vector.
fn one_part(
    system: &dyn Model,
    part: Part,
    (t, x, u): (f64, &[f64], &[f64]),
    w: Covectors<'_>,
    alpha: &[f64],
) -> Result<Vec<f64>, BrokenLaw> {
    let n = u.len();
    let exists = |_| BrokenLaw { law: "a part exists", size: f64::NAN, bound: 0.0 };
    let still = vec![0.0; n];
    let apply = |q: &[f64], w: Covectors<'_>, alpha: &[f64]| {
        let mut v = nan(n);
        system.apply(part, t, (x, q), w, alpha, &mut v).map(|()| v)
    };
    let v = apply(&still, w, alpha).map_err(exists)?;
    filled("the vector of a part", &v)?;
    let [mut value, mut along_x, mut along_w, mut slopes] = [n, n * n, n * n, n * n].map(nan);
    let mut jet = Jet {
        value: &mut value,
        along_x: &mut along_x,
        along_w: &mut along_w,
        tensor: &mut slopes,
    };
    system.linearise(part, t, x, w, alpha, &mut jet).map_err(exists)?;
    near("derivatives come with the vector of a part", &value, &v)?;
    let of = |matrix: &[f64]| matrix.chunks_exact(n).map(|row| dot(row, u)).collect::<Vec<_>>();
    derivative("along_x is the derivative along the state", &of(&along_x), &|s, to| {
        to.extend(apply(&scaled(u, s), w, alpha).unwrap_or_else(|_| nan(n)));
    })?;
    // The covector that the part depends on, beside what the tensor says.
    let covector = if part == Part::Irreversible { w.energy } else { w.entropy };
    let turned: Vec<f64> =
        covector.iter().enumerate().map(|(i, c)| c * (1.0 + i as f64).sin()).collect();
    let along: Vec<f64> = along_w.chunks_exact(n).map(|row| dot(row, &turned)).collect();
    derivative("along_w is the derivative along a covector", &along, &|s, to| {
        let moved: Vec<f64> = covector.iter().zip(&turned).map(|(c, d)| c + s * d).collect();
        let w = if part == Part::Irreversible {
            Covectors { energy: &moved, ..w }
        } else {
            Covectors { entropy: &moved, ..w }
        };
        to.extend(apply(&still, w, alpha).unwrap_or_else(|_| nan(n)));
    })?;
    if part == Part::Gyroscopic {
        return Ok(v);
    }
    if part == Part::Irreversible {
        let mut slope = nan(n * n);
        let depends = system.friction_along_entropy(t, x, w, alpha, &mut slope).map_err(exists)?;
        let turned: Vec<f64> =
            w.entropy.iter().enumerate().map(|(i, c)| c * (1.0 + i as f64).sin()).collect();
        let along = if depends {
            slope.chunks_exact(n).map(|row| dot(row, &turned)).collect()
        } else {
            vec![0.0; n]
        };
        derivative("a friction has its derivative along the entropy", &along, &|s, to| {
            let moved: Vec<f64> = w.entropy.iter().zip(&turned).map(|(c, d)| c + s * d).collect();
            let w = Covectors { entropy: &moved, ..w };
            to.extend(apply(&still, w, alpha).unwrap_or_else(|_| nan(n)));
        })?;
    }
    let mut tensor = nan(n * n);
    system.tensor(part, t, x, w, &mut tensor).map_err(exists)?;
    near("the derivative along α is the tensor", &slopes, &tensor)?;
    let product: Vec<f64> = tensor.chunks_exact(n).map(|row| dot(row, alpha)).collect();
    near("the columns of a tensor are the vectors of its part", &product, &v)?;
    if part == Part::Reversible {
        bracket_slopes(system, (t, x, u), w, alpha)?;
    }
    Ok(v)
}

/// Checks the derivatives of the bracket along a direction and the covector of the entropy.
fn bracket_slopes(
    system: &dyn Model,
    (t, x, u): (f64, &[f64], &[f64]),
    w: Covectors<'_>,
    alpha: &[f64],
) -> Result<(), BrokenLaw> {
    let n = u.len();
    let exists = |_| BrokenLaw { law: "the bracket has derivatives", size: f64::NAN, bound: 0.0 };
    let ds: Vec<f64> =
        w.entropy.iter().enumerate().map(|(i, s)| s * (2.0 + i as f64).sin()).collect();
    let (mut of_tensor, mut of_vector) = (nan(n * n), nan(n));
    let along = [u, &ds];
    system.bracket_slope(t, x, along, w.entropy, &mut of_tensor).map_err(exists)?;
    system.bracket_slope_of(t, x, along, w.entropy, alpha, &mut of_vector).map_err(exists)?;
    let product: Vec<f64> = of_tensor.chunks_exact(n).map(|row| dot(row, alpha)).collect();
    near("the slope of Π α is that of Π", &product, &of_vector)?;
    derivative("the slope of the bracket is its derivative", &of_vector, &|s, to| {
        let moved: Vec<f64> = w.entropy.iter().zip(&ds).map(|(c, d)| c + s * d).collect();
        let mut v = nan(n);
        let w = Covectors { entropy: &moved, ..w };
        let place = (x, &scaled(u, s)[..]);
        let applied = system.apply(Part::Reversible, t, place, w, alpha, &mut v);
        to.extend(applied.map_or_else(|_| nan(n), |()| v));
    })
}

fn nan(count: usize) -> Vec<f64> {
    vec![f64::NAN; count]
}

fn scaled(u: &[f64], s: f64) -> Vec<f64> {
    u.iter().map(|u| u * s).collect()
}

fn dot(alpha: &[f64], v: &[f64]) -> f64 {
    alpha.iter().zip(v).map(|(a, v)| a * v).sum()
}

fn size_of(alpha: &[f64], v: &[f64]) -> f64 {
    alpha.iter().zip(v).map(|(a, v)| (a * v).abs()).sum()
}

/// Numbers that are the same, bit for bit but for the sign of zero.
fn same(law: &'static str, found: f64, expected: f64) -> Result<(), BrokenLaw> {
    BrokenLaw::unless(law, (found - expected).abs(), 0.0)
}

/// Slices that hold no number of before.
fn filled(law: &'static str, numbers: &[f64]) -> Result<(), BrokenLaw> {
    let left = numbers.iter().filter(|number| number.is_nan()).count();
    BrokenLaw::unless(law, left as f64, 0.0)
}

/// Slices that are the same up to the round-off of their largest number.
fn near(law: &'static str, found: &[f64], expected: &[f64]) -> Result<(), BrokenLaw> {
    let size = expected.iter().chain(found).fold(0.0_f64, |most, number| most.max(number.abs()));
    let off = found.iter().zip(expected).map(|(a, b)| (a - b).abs());
    let worst = off.fold(0.0_f64, |most, off| if off.is_nan() { off } else { most.max(off) });
    BrokenLaw::unless(law, worst, CANCELS * size)
}

/// Derivatives at 0 of the numbers that a function of one parameter appends.
fn derivative(
    law: &'static str,
    df: &[f64],
    values: &dyn Fn(f64, &mut Row),
) -> Result<(), BrokenLaw> {
    let largest = df.iter().fold(0.0_f64, |most, df| most.max(df.abs()));
    let unit = if largest > 0.0 { largest } else { 1.0 };
    let derivatives = Derivatives {
        scale: 1.0,
        df: Row::from_slice(df),
        units: Row::from_elem(unit, df.len()),
        rounding: OF_SOLUTIONS,
    };
    let mismatch = derivatives.compare(&|s, to| {
        values(s, to);
        Some(())
    });
    mismatch.map_or(Ok(()), |found| {
        let (size, bound) = ((found.derivative - found.quotient).abs(), CANCELS * largest);
        Err(BrokenLaw { law, size, bound })
    })
}
