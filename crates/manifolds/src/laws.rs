//! The laws of manifolds, metrics and retractions, and the functions that check them.
//!
//! One line checks a manifold, metric or retraction, of your own or of this crate.

use approx::AbsDiffEq;
use metriplectic_fields::{
    BrokenLaw, ChartPoint, Column, Dimension, Matrix, Square, Vector, jacobian,
};
use num_dual::{Dual, Dual64};

use crate::metric::MetricError;
use crate::{InnerProduct, Manifold, Retraction, Riemannian, Tangent};

/// The round-off of a few operations on numbers of size `scale`.
fn round_off<M: Manifold>(scale: f64) -> f64 {
    64.0 * M::Dim::LEN as f64 * f64::EPSILON * scale
}

/// The size of the coordinates of the chart at `x`, which have another unit than the entries of `x` on a
/// half line.
fn chart_size<M: Manifold>(x: &M::Point<f64>) -> f64 {
    M::scales(x).magnitude()
}

/// A length of the chart at `x` without its unit.
fn pure<M: Manifold>(x: &M::Point<f64>, length: f64) -> f64 {
    let size = chart_size::<M>(x);
    if size > 0.0 { length / size } else { 0.0 }
}

/// Checks a manifold at `x`, with coordinates `q` inside the domain of the chart:
///
/// 1. `φ_x(0) = x`;
/// 2. `φ_x⁻¹(φ_x(q)) = q`, and the chain rule gives the identity at dual numbers;
/// 3. `seeds` are the chart at dual numbers; 4. `φ_x(q)` lies on the manifold; 5. a point read from
///    its entries is that point, bit for bit; 6. the chart of the stages begins at `x` in the frame of `φ_x`, and
///    has the inverse and the rates that it says.
///
/// # Errors
///
/// The first law that is broken.
pub fn manifold<M: Manifold>(space: &M, x: &M::Point<f64>, q: &Vector<M>) -> Result<(), BrokenLaw> {
    let bound = round_off::<M>(chart_size::<M>(x) + q.magnitude());
    let pure = round_off::<M>(1.0 + pure::<M>(x, q.magnitude()));
    let distance = |a: &M::Point<f64>, b: &M::Point<f64>| {
        let difference = M::entries(a).into_iter().zip(M::entries(b)).map(|(a, b)| (a - b).abs());
        difference.fold(0.0, f64::max)
    };
    let origin = M::chart(x, &Vector::<M>::zero());
    BrokenLaw::unless("φ_x(0) = x", distance(&origin, x), round_off::<M>(M::magnitude(x)))?;
    let y: M::Point<f64> = M::chart(x, q);
    let back = M::coordinates(x, &y);
    BrokenLaw::unless("φ_x⁻¹(φ_x(q)) = q", (back - *q).magnitude(), bound)?;
    let there_and_back = jacobian::<M, f64>(|q| M::coordinates(x, &M::chart::<Dual<f64>>(x, q)), q);
    let error = (there_and_back - Matrix::<M>::one()).max_abs();
    BrokenLaw::unless("the derivative of φ_x⁻¹ φ_x is 1", error, pure)?;
    for i in 0..=M::Dim::LEN {
        for j in 0..=M::Dim::LEN {
            let seed = M::coordinates(x, &M::seeds(x)(i, j));
            let expected = |k, direction| if k == direction { 1.0 } else { 0.0 };
            let error = (0..M::Dim::LEN).fold(0.0_f64, |worst, k| {
                let (a, b) = (seed[k].eps1 - expected(k, i), seed[k].eps2 - expected(k, j));
                worst.max(a.abs()).max(b.abs()).max(seed[k].eps1eps2.abs())
            });
            BrokenLaw::unless("seeded points are the chart at its seeds", error, pure)?;
        }
    }
    stage_chart::<M>(x, q)?;
    let allowed = round_off::<M>(M::magnitude(&y));
    BrokenLaw::unless("chart points lie on the manifold", space.defect(&y), allowed)?;
    let entries = M::entries(&y);
    let mut left = entries.iter().copied();
    let read = M::entries(&M::assemble(&mut || left.next().unwrap_or(f64::NAN)));
    let same = left.next().is_none()
        && read.len() == entries.len()
        && read.iter().zip(&entries).all(|(a, b)| a.to_bits() == b.to_bits());
    let error = if same { 0.0 } else { f64::INFINITY };
    BrokenLaw::unless("a point is what its entries make", error, 0.0)
}

/// Checks the chart of the stages of explicit methods: `ψ_x(0) = x`, its inverse, and the rates, also those of
/// the frame at `x`.
fn stage_chart<M: Manifold>(x: &M::Point<f64>, q: &Vector<M>) -> Result<(), BrokenLaw> {
    if !M::is_stage(q) {
        return Ok(());
    }
    let origin = Vector::<M>::zero();
    let back = M::stage_coordinates(x, &M::stage(x, &origin)).magnitude();
    BrokenLaw::unless("ψ_x(0) = x", back, round_off::<M>(chart_size::<M>(x)))?;
    // The condition number of a chart that reaches far grows with the square of its coordinates.
    let far = 1.0 + pure::<M>(x, q.magnitude()).powi(2);
    let bound = round_off::<M>(chart_size::<M>(x) + q.magnitude()) * far;
    let y = M::stage(x, q);
    let error = (M::stage_coordinates(x, &y) - *q).magnitude();
    BrokenLaw::unless("ψ_x⁻¹(ψ_x(q)) = q", error, bound)?;
    for k in 0..M::Dim::LEN {
        let v = Vector::<M>::basis(k);
        let here = (M::stage_rates(x, (&origin, x), &v) - v).magnitude();
        BrokenLaw::unless("ψ_x has the frame of φ_x", here, round_off::<M>(1.0))?;
        // The rates by differences of fourth order along φ_y(εv), which is exact to ε⁴ of their size.
        let step = 1e-3 * chart_size::<M>(x);
        if step == 0.0 {
            continue;
        }
        let at = |t: f64| M::stage_coordinates(x, &M::chart(&y, &(v * (t * step))));
        let slope = ((at(1.0) - at(-1.0)) * 8.0 - (at(2.0) - at(-2.0))) * (1.0 / (12.0 * step));
        let error = (M::stage_rates(x, (q, &y), &v) - slope).magnitude();
        BrokenLaw::unless("q' is the derivative of ψ_x⁻¹", error, 1e-9 * far * far)?;
    }
    Ok(())
}

/// Checks a metric at `x` along the tangent vector `v`:
///
/// 1. `g` is symmetric; 2. `♯♭v = v` and `♭` is the matrix; 3. `G(v, v) > 0`, and equals
///    `|L⁻¹♭v|²`; 4. `exp_x(0) = x`; 5. the geodesic along `v` has constant speed; 6. its connection is
///    without torsion, `Γ^k_{ij} = Γ^k_{ji}`, and it has the acceleration `−Γ(v, v)`.
///
/// # Errors
///
/// The first law that is broken.
pub fn metric<M: Manifold, G: Riemannian<M>>(
    metric: &G,
    x: &M::Point<f64>,
    v: &Vector<M>,
) -> Result<(), BrokenLaw> {
    let centre = ChartPoint::<M>::centre(x);
    let g: Matrix<M> = metric.matrix(&centre);
    let asymmetry = Matrix::<M>::from_entries(|i, j| g[(i, j)] - g[(j, i)]).max_abs();
    BrokenLaw::unless("g is symmetric", asymmetry, round_off::<M>(g.max_abs()))?;
    let at = usable("g is positive", metric.at(&centre))?;
    let flat = at.flat(v);
    // The condition number of g enters the round-off of ♯♭.
    let bound = round_off::<M>(v.magnitude()) * condition::<M>(&g);
    BrokenLaw::unless("♯♭v = v", (at.sharp(&flat) - *v).magnitude(), bound)?;
    BrokenLaw::unless(
        "♭v = g v",
        (g * *v - flat).magnitude(),
        round_off::<M>(g.max_abs() * v.magnitude()),
    )?;
    let square = flat.dot(v);
    BrokenLaw::unless("G(v, v) > 0", -square, 0.0)?;
    let orthonormal = at.orthonormal(&flat).magnitude().powi(2);
    let error = relative(orthonormal - square, square);
    BrokenLaw::unless("|L⁻¹♭v|² = G(v, v)", error, round_off::<M>(1.0) * condition::<M>(&g))?;

    let volume = usable("√det g is finite", G::volume_density(&at))?;
    let root = g.root_determinant().map_err(|_| BrokenLaw {
        law: "g is positive",
        size: f64::NAN,
        bound: 0.0,
    })?;
    let error = (volume / root - 1.0).abs();
    BrokenLaw::unless(
        "the volume form is √det g",
        error,
        round_off::<M>(1.0) * condition::<M>(&g),
    )?;

    let (start, _) = usable("geodesics exist", metric.exp(&centre, &Vector::<M>::zero()))?;
    let moved = M::coordinates(x, &start.point()).magnitude();
    BrokenLaw::unless("exp_x(0) = x", moved, round_off::<M>(chart_size::<M>(x)))?;
    let (end, velocity) = usable("geodesics exist", metric.exp(&centre, v))?;
    let there = usable("g is positive", metric.at(&end))?;
    let speed = there.flat(&velocity).dot(&velocity);
    // Numerical geodesics have an error of 10⁻¹³ of the momentum in each piece. In p·g⁻¹p the condition
    // number of g multiplies it.
    let error = relative(speed - square, square);
    let bound = 1e-11 * condition::<M>(&g).max(condition::<M>(&metric.matrix(&end)));
    BrokenLaw::unless("geodesics have constant speed", error, bound)?;

    let symbols = usable("g is positive", metric.christoffel(x))?;
    let begin = M::coordinates(x, &usable("geodesics exist", metric.along(x, v, 0.0))?);
    let (mut torsion, mut turn, mut size) = (0.0_f64, 0.0_f64, 0.0_f64);
    for k in 0..M::Dim::LEN {
        let gamma: &Matrix<M> = &symbols[k];
        let skew = Matrix::<M>::from_entries(|i, j| gamma[(i, j)] - gamma[(j, i)]);
        torsion = torsion.max(skew.max_abs());
        turn = turn.max((begin[k].eps1eps2 + v.dot(&(*gamma * *v))).abs());
        size = size.max(gamma.max_abs());
    }
    // Symbols that are round-off have the size of g⁻¹ ∂g over the size of the chart.
    size += pure::<M>(x, 1.0);
    let bound = round_off::<M>(size) * condition::<M>(&g);
    BrokenLaw::unless("the connection has no torsion", torsion, bound)?;
    let bound = round_off::<M>(size * square_of(v)) * condition::<M>(&g);
    BrokenLaw::unless("geodesics have the acceleration −Γ(v, v)", turn, bound)
}

/// `|v|²` in components.
fn square_of<V: Column<f64>>(v: &V) -> f64 {
    v.dot(v)
}

/// Checks a retraction at `x` with the displacement `u`:
///
/// 1. `R_h⁻¹(R_h(d)) = d`; 2. the path from `x` is the pair of its own `(z, d)`; 3. `real_step_path` is the same
///    path, and `step_path_jet` the derivative of `path` at dual numbers; 4. consistency, `x' − x = d + O(|d|²)`.
///
/// # Errors
///
/// The first law that is broken.
pub fn retraction<M: Manifold, G: Riemannian<M>, R: Retraction<M, G>>(
    retraction: &R,
    metric: &G,
    x: &M::Point<f64>,
    u: &Vector<M>,
) -> Result<(), BrokenLaw> {
    let exists = "the retraction is defined";
    let apart = |t: f64| {
        let tangent = Tangent::<M> { base: x.clone(), vector: *u * t };
        let (start, end) = usable(exists, retraction.pair(metric, &tangent))?;
        Ok((M::coordinates(x, &end) - M::coordinates(x, &start) - tangent.vector).magnitude())
    };
    // Of second order it is a hundredth on a tenth of the way, of first order a tenth.
    let round_off = round_off::<M>(chart_size::<M>(x));
    BrokenLaw::unless("x' − x = d + O(|d|²)", apart(1e-3)?, 0.05 * apart(1e-2)? + round_off)?;
    let bound = 1e-12 * (chart_size::<M>(x) + u.magnitude());
    let jet = usable(exists, retraction.step_path_jet(metric, x, u))?;
    let tangent = Tangent { base: jet.z.clone(), vector: jet.d };
    let (start, end) = usable(exists, retraction.pair(metric, &tangent))?;
    let error = M::coordinates(x, &start).magnitude();
    BrokenLaw::unless("the path starts where its pair does", error, bound)?;
    let error = M::coordinates(&jet.end, &end).magnitude();
    BrokenLaw::unless("the path ends where its pair does", error, bound)?;
    let alone: M::Point<f64> = usable(exists, retraction.end(metric, x, u))?;
    let error = M::coordinates(&jet.end, &alone).magnitude();
    BrokenLaw::unless("the end alone is the end of the path", error, bound)?;
    let real = usable(exists, retraction.real_step_path(metric, x, u))?;
    let error = M::coordinates(&jet.z, &real.z.point()).magnitude();
    BrokenLaw::unless("the real path has the base point of its jet", error, bound)?;
    let error = (real.d - jet.d).magnitude() + M::coordinates(&jet.end, &real.end).magnitude();
    BrokenLaw::unless("the real path is that of its jet", error, bound)?;
    let back = usable(exists, retraction.inverse(metric, &start, &end))?;
    same("R_h⁻¹ R_h = 1", &back, &tangent, bound)?;

    for k in 0..M::Dim::LEN {
        let seeded =
            Vector::<M, Dual64>::from_index(|i| Dual64::new(u[i], if i == k { 1.0 } else { 0.0 }));
        let path = usable(exists, retraction.step_path(metric, x, &seeded))?;
        let end = M::coordinates(&jet.end, &path.end);
        let z = M::coordinates(&jet.z, &path.z.point());
        let error = |dual: &Vector<M, Dual64>, slope: &Matrix<M>| {
            let column = Vector::<M>::from_index(|i| dual[i].eps - slope[(i, k)]);
            column.magnitude()
        };
        // The two numerical geodesics have different steps. The variational equations grow along the way, and
        // the steps are not chosen for them.
        let bound = 1e-10 * (1.0 + pure::<M>(x, u.magnitude()));
        BrokenLaw::unless("∂z/∂u is the derivative of z", error(&z, &jet.dz), bound)?;
        BrokenLaw::unless("∂d/∂u is the derivative of d", error(&path.d, &jet.dd), bound)?;
        BrokenLaw::unless("∂x'/∂u is the derivative of x'", error(&end, &jet.dend), bound)?;
    }
    Ok(())
}

/// Checks that a retraction is symmetric: the swapped pair has the same base point and the
/// opposite displacement. [`Exponential`](crate::Exponential) is not.
///
/// # Errors
///
/// The first law that is broken.
pub fn symmetric_retraction<M: Manifold, G: Riemannian<M>, R: Retraction<M, G>>(
    retraction: &R,
    metric: &G,
    x: &M::Point<f64>,
    y: &M::Point<f64>,
) -> Result<(), BrokenLaw> {
    let exists = "the retraction is defined";
    let there = usable(exists, retraction.inverse(metric, x, y))?;
    let back = usable(exists, retraction.inverse(metric, y, x))?;
    let bound = 1e-12 * (chart_size::<M>(x) + there.vector.magnitude());
    let opposite = Tangent { vector: -back.vector, ..back };
    same("R_h⁻¹(y, x) is the opposite of R_h⁻¹(x, y)", &opposite, &there, bound)
}

/// Compares two tangent vectors, base points and components.
fn same<M: Manifold>(
    law: &'static str,
    a: &Tangent<M>,
    b: &Tangent<M>,
    bound: f64,
) -> Result<(), BrokenLaw> {
    if a.abs_diff_eq(b, bound) {
        return Ok(());
    }
    let apart = M::coordinates(&a.base, &b.base).magnitude();
    Err(BrokenLaw { law, size: apart.max((a.vector - b.vector).magnitude()), bound })
}

/// Computes `|difference| / size`; 0 if the difference is 0.
fn relative(difference: f64, size: f64) -> f64 {
    if difference == 0.0 { 0.0 } else { difference.abs() / size }
}

/// Converts the error of a metric into the law that the metric exists.
fn usable<T>(law: &'static str, result: Result<T, MetricError>) -> Result<T, BrokenLaw> {
    result.map_err(|_| BrokenLaw { law, size: f64::NAN, bound: 0.0 })
}

/// The condition number of `g`, estimated by its entries and those of its inverse.
fn condition<M: Manifold>(g: &Matrix<M>) -> f64 {
    let inverse = (0..M::Dim::LEN)
        .map(|k| g.solve(&Vector::<M>::basis(k)).map_or(f64::INFINITY, |x| x.magnitude()));
    g.max_abs() * inverse.fold(1.0, f64::max)
}

#[cfg(test)]
mod tests;
