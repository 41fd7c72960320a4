//! The sizes that the entries of a flow reach soon, from its rates alone.
//!
//! A [`System`](metriplectic_dynamics::System) knows the derivatives of its velocity too, and has a routine of its own,
//! `system/reach.rs`. It sees the times of a motion that has not begun, such as the one of a stiff direction in which nothing
//! is displaced yet. Here only a step shows them. A lattice cannot form `f'`, which has `N²` entries. Both share the
//! classical step.
//!
//! An entry that starts at zero has no size yet. It gets its displacement in two steps of size `h/2` of the classical
//! method of order 4. `h` is at most a quarter of the span of the run and of each time `s_i/|v_i|` in which an entry
//! moves by its own size. It is decreased until one step of size `h` gives these displacements too, and so for `h/2`,
//!
//! ```math
//! |d_i(h) - d_i(\tfrac h2, \tfrac h2)| \le \tfrac18 |d_i(\tfrac h2, \tfrac h2)| + 10^{-9} s_i .
//! ```
//!
//! An entry that moves with a high power of time has another error, which decreasing `h` leaves as it is: it does not bound
//! `h`. So a motion that starts at rest bounds `h` too: its velocities vanish, and no quotient of the start is a time, but a
//! step that is longer than a period differs from two halves. Entries of one kind, such as the positions of all sites
//! of a lattice, share the largest size.

use super::scales::{Scales, larger};
use super::{Element, Flow, Vector, both};

/// The fraction of the span and of the times `s_i/|v_i|` with which the search for `h` begins.
/// A factor of four fails `step/initial_scales.rs::a_relaxation_from_zero_reaches_its_end_whatever_the_span`.
const FIRST: f64 = 0.25;
/// The time `s_i/|v_i|`, relative to the span, below which an entry has only begun to move.
/// A factor of four fails `step/initial_scales.rs::an_entry_that_has_only_begun_to_move_has_no_size_yet`.
const BEGUN: f64 = 1e-8;
/// The factor by which `h` is decreased.
/// A factor of four fails `step/initial_scales.rs::a_motion_that_leaves_the_numbers_is_cut`.
pub(crate) const CUT: f64 = 0.25;
/// How often it is: down to 10⁻¹⁸ of the span.
/// A factor of four fails `step/initial_scales.rs::a_motion_that_leaves_the_numbers_is_cut`.
pub(crate) const CUTS: usize = 30;
/// The fraction of a displacement by which one step and two halves may differ. An oscillation at the rate `ω` is resolved
/// for `ωh < 1.7`, and a relaxation at the rate `λ` for `λh < 1.7`.
/// A factor of four fails `step/initial_scales.rs::a_relaxation_from_zero_reaches_its_end_whatever_the_span`.
const RESOLVED: f64 = 0.125;
/// The fraction of the size of an entry below which its displacement does not matter.
/// A factor of four fails `step/initial_scales.rs::one_step_and_two_halves_agree_to_an_eighth_or_by_the_factor_of_a_power`.
const NOTHING: f64 = 1e-9;
/// The fraction by which the factor between one step and two halves may differ from the one for half the size of both. The
/// displacement `t^k` has a factor that no size changes, between 1 and 2, and is above `1 + 1/8` from `k = 7` on.
/// A factor of four fails `step/initial_scales.rs::one_step_and_two_halves_agree_to_an_eighth_or_by_the_factor_of_a_power`.
pub(crate) const SAME: f64 = 0.1;
/// The displacement along the velocity, relative to the first `h`, at which late entries are told apart.
const AHEAD: f64 = 1e-6;

impl<V: Vector> Scales<V> {
    /// The sizes at `x`, where a run starts that lasts `span`, or where entries begin to move. Without a span
    /// nothing is known.
    pub(crate) fn at<F: Flow<Vector = V> + ?Sized>(
        flow: &F,
        x: &Element<F>,
        span: Option<f64>,
    ) -> Self {
        let sizes = flow.sizes(x);
        let zero = sizes.zero();
        let Some(span) = span else { return Self { sizes: zero.clone(), terms: zero } };
        let scales = match flow.reach(x, span) {
            Some(reached) => reached.or(&sizes),
            None => Self { sizes, terms: zero },
        };
        flow.with_ledger_sizes(x, scales)
    }
}

/// The sizes that the entries reach soon in a run that lasts `span`; `None` if the flow has no rates at `x`, or
/// nowhere near it.
pub(crate) fn initial_scales<F: Flow + ?Sized>(
    flow: &F,
    x: &Element<F>,
    span: f64,
) -> Option<Scales<F::Vector>> {
    let sizes = flow.sizes(x);
    let v = flow.rates(x, &sizes.zero())?;
    let start = Start { flow, x, v: &v, sizes: &sizes };
    let reached = start.resolved_displacement(FIRST * start.own_time(span))?;
    let sizes = larger(&sizes, &reached);
    let terms = flow.velocity_terms(x, &v, &sizes)?;
    (is_finite(&sizes) && is_finite(&terms)).then_some(Scales { sizes, terms })
}

/// The displacement of a step of the classical Runge-Kutta method that begins at the displacement `d`, with
/// the velocity `v` there; `None` if it leaves the domain.
pub(crate) fn classical_step<V: Vector>(
    rates: impl Fn(&V) -> Option<V>,
    [d, v]: [&V; 2],
    h: f64,
) -> Option<V> {
    let ahead = |v: &V, t: f64| V::zip([d, v], |[d, v]| d + t * v);
    let second = rates(&ahead(v, 0.5 * h))?;
    let third = rates(&ahead(&second, 0.5 * h))?;
    let last = rates(&ahead(&third, h))?;
    Some(V::zip([d, v, &second, &third, &last], |[d, first, second, third, last]| {
        d + (first + (second + third) * 2.0 + last) * (h / 6.0)
    }))
}

fn is_finite(v: &impl Vector) -> bool {
    (0..v.len()).all(|i| v.get(i).is_finite())
}

/// The largest displacements of each kind of entry in one step, in two steps of half the size, and their difference.
struct Displacements<V> {
    whole: V,
    halves: V,
    difference: V,
}

/// The start of a motion.
struct Start<'a, F: Flow + ?Sized> {
    flow: &'a F,
    x: &'a Element<F>,
    v: &'a F::Vector,
    sizes: &'a F::Vector,
}

impl<F: Flow + ?Sized> Start<'_, F> {
    /// The shortest time in which entries of a kind move by their size, and at most `span`.
    fn own_time(&self, span: f64) -> f64 {
        let speeds = self.v.by_kind();
        let times = F::Vector::zip([self.sizes, &speeds], |[size, speed]| size / speed);
        // An entry that is nothing beside what its velocity makes of the run has no size yet.
        let least = BEGUN * span;
        let positive = (0..times.len()).map(|i| times.get(i)).filter(|time| *time > least);
        positive.fold(span, f64::min)
    }

    /// The largest displacement of each kind of entry in a time of at most `h` that the classical method resolves.
    fn resolved_displacement(&self, mut h: f64) -> Option<F::Vector> {
        let late = self.late(AHEAD * h);
        let mut displacement = None;
        for _ in 0..CUTS {
            if let Some(whole) = self.displacements(h) {
                // The half too: a relaxation at the rate 11/h agrees by accident, and 400 times too far away.
                if self.is_resolved([&whole, &whole], late.as_ref())
                    && let Some(half) = self.displacements(0.5 * h)
                    && self.is_resolved([&whole, &half], late.as_ref())
                {
                    return Some(whole.halves);
                }
                displacement = Some(whole.halves);
            }
            h *= CUT;
        }
        displacement
    }

    /// The displacements in one step of size `h`, and in two steps of half the size.
    fn displacements(&self, h: f64) -> Option<Displacements<F::Vector>> {
        let &Self { flow, x, v, .. } = self;
        let origin = v.zero();
        let rates = |d: &F::Vector| flow.rates(x, d);
        let middle = classical_step(rates, [&origin, v], 0.5 * h)?;
        let there = rates(&middle)?;
        let halves = classical_step(rates, [&middle, &there], 0.5 * h)?;
        let whole = classical_step(rates, [&origin, v], h)?;
        let difference = F::Vector::zip([&whole, &halves], |[whole, halves]| whole - halves);
        let [whole, halves] = both([whole, halves], |d| d.by_kind());
        Some(Displacements { whole, halves, difference: difference.by_kind() })
    }

    /// Returns whether one step and two halves agree in each kind of entry that does not move late, in the second one
    /// of two sizes of the steps. The displacements may differ by the same factor in both: they are powers of time.
    fn is_resolved(
        &self,
        [first, second]: [&Displacements<F::Vector>; 2],
        late: Option<&F::Vector>,
    ) -> bool {
        let sizes = self.sizes;
        (0..sizes.kinds()).all(|i| {
            let allowed = RESOLVED * second.halves.get(i) + NOTHING * sizes.get(i);
            let agrees = second.difference.get(i) <= allowed && allowed.is_finite();
            let [before, factor] = both([first, second], |d| d.whole.get(i) / d.halves.get(i));
            let is_power = (1.0..=2.0 + SAME).contains(&factor)
                && (before / factor - 1.0).abs() <= SAME
                && second.difference.get(i) <= (1.0 + SAME) * second.halves.get(i);
            agrees || is_power || late.is_some_and(|late| late.get(i) == 0.0)
        })
    }

    /// Zero for a kind of entry without velocity and acceleration. It moves with a power of time that a step may not
    /// resolve, however small it is.
    fn late(&self, time: f64) -> Option<F::Vector> {
        let there = self.flow.rates(self.x, &self.v.map(|v| time * v))?;
        let [here, there] = [self.v.by_kind(), there.by_kind()];
        Some(F::Vector::zip([&here, &there], |[here, there]| here + there))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::step::{Laws, StateSpace};
    use metriplectic_manifolds::PointError;

    /// The numbers of a state, of any length.
    #[derive(Clone, Debug, PartialEq)]
    struct Numbers;

    impl StateSpace for Numbers {
        type Element = Vec<f64>;

        fn numbers(x: &Vec<f64>) -> Vec<f64> {
            x.clone()
        }
    }

    /// `x' = f(x)`, with the energy zero.
    struct Motion<F>(F);

    impl<F: Fn(&[f64]) -> Vec<f64>> Flow for Motion<F> {
        type Space = Numbers;
        type Numbers = [f64; 0];
        type Vector = Vec<f64>;

        fn laws(&self, _: &Vec<f64>) -> Laws<[f64; 0]> {
            Laws { energy: 0.0, entropy: 0.0, invariants: [] }
        }

        fn term_sizes(&self, x: &Vec<f64>) -> Laws<[f64; 0]> {
            self.laws(x)
        }

        fn rates(&self, x: &Vec<f64>, d: &Vec<f64>) -> Option<Vec<f64>> {
            Some((self.0)(&self.moved(x, d)))
        }

        fn sizes(&self, x: &Vec<f64>) -> Vec<f64> {
            x.iter().map(|x| x.abs()).collect()
        }

        fn moved(&self, x: &Vec<f64>, d: &Vec<f64>) -> Vec<f64> {
            x.iter().zip(d).map(|(x, d)| x + d).collect()
        }

        fn element(&self, entries: &[f64]) -> Result<Vec<f64>, PointError> {
            Ok(entries.to_vec())
        }
    }

    fn sizes(f: impl Fn(&[f64]) -> Vec<f64>, start: &[f64], span: f64) -> Vec<f64> {
        Motion(f).reach(&start.to_vec(), span).expect("it has rates").sizes
    }

    #[test]
    fn an_oscillator_from_rest_reaches_its_momentum_whatever_the_span() {
        let mut spans = (-20..60).map(|k| 2_f64.powf(0.37 * f64::from(k)));
        spans.next();
        for span in spans.filter(|span| *span > 8.0) {
            for [unit, omega] in [[1.0, 1.0], [1e-200, 100.0], [1e150, 1e-2]] {
                let f = move |x: &[f64]| vec![x[1] * omega / unit, -x[0] * omega * unit];
                let [q, p] = sizes(f, &[1.0, 0.0], span / omega)[..] else { panic!("two") };
                assert!((1.0..2.0).contains(&q), "{q} in {span}");
                assert!((0.3..1.1).contains(&(p / unit)), "{p} in {span}");
            }
        }
    }

    #[test]
    fn a_relaxation_from_zero_reaches_its_end_whatever_the_span() {
        for k in 0..400 {
            let span = 4.0 * 1.05_f64.powi(k);
            let [x] = sizes(|x| vec![1.0 - x[0]], &[0.0], span)[..] else { panic!("one") };
            assert!((0.3..1.0).contains(&x), "{x} in {span}");
        }
    }

    #[test]
    fn an_entry_that_moves_late_does_not_shorten_the_time() {
        // An oscillator that pushes a chain of integrators: the last moves with the eighth power of time.
        let f = |x: &[f64]| {
            let mut v = vec![x[1], -x[0]];
            v.extend_from_slice(&x[1..8]);
            v
        };
        let mut start = vec![0.0; 9];
        start[0] = 1.0;
        let sizes = sizes(f, &start, 1000.0);
        assert!(sizes[1] > 0.3 && sizes[1] < 1.1, "{sizes:?}");
        assert!(sizes.iter().all(|size| *size > 0.0), "{sizes:?}");
    }

    #[test]
    fn an_entry_that_moves_with_a_high_power_does_not_shorten_the_time() {
        // u' = pᵏ beside an oscillator from rest: u moves as tᵏ⁺¹.
        for k in 2..12 {
            for span in [20.0, 300.0] {
                let f = |x: &[f64]| vec![x[1], -x[0], x[1].powi(k)];
                let [_, p, u] = sizes(f, &[1.0, 0.0, 0.0], span)[..] else { panic!("three") };
                assert!((0.02..1.1).contains(&p), "{k}: {p}");
                let power = p.powi(k + 1) / f64::from(k + 1);
                assert!((0.3..10.0).contains(&(u / power)), "{k}: {u}, {power}");
            }
        }
    }

    #[test]
    fn an_entry_that_has_only_begun_to_move_has_no_size_yet() {
        // q' = p, p' = 1 from a momentum that is nothing beside the one that it reaches.
        let position = |p: f64| sizes(|x| vec![x[1], 1.0], &[0.0, p], 1.0)[0];
        for p in [0.0, 1e-300, 1e-100, 1e-12, 5e-9] {
            assert!((position(p) - 0.03125).abs() < 1e-6, "{p}: {}", position(p));
        }
        // From one of 2·10⁻⁸ the position is followed in this unit.
        assert!(position(2e-8) < 1e-15, "{}", position(2e-8));
    }

    #[test]
    fn a_motion_that_leaves_the_numbers_is_cut() {
        // x' = x² from 10⁻³ would end at t = 1000.
        let [x] = sizes(|x| vec![x[0] * x[0]], &[1e-3], 1e12)[..] else { panic!("one") };
        assert!((1e-3..2e-3).contains(&x), "{x}");
        let [x] = sizes(|x| vec![(100.0 * x[0]).exp()], &[0.0], 1e12)[..] else { panic!("one") };
        assert!((1e-3..0.2).contains(&x), "{x}");
    }

    #[test]
    fn one_step_and_two_halves_agree_to_an_eighth_or_by_the_factor_of_a_power() {
        let flow = Motion(|_: &[f64]| vec![0.0]);
        let (x, v, sizes) = (vec![1.0], vec![0.0], vec![1.0]);
        let start = Start { flow: &flow, x: &x, v: &v, sizes: &sizes };
        let is_resolved = |whole: f64, halves: f64| {
            let displacements = Displacements {
                whole: vec![whole],
                halves: vec![halves],
                difference: vec![(whole - halves).abs()],
            };
            start.is_resolved([&displacements, &displacements], None)
        };
        // A shorter step is off the two halves by a fraction, a longer one may be that of a power of time.
        assert!(is_resolved(0.9, 1.0) && !is_resolved(0.6, 1.0));
        assert!(is_resolved(2.05, 1.0) && !is_resolved(2.2, 1.0));
        // Beside the size of the entry a displacement of 10⁻⁹ is nothing.
        assert!(is_resolved(5e-10, 1e-14) && !is_resolved(2e-9, 1e-14));
    }
}
