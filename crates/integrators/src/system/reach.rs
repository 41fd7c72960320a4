//! How far the entries of a state move soon.
//!
//! Flows without derivatives have `step/initial_scales.rs`, from rates alone, and so do systems of [many](SMALL) entries: all of
//! `f'` costs `n` velocities at dual numbers. This routine is not replaced by it where there are few: `1/|f'_ii|`
//! and `1/√|f'_ij f'_ji|` are times of the motion also in directions in which nothing is displaced yet. The two share the
//! classical step.
//!
//! An entry that starts at zero has no size yet. It gets the one that it reaches soon: with `v = f(x)`,
//! `a = f'(x) v` and the nonlinear part `r = f(δv) − v − δa`,
//!
//! ```math
//! s_i = \max\bigl(|x_i|, \; \delta |v_i|, \; \tfrac12\delta^2 |a_i|, \; \tfrac13\delta |r_i| \bigr) .
//! ```
//!
//! `δ` is a quarter of the shortest time of the motion, of the span of the run, `1/|f'_ii|` and
//! `1/√|f'_ij f'_ji|`, which no unit of an entry changes. An entry that begins to move with a higher power of time
//! gets the displacement of a step of size `δ` of the classical method of order 4. `δ` is cut until `r` grows no faster than a power
//! of `δ`, so that a steep wall on the way does not count, and until the motion is nowhere on that step much faster than
//! at its start: a pendulum at a right angle has no frequency yet.
//!
//! The terms of a velocity have the sizes `t_i = Σ_j (|Π_ij||∂_jH| + |K_ij||∂_jS| + |f'_ij||x_j|)`. Of many entries, the last
//! sum is the largest `|Σ_j f'_ij s_j|` of a few vectors `s_j = ±|x_j|` with irregular signs: about the root of the sum of the squares,
//! as that of independent roundings.

use metriplectic_dynamics::velocity::differentials;
use metriplectic_dynamics::{Bracket, Dissipation, Metriplectic, system::Point};
use metriplectic_fields::{
    ChartPoint, Column, Dimension, Matrix, Scalar, Vector, jacobian, power_of_two,
};

use crate::step::{
    CUT, CUTS, Dim, Directions, Few, SAME, Scales, Vector as _, Written, classical_step,
};

/// The entries of a square matrix, row by row.
type Rows = Few<64>;

/// The motion of a system around a state, in plain numbers.
pub(super) trait Motion {
    /// The velocity at a displacement; `None` where it has no value.
    fn velocity(&self, q: &Directions) -> Option<Directions>;

    /// The derivatives `f'` of the velocity at a displacement, along the chart at the state; not numbers where there are none.
    fn slopes(&self, q: &Directions) -> Rows;

    /// The terms `|Π_ij ∂_jH| + |K_ij ∂_jS|` of the velocity at the state; `None` if its metric cannot be used.
    fn terms(&self) -> Option<Rows>;
}

/// A typed system around a state.
pub(super) struct Around<'a, Y: Metriplectic> {
    pub(super) system: &'a Y,
    pub(super) x: &'a Point<Y>,
}

impl<Y: Metriplectic> Motion for Around<'_, Y> {
    fn velocity(&self, q: &Directions) -> Option<Directions> {
        let v = velocity(self.system, self.x, Y::vector(q).0)?;
        Some(Directions::from_index(Dim::<Y>::LEN, |i| v[i]))
    }

    fn slopes(&self, q: &Directions) -> Rows {
        let nowhere = || Column::from_index(|_| f64::NAN.into());
        let of = |&q: &_| velocity(self.system, self.x, q).unwrap_or_else(nowhere);
        let slopes: Matrix<Y::Manifold> = jacobian::<Y::Manifold, f64>(of, &Y::vector(q).0);
        rows(Dim::<Y>::LEN, |i, j| slopes[(i, j)])
    }

    fn terms(&self) -> Option<Rows> {
        let centre = ChartPoint::<Y::Manifold>::centre(self.x);
        let w = differentials(self.system, &centre);
        let g = self.system.metric_at(&centre);
        let args = self.system.bracket_args(&g, &w.entropy);
        let pi = self.system.bracket().tensor(&args).ok()?;
        let k = self.system.dissipation().tensor(&g, &w.energy).ok()?;
        Some(rows(Dim::<Y>::LEN, |i, j| {
            (pi[(i, j)] * w.energy[j]).abs() + (k[(i, j)] * w.entropy[j]).abs()
        }))
    }
}

/// The rows of a matrix.
fn rows(n: usize, entry: impl Fn(usize, usize) -> f64) -> Rows {
    let mut rows = Rows::zeros(n * n);
    for (k, to) in rows.iter_mut().enumerate() {
        *to = entry(k / n, k % n);
    }
    rows
}

/// The velocity at a state, and the sizes of what it is summed of; `None` if it cannot be evaluated there.
pub(super) fn velocity_and_terms(
    motion: &dyn Motion,
    sizes: &Directions,
) -> Option<[Directions; 2]> {
    let origin = sizes.zero();
    let v = motion.velocity(&origin)?;
    let terms = if is_small(sizes.len()) {
        terms(motion, moved(&motion.slopes(&origin), sizes))?
    } else {
        terms_of_many(motion, &v, sizes)?
    };
    Some([v, terms])
}

/// The number of entries up to which all derivatives of a velocity are formed.
/// A factor of four fails `system/reach.rs::the_start_of_a_large_system_costs_some_velocities`.
const SMALL: usize = 8;

/// Returns whether so many entries are few.
pub(super) const fn is_small(entries: usize) -> bool {
    entries <= SMALL
}

/// The directions along which the change of a velocity of many entries is looked at.
/// A factor of four fails `system/reach.rs::the_start_of_a_large_system_costs_some_velocities`.
const DIRECTIONS: usize = 3;

/// The sizes of what a velocity `v` of many entries is summed of, with entries of these sizes.
pub(super) fn terms_of_many(
    motion: &dyn Motion,
    v: &Directions,
    sizes: &Directions,
) -> Option<Directions> {
    // By differences: a velocity at dual numbers costs as much as `n` of them.
    let small = f64::EPSILON.sqrt();
    let mut moved = sizes.zero();
    for direction in 0..DIRECTIONS {
        let q = sizes.with(|i| {
            // Both signs, without a pattern (Weyl 1916).
            let turn = ((i * DIRECTIONS + direction) as f64 * 0.618_033_988_749_894_9).fract();
            let sign = if (turn * turn * 1e4).fract() < 0.5 { -1.0 } else { 1.0 };
            sign * small * sizes.get(i)
        });
        let there = motion.velocity(&q)?;
        moved = Directions::zip([&moved, &there, v], |[moved, there, v]| {
            moved.max((there - v).abs() / small)
        });
    }
    Some(Directions::zip([&terms(motion, |_, _| 0.0)?, &moved], |[terms, moved]| terms + moved))
}

/// The sizes that the entries reach soon; `None` if the equation of motion cannot be evaluated at the state.
pub(super) fn reach(
    motion: &dyn Motion,
    sizes: &Directions,
    span: f64,
) -> Option<Scales<Directions>> {
    let (n, origin) = (sizes.len(), sizes.zero());
    let v = motion.velocity(&origin)?;
    let slopes = motion.slopes(&origin);
    let terms = terms(motion, moved(&slopes, sizes))?;
    let first = 0.25 * shortest_time(n, &slopes, span);
    // The acceleration in a unit of rates, whose square may be too large or too small for a number.
    let unit = if first.is_normal() { power_of_two(first.recip()) } else { 1.0 };
    let rate = v.map(|v| v * unit.recip());
    let a = v.with(|i| {
        (1..n).fold(slopes[i * n] * rate.get(0), |sum, j| slopes[i * n + j] * rate.get(j) + sum)
    });
    let nonlinear = |delta: f64| {
        let there = motion.velocity(&v.map(|v| v * delta))?;
        Some(Directions::zip([&there, &v, &a], |[there, v, a]| there - v - a * (unit * delta)))
    };
    let is_smooth = |delta: f64, whole: &Directions, half: &Directions| {
        let quarter = std::cell::OnceCell::new();
        (0..n).all(|i| {
            let linear = 1e-6 * (v.get(i).abs() + unit * delta * a.get(i).abs());
            let [whole, half] = [whole.get(i), half.get(i)];
            let is_flat = whole.abs() <= STEEPEST * half.abs() + linear + NOISE * terms.get(i);
            let is_power = || {
                let quarter = quarter.get_or_init(|| nonlinear(0.25 * delta));
                quarter.as_ref().is_some_and(|quarter| {
                    let [first, second] = [whole / half, half / quarter.get(i)];
                    (first / second - 1.0).abs() <= SAME
                })
            };
            is_flat || is_power()
        })
    };
    let (mut delta, mut r) = (first, origin.clone());
    let step = |h: f64| classical_step(|q| motion.velocity(q), [&origin, &v], h);
    let is_short = |delta: f64| {
        [0.5 * delta, delta].into_iter().all(|h| {
            let is_slow = |d: Directions| delta <= 0.5 * shortest_time(n, &motion.slopes(&d), span);
            step(h).is_some_and(is_slow)
        })
    };
    for _ in 0..CUTS {
        if let (Some(whole), Some(half)) = (nonlinear(delta), nonlinear(0.5 * delta))
            && is_smooth(delta, &whole, &half)
            && is_short(delta)
        {
            r = whole;
            break;
        }
        delta *= CUT;
    }
    let classical = step(delta).unwrap_or(origin);
    let sizes = Directions::zip([&v, &a, &r, &classical], |[v, a, r, classical]| {
        let linear = (delta * v.abs()).max(0.5 * delta * (unit * delta) * a.abs());
        let first = linear.max(delta * r.abs() / 3.0);
        if first < LATE * classical.abs() { classical.abs() } else { first }
    });
    let is_finite = |v: &Directions| v.numbers().iter().all(|v| v.is_finite());
    (is_finite(&sizes) && is_finite(&terms)).then_some(Scales { sizes, terms })
}

/// The fraction of a displacement below which the first powers of time say nothing of it.
const LATE: f64 = 1e-6;
/// A nonlinear part that grows faster than `δ⁴` is that of a wall: `2⁴`, and a quarter more. But for a power of `δ`, which grows by
/// the same factor at half the time.
const STEEPEST: f64 = 20.0;
/// The fraction of the terms of a velocity below which it may be noise: 2⁻¹⁶, far above round-off.
const NOISE: f64 = 1.0 / 65_536.0;

/// The shortest time of the motion, and at most `span`; zero where a derivative is not a number.
fn shortest_time(n: usize, slopes: &Rows, span: f64) -> f64 {
    let mut time = span;
    for i in 0..n {
        for j in 0..=i {
            let (there, back) = (slopes[i * n + j].abs(), slopes[j * n + i].abs());
            let product = there * back;
            // The product of two numbers that are not zero may be too small or too large for a number.
            let rate =
                if product.is_normal() { product.sqrt() } else { there.sqrt() * back.sqrt() };
            if rate.is_nan() {
                return 0.0;
            }
            if rate > 0.0 {
                time = time.min(rate.recip());
            }
        }
    }
    time
}

/// The terms `|f'_ij| s_j`, with entries of these sizes.
fn moved(slopes: &Rows, sizes: &Directions) -> impl Fn(usize, usize) -> f64 {
    move |i, j| (slopes[i * sizes.len() + j] * sizes.get(j)).abs()
}

/// The sizes `Σ_j (|Π_ij||∂_jH| + |K_ij||∂_jS| + m_ij)` of what the velocity is summed of.
fn terms(motion: &dyn Motion, moved: impl Fn(usize, usize) -> f64) -> Option<Directions> {
    let laws = motion.terms()?;
    let n = laws.len().isqrt();
    Some(Directions::from_index(n, |i| {
        (0..n).fold(0.0, |sum: f64, j| sum + laws[i * n + j] + moved(i, j))
    }))
}

/// The velocity at `φ_x(q)`, if there is one.
pub(super) fn velocity<Y: Metriplectic, D: Scalar>(
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
        Scales::at(&system, &vector![a, 0.0, 0.0], Some(50.0)).sizes.0.component_div(&units)
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

    /// `x' = y`, `y' = z`, `z' = u`, `u' = 1` from rest, in a Hamiltonian system: `x = t⁴/24`.
    #[test]
    fn an_entry_that_moves_late_has_a_size() {
        let mut pi = nalgebra::Matrix6::zeros();
        for i in 0..3 {
            (pi[(i, i + 3)], pi[(i + 3, i)]) = (1.0, -1.0);
        }
        let system = System::on(Euclidean::<6>)
            .bracket(Poisson::constant(pi).unwrap())
            .energy(|x: &nalgebra::Vector6<Real>| {
                // q₁' = q₂, q₂' = q₃, q₃' = p₃, p₃' = 1.
                x[3] * x[1] + x[4] * x[2] + x[5] * x[5] * 0.5 - x[2]
            })
            .build()
            .unwrap();
        let sizes = Scales::at(&system, &nalgebra::Vector6::zeros(), Some(4.0)).sizes.0;
        assert!(sizes[0] > 0.01 && sizes[1] > 0.05, "{sizes}");
    }

    #[test]
    fn the_start_of_a_large_system_costs_some_velocities() {
        use std::sync::atomic::{AtomicUsize, Ordering};
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        // Evaluations of the energy for the sizes at the start, per velocity, of oscillators of which half are displaced.
        macro_rules! velocities {
            ($n:literal) => {{
                let pi = nalgebra::SMatrix::<f64, $n, $n>::from_fn(|i, j| {
                    let next = |i: usize, j: usize| f64::from(i % 2 == 0 && j == i + 1);
                    next(i, j) - next(j, i)
                });
                let system = System::on(Euclidean::<$n>)
                    .bracket(Poisson::constant(pi).unwrap())
                    .energy(|x: &nalgebra::SVector<Real, $n>| {
                        COUNT.fetch_add(1, Ordering::Relaxed);
                        x.norm_squared() * 0.5
                    })
                    .build()
                    .unwrap();
                let x = nalgebra::SVector::<f64, $n>::from_fn(|i, _| f64::from(i % 2 == 0));
                let count = |work: &dyn Fn()| {
                    COUNT.store(0, Ordering::Relaxed);
                    work();
                    COUNT.load(Ordering::Relaxed)
                };
                let one = count(&|| assert!(velocity(&system, &x, x * 0.0).is_some()));
                let all = count(&|| {
                    let Scales { sizes, terms } = Scales::at(&system, &x, Some(50.0));
                    // An amplitude of 1, and a force of two terms: that of `dH`, and that of the rounding of a position.
                    assert!(sizes.0.iter().all(|size| (0.2..1.1).contains(size)), "{sizes:?}");
                    let forces = terms.0.iter().skip(1).step_by(2);
                    assert!(forces.clone().all(|terms| (1.9..2.1).contains(terms)), "{terms:?}");
                });
                all as f64 / one as f64
            }};
        }
        let counts = [velocities!(8), velocities!(10), velocities!(30)];
        println!("{counts:?} velocities");
        // With all derivatives they are 1741 for 8 entries; a look at a direction costs one.
        assert!(counts[1] < 50.0 && counts[2] < 50.0 && counts[0] > 500.0, "{counts:?}");
    }

    #[test]
    fn a_wall_on_the_way_gives_no_size() {
        let system = System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy(|x: &Vector2<Real>| x.y.powi(2) * 0.5 + ((x.x - 1.0) * 20.0).exp())
            .build()
            .unwrap();
        let sizes = Scales::at(&system, &vector![0.0, 1.0], Some(1000.0)).sizes.0;
        assert!(sizes.x < 1.0 && sizes.y < 1.1, "{sizes}");
    }
}
