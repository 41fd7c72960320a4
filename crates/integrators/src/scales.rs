//! The sizes of the entries of a state in the course of a run.
//!
//! The entries of a state have units of their own: lengths of 10⁻⁹ stand beside temperatures of 300. An
//! error is judged entry by entry, relative to a size `s_i` for each direction of the chart: the largest
//! `|x_i|` of the run so far ([`Manifold::scales`]). On a curved factor all directions have the one size of
//! the factor.
//!
//! An entry that starts at zero has no size yet. It gets the one that it reaches soon: with `v = f(x)`,
//! `a = f'(x) v` and the nonlinear part `r = f(δv) − v − δa`,
//!
//! ```math
//! s_i = \max\bigl(|x_i|, \; \delta |v_i|, \; \tfrac12\delta^2 |a_i|, \; \tfrac13\delta |r_i| \bigr) .
//! ```
//!
//! `δ` is a quarter of the shortest time of the motion, of the span of the run, `1/|f'_ii|` and
//! `1/√|f'_ij f'_ji|`, which no unit of an entry changes. It is cut until `r` grows no faster than a power
//! of `δ`, so that a steep wall on the way does not count.
//!
//! An entry may also stay at zero because its forces cancel, and has no size then. Its velocity is noise of
//! the size `ε t_i`, where `t_i = Σ_j (|Π_ij||∂_jH| + |K_ij||∂_jS| + |f'_ij||x_j|)` is the size of the
//! terms that it is summed of. Noise is no error of a step, and no speed.
//!
//! No number with a unit stands in these formulas: if each entry is written in another unit that is a power
//! of two, the sizes are the same numbers in these units.

use metriplectic_dynamics::velocity::differentials;
use metriplectic_dynamics::{Bracket, Dissipation, Metriplectic, system::Point};
use metriplectic_fields::{
    ChartPoint, Column, Dimension, Matrix, Scalar, Space, Square, Vector, jacobian,
};
use metriplectic_manifolds::Manifold;

/// The sizes of the entries so far, and those of the terms of their velocities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scales<N: Dimension> {
    pub(crate) sizes: N::Vector<f64>,
    pub(crate) terms: N::Vector<f64>,
}

impl<N: Dimension> Scales<N> {
    /// Nothing is known.
    pub(crate) fn zero() -> Self {
        Self { sizes: Column::zero(), terms: Column::zero() }
    }

    /// The sizes at `x`, where a run starts that lasts `span`, or where entries begin to move.
    pub(crate) fn at<Y>(system: &Y, x: &Point<Y>, span: f64) -> Self
    where
        Y: Metriplectic,
        Y::Manifold: Space<Dim = N>,
    {
        let sizes = Y::Manifold::scales(x);
        match reach(system, x, span) {
            Some(reached) => reached.or(&sizes),
            None => Self { sizes, ..Self::zero() },
        }
    }

    /// These sizes, or the ones of another state where they are larger.
    pub(crate) fn or(&self, sizes: &N::Vector<f64>) -> Self {
        Self { sizes: larger(&self.sizes, sizes), ..*self }
    }

    /// The larger ones of two.
    pub(crate) fn and(&self, other: &Self) -> Self {
        Self { terms: larger(&self.terms, &other.terms), ..self.or(&other.sizes) }
    }

    /// What rounding may make of a displacement in the time `h`.
    pub(crate) fn noise(&self, h: f64) -> N::Vector<f64> {
        self.terms * (16.0 * f64::EPSILON * h)
    }

    /// The norm of the velocity relative to the sizes, without what is noise.
    pub(crate) fn speed(&self, v: &N::Vector<f64>) -> f64 {
        let noise = self.noise(1.0);
        let above = Column::from_index(|i| if v[i].abs() <= noise[i] { 0.0 } else { v[i] });
        relative(&above, &self.sizes)
    }
}

/// The larger one of two sizes, entry by entry.
pub(crate) fn larger<V: Column<f64>>(a: &V, b: &V) -> V {
    V::from_index(|i| a[i].max(b[i]))
}

/// The Euclidean norm of the ratios `v_i/s_i`, without a unit, where `0/0 = 0`: a bound of each of them
/// that no rotation of the frame of a curved factor changes.
pub(crate) fn relative<V: Column<f64>>(v: &V, sizes: &V) -> f64 {
    let ratios = V::from_index(|i| if v[i] == 0.0 { 0.0 } else { (v[i] / sizes[i]).abs() });
    // Squares of 10⁻²⁰⁰ are zero; those of numbers up to 1 are not too large.
    let mut largest = 0.0;
    for i in 0..V::LEN {
        if ratios[i].is_nan() {
            return f64::NAN;
        }
        largest = f64::max(largest, ratios[i]);
    }
    if largest > 0.0 && largest.is_finite() {
        largest * (ratios * largest.recip()).magnitude()
    } else {
        largest
    }
}

/// The velocity at `x`, and the sizes of what it is summed of; `None` if it cannot be evaluated there.
pub(crate) fn velocity_and_terms<Y: Metriplectic>(
    system: &Y,
    x: &Point<Y>,
) -> Option<[Vector<Y::Manifold>; 2]> {
    let v = velocity(system, x, Vector::<Y::Manifold>::zero())?;
    Some([v, terms(system, x, &slopes(system, x), &Y::Manifold::scales(x))?])
}

/// The sizes that the entries reach soon; `None` if the equation of motion cannot be evaluated at `x`.
fn reach<Y: Metriplectic>(
    system: &Y,
    x: &Point<Y>,
    span: f64,
) -> Option<Scales<<Y::Manifold as Space>::Dim>> {
    let (origin, sizes) = (Vector::<Y::Manifold>::zero(), Y::Manifold::scales(x));
    let v = velocity(system, x, origin)?;
    let slopes = slopes(system, x);
    let (a, terms) = (slopes * v, terms(system, x, &slopes, &sizes)?);
    let nonlinear = |delta: f64| Some(velocity(system, x, v * delta)? - v - a * delta);
    let is_smooth = |delta: f64, whole: &Vector<Y::Manifold>, half: &Vector<Y::Manifold>| {
        (0..Vector::<Y::Manifold>::LEN).all(|i| {
            let linear = 1e-6 * (v[i].abs() + delta * a[i].abs());
            whole[i].abs() <= STEEPEST * half[i].abs() + linear + NOISE * terms[i]
        })
    };
    let (mut delta, mut r) = (0.25 * shortest_time(&slopes, span), origin);
    for _ in 0..CUTS {
        if let (Some(whole), Some(half)) = (nonlinear(delta), nonlinear(0.5 * delta))
            && is_smooth(delta, &whole, &half)
        {
            r = whole;
            break;
        }
        delta *= 0.25;
    }
    let sizes = Vector::<Y::Manifold>::from_index(|i| {
        let linear = (delta * v[i].abs()).max(0.5 * delta * delta * a[i].abs());
        linear.max(delta * r[i].abs() / 3.0)
    });
    (sizes.is_finite() && terms.is_finite()).then_some(Scales { sizes, terms })
}

/// How often the time `δ` is cut before the nonlinear part is given up.
const CUTS: usize = 30;
/// A nonlinear part that grows faster than `δ⁴` is that of a wall: `2⁴`, and a quarter more.
const STEEPEST: f64 = 20.0;
/// The fraction of the terms of a velocity below which it may be noise: 2⁻¹⁶, far above round-off.
const NOISE: f64 = 1.0 / 65_536.0;

/// The shortest time of the motion, and at most `span`.
fn shortest_time<V: Column<f64>>(slopes: &impl Square<f64, Column = V>, span: f64) -> f64 {
    let mut time = span;
    for i in 0..V::LEN {
        for j in 0..=i {
            let (there, back) = (slopes[(i, j)].abs(), slopes[(j, i)].abs());
            let product = there * back;
            // The product of two numbers that are not zero may be too small or too large for a number.
            let rate =
                if product.is_normal() { product.sqrt() } else { there.sqrt() * back.sqrt() };
            if rate > 0.0 {
                time = time.min(rate.recip());
            }
        }
    }
    time
}

/// The sizes `Σ_j (|Π_ij||∂_jH| + |K_ij||∂_jS| + |f'_ij||x_j|)` of what the velocity is summed of.
fn terms<Y: Metriplectic>(
    system: &Y,
    x: &Point<Y>,
    slopes: &Matrix<Y::Manifold>,
    sizes: &Vector<Y::Manifold>,
) -> Option<Vector<Y::Manifold>> {
    let centre = ChartPoint::<Y::Manifold>::centre(x);
    let w = differentials(system, &centre);
    let pi = system.bracket().tensor(&system.bracket_args(&centre, &w.entropy)).ok()?;
    let k = system.dissipation().tensor(system.metric(), &centre, &w.energy).ok()?;
    Some(Column::from_index(|i| {
        let n = Vector::<Y::Manifold>::LEN;
        (0..n).fold(0.0, |sum: f64, j| {
            let laws = (pi[(i, j)] * w.energy[j]).abs() + (k[(i, j)] * w.entropy[j]).abs();
            sum + laws + (slopes[(i, j)] * sizes[j]).abs()
        })
    }))
}

/// The derivatives `f'` of the velocity along the chart at `x`; not numbers where there are none.
fn slopes<Y: Metriplectic>(system: &Y, x: &Point<Y>) -> Matrix<Y::Manifold> {
    jacobian::<Y::Manifold, f64>(
        |&q| velocity(system, x, q).unwrap_or_else(|| Column::from_index(|_| f64::NAN.into())),
        &Vector::<Y::Manifold>::zero(),
    )
}

/// The velocity at `φ_x(q)`, if there is one.
fn velocity<Y: Metriplectic, D: Scalar>(
    system: &Y,
    x: &Point<Y>,
    q: Vector<Y::Manifold, D>,
) -> Option<Vector<Y::Manifold, D>> {
    let v = system.velocity(&ChartPoint { base: x.clone(), q }).ok()?;
    v.is_finite().then_some(v)
}

#[cfg(test)]
mod tests {
    use super::*;
    use metriplectic_dynamics::{FieldDissipation, Poisson, Symplectic, System};
    use metriplectic_fields::Real;
    use metriplectic_manifolds::Euclidean;
    use nalgebra::{Matrix3, Vector2, Vector3, vector};
    use num_dual::DualNum;

    /// A damped oscillator with its entropy, in units of the entries that are powers of two.
    fn oscillator(units: Vector3<f64>) -> Vector3<f64> {
        let [a, b, c] = [units.x, units.y, units.z];
        let pi = Matrix3::new(0.0, a * b, 0.0, -a * b, 0.0, 0.0, 0.0, 0.0, 0.0);
        let system = System::on(Euclidean::<3>)
            .bracket(Poisson::constant(pi).unwrap())
            .energy(move |x: &Vector3<Real>| {
                ((x.x / a).powi(2) + (x.y / b).powi(2)) * 0.5 + x.z / c
            })
            .entropy(move |x: &Vector3<Real>| x.z / c)
            .dissipation(FieldDissipation(move |_: &Vector3<Real>, w: &Vector3<Real>| {
                let force = Vector3::new(Real::from(0.0), w.z * (b * c), -w.y * (b * c));
                force * force.transpose() * ((w.z * c).recip() * 0.1)
            }))
            .build()
            .unwrap();
        Scales::at(&system, &vector![a, 0.0, 0.0], 50.0).sizes.component_div(&units)
    }

    #[test]
    fn entries_at_zero_get_the_sizes_that_they_reach_in_units_of_their_own() {
        let one = oscillator(vector![1.0, 1.0, 1.0]);
        println!("{one}");
        // After a quarter of the time 1: p = 1/4, s = p²t/30.
        assert!((one.x - 1.0).abs() < 1e-15 && (0.2..0.3).contains(&one.y), "{one}");
        assert!((1e-4..1e-2).contains(&one.z), "{one}");
        for exponents in [[-30, -30, -30], [-80, 40, 7], [200, -200, 100]] {
            let units = exponents.map(|k| 2_f64.powi(k)).into();
            assert_eq!(oscillator(units), one, "{exponents:?}");
        }
    }

    #[test]
    fn a_wall_on_the_way_gives_no_size() {
        let system = System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy(|x: &Vector2<Real>| x.y.powi(2) * 0.5 + ((x.x - 1.0) * 20.0).exp())
            .build()
            .unwrap();
        let sizes = Scales::at(&system, &vector![0.0, 1.0], 1000.0).sizes;
        assert!(sizes.x < 1.0 && sizes.y < 1.1, "{sizes}");
    }

    #[test]
    fn a_norm_of_ratios_has_no_unit() {
        let cases = [
            (vector![3.0, 4.0], vector![1.0, 1.0], 5.0),
            (vector![3e-200, 4e200], vector![1e-200, 1e200], 5.0),
            (vector![3e-300, 4e-300], vector![1.0, 1.0], 5e-300),
            (vector![0.0, 0.0], vector![0.0, 1.0], 0.0),
            (vector![1.0, 0.0], vector![0.0, 1.0], f64::INFINITY),
        ];
        for (v, sizes, expected) in cases {
            approx::assert_relative_eq!(relative(&v, &sizes), expected, max_relative = 1e-15);
        }
        assert!(relative(&vector![1.0, f64::NAN], &vector![1.0, 1.0]).is_nan());
    }
}
