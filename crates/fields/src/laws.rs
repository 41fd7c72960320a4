//! The laws of a field, and the function that checks them.

use crate::{
    BrokenLaw, ChartPoint, Column, Dimension, Matrix, ScalarField, Space, Square, Vector,
    differential, hessian,
};

/// Checks a scalar field at `x` along the chart direction `v`:
///
/// 1. `jet1` and `jet2` agree with `at` and with nested dual numbers to round-off;
/// 2. `f(φ(tv)) − f − t df·v` falls like `t²`;
/// 3. `f(φ(tv)) − f − t df·v − ½t² vᵀHf v` falls like `t³`;
/// 4. `differential_at` and `hessian_at` agree with nested dual numbers at `v/16` in the chart at `x`.
///
/// # Errors
///
/// The first law that is broken.
pub fn scalar_field<M: Space>(
    f: &impl ScalarField<M>,
    x: &M::Point<f64>,
    v: &Vector<M>,
) -> Result<(), BrokenLaw> {
    let jet = f.jet2(x);
    let jet1 = f.jet1(x);
    let value: f64 = f.at(x);
    let centre = ChartPoint::centre(x);
    let hf: Matrix<M> = hessian(f, &centre);
    // A few operations on dual numbers have an error of a few ε of the largest part.
    let size = value.abs() + jet.df.magnitude() + jet.hf.max_abs();
    let bound = 200.0 * f64::EPSILON * M::Dim::LEN as f64 * size.max(f64::MIN_POSITIVE);
    BrokenLaw::unless("jet2 has the value of the field", (jet.value - value).abs(), bound)?;
    BrokenLaw::unless("jet1 has the value of the field", (jet1.value - value).abs(), bound)?;
    BrokenLaw::unless("jet1 and jet2 agree on df", (jet1.df - jet.df).magnitude(), bound)?;
    BrokenLaw::unless("the Hessian is the derivative of df", (hf - jet.hf).max_abs(), bound)?;

    let slope = jet.df.dot(v);
    let curvature = v.dot(&(jet.hf * *v));
    let one_sided = |t: f64, second: f64| {
        let shifted: f64 = f.at(&M::chart(x, &(*v * t)));
        (shifted - value - slope * t - second * t * t * 0.5).abs()
    };
    // One side, `a t² + b t³`, may be evaluated at its zero `t = −a/b`. Both sides together,
    // `2 max(|a| t², |b| t³)`, have no zero.
    let remainder = |t: f64, second: f64| one_sided(t, second) + one_sided(-t, second);
    let round_off = 100.0 * f64::EPSILON * (size + slope.abs() + curvature.abs());
    taylor_order("df is the derivative of the field", 2.0, round_off, |t| remainder(t, 0.0))?;
    taylor_order("Hf is the second derivative", 3.0, round_off, |t| remainder(t, curvature))?;

    let q = *v * (1.0 / 16.0);
    let there = ChartPoint::<M> { base: x.clone(), q };
    let (df, hf) = (differential(f, &there), hessian(f, &there));
    let (slope, bend) = (f.differential_at(x, &q), f.hessian_at(x, &q));
    let size = size + df.magnitude() + hf.max_abs();
    let bound = 400.0 * f64::EPSILON * M::Dim::LEN as f64 * size;
    BrokenLaw::unless("differential_at is the differential", (df - slope).magnitude(), bound)?;
    BrokenLaw::unless("hessian_at is the Hessian", (hf - bend).max_abs(), bound)
}

/// Checks that `remainder(t)` falls at least like `t^order` over `t = 2⁻⁴ … 2⁻¹²`, as far as it
/// stays above the `round_off`.
fn taylor_order(
    law: &'static str,
    order: f64,
    round_off: f64,
    remainder: impl Fn(f64) -> f64,
) -> Result<(), BrokenLaw> {
    let sizes: Vec<f64> = (4..=12)
        .map(|k| remainder(2.0_f64.powi(-k)))
        .take_while(|r| r.is_nan() || *r > 1e2 * round_off)
        .collect();
    // The finest pair above the round-off is the most asymptotic. If it starts at a zero of the remainder, the
    // next pair decides. A NaN in the finest pair stays.
    let orders = sizes.windows(2).rev().take(2).map(|pair| (pair[0] / pair[1]).log2());
    let Some(measured) = orders.reduce(|fine, coarse| if fine < coarse { coarse } else { fine })
    else {
        return Ok(());
    };
    BrokenLaw::unless(law, order - measured, 0.25)
}
