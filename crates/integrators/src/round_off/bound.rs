//! Bounds of the round-off of the laws.

use metriplectic_dynamics::velocity::Gradient;
use metriplectic_dynamics::{Metriplectic, system::Point};
use metriplectic_fields::{Column, Jet1, ScalarField, Space, Vector};
use metriplectic_manifolds::Manifold;

use crate::step::{Laws, both};

/// A few roundings, relative to the size of what is rounded.
/// A factor of four fails `tests/tangent/schemes.rs::tangents_of_schemes_are_those_of_differences`.
pub(crate) const ROUNDED: f64 = 4.0 * f64::EPSILON;

/// The round-off of a number that a closure or a chart sums, relative to the size of its terms.
/// A factor of four fails `round_off/stable_gradient.rs::a_sum_of_some_tens_of_roundings_is_round_off`.
pub(crate) const SUMMED: f64 = 64.0 * f64::EPSILON;

/// The change of the energy, relative to the size of its terms, that is no round-off: no step is taken
/// that changes it by more.
/// A factor of four fails `round_off/bound.rs::a_change_of_a_millionth_of_the_energy_is_no_round_off`.
pub(crate) const BROKEN: f64 = 1e-6;

/// The independent fraction of a differential below which it is a combination of others.
/// A factor of four fails `system/stages.rs::a_law_with_a_part_of_ten_billionths_is_independent`.
pub(crate) const INDEPENDENT: f64 = 1e-10;

/// The largest number without digits: what rounds to a multiple of the least number has an error of its own size below it, and
/// counts as zero in every comparison.
pub(crate) const NO_DIGITS: f64 = f64::MIN_POSITIVE / f64::EPSILON;

/// Returns whether a growth of the entropy in a step is more than the square of its round-off. A million steps of it then change the
/// entropy by more than a rounding.
pub(crate) fn is_dissipated(growth: f64, entropy: f64) -> bool {
    growth > 1e-6 * f64::EPSILON * entropy.abs() + NO_DIGITS
}

/// The round-off of a conserved function whose terms have this size: a step evaluates it at two rounded
/// points, and runs of 10⁷ steps stay within 50 roundings.
pub(crate) const fn of_a_law(scale: f64) -> f64 {
    50.0 * f64::EPSILON * scale + NO_DIGITS
}

/// The size `|F| + Σ_i |∂_iF x_i|` of the terms of a field at a point, to which the round-off of its value
/// is relative.
pub(crate) fn size_of_terms<M: Manifold>(f: &impl ScalarField<M>, x: &M::Point<f64>) -> f64 {
    let jet = f.jet1(x);
    jet.value.abs() + jet.df.abs().dot(&M::scales(x))
}

/// The sizes of the terms of fields at a point.
pub(crate) struct SizesAt<'a, M: Space>(pub(crate) &'a M::Point<f64>);

impl<M: Manifold> Gradient<M> for SizesAt<'_, M> {
    type Covector = f64;

    fn of(&mut self, f: &impl ScalarField<M>) -> f64 {
        size_of_terms::<M>(f, self.0)
    }
}

/// The round-off `4ε (|S| + Σ_i |∂_iS x_i|)` of an entropy increment, the larger one of the two ends. The
/// entries of `x' = x + u` are rounded in units of the larger end, so `x_i` is that of both.
pub(crate) fn of_an_increment<Y: Metriplectic>(system: &Y, ends: [&Point<Y>; 2]) -> f64 {
    let jet = system.entropy().jet1(ends[1]);
    of_an_increment_to(system, ends, &jet)
}

/// The [round-off of an increment](of_an_increment), with the value and the differential of the entropy at the second end.
pub(crate) fn of_an_increment_to<Y: Metriplectic>(
    system: &Y,
    [x, y]: [&Point<Y>; 2],
    end: &Jet1<Y::Manifold>,
) -> f64 {
    let [at_x, at_y] = [Y::Manifold::scales(x), Y::Manifold::scales(y)];
    let scales = Vector::<Y::Manifold>::from_index(|i| at_x[i].max(at_y[i]));
    let size = |jet: &Jet1<Y::Manifold>| jet.value.abs() + jet.df.abs().dot(&scales);
    ROUNDED * size(&system.entropy().jet1(x)).max(size(end)) + NO_DIGITS
}

/// The size `|H| + Σ_i |∂_iH| (|x_i| + |d_i|)` of the terms of the energy on the step `d` between two points:
/// the sizes at its two ends.
///
/// A change has to be small against both. At the edge of a logarithm `|∂_iH x_i|` is as large as the
/// reciprocal of round-off, and would excuse any error; at a point where all terms vanish `|∂_iH d_i|` does
/// not.
pub(crate) fn sizes_on_a_step<Y: Metriplectic>(system: &Y, [x, end]: [&Point<Y>; 2]) -> [f64; 2] {
    let d = Y::Manifold::coordinates(x, end).abs();
    both([x, end], |x| {
        let exchanged = system.energy().jet1(x).df.abs().dot(&d);
        size_of_terms::<Y::Manifold>(system.energy(), x) + exchanged
    })
}

/// The smaller size of the terms of the energy on a step, if a change is more than a millionth of it, or no
/// number. A change [without digits](NO_DIGITS) is none.
pub(crate) fn breaks_first_law(
    change: f64,
    energy: f64,
    sizes: impl FnOnce() -> [f64; 2],
) -> Option<f64> {
    // Most often the energy itself is large enough, and needs no differential; an infinite one is not.
    if energy.is_finite() && change.abs() <= (BROKEN * energy.abs()).max(NO_DIGITS) {
        return None;
    }
    let sizes = sizes();
    let holds = sizes.iter().all(|&size| change.abs() <= BROKEN * size && size.is_finite());
    if holds { None } else { Some(sizes[0].min(sizes[1])) }
}

/// Returns whether a step changes a further invariant by more than [round-off](of_a_law) of its terms, which have these sizes at
/// both ends. Most often its value itself is large enough, and the sizes are not asked for.
pub(crate) fn breaks_invariants<L: AsRef<[f64]>>(
    [before, after]: [&Laws<L>; 2],
    sizes: impl FnOnce() -> [Laws<L>; 2],
) -> bool {
    let listed = |laws: &Laws<L>, a: usize| laws.invariants.as_ref()[a].abs();
    let change = |a: usize| (after.invariants.as_ref()[a] - before.invariants.as_ref()[a]).abs();
    let count = after.invariants.as_ref().len();
    if (0..count).all(|a| change(a) <= of_a_law(listed(after, a))) {
        return false;
    }
    let [at_start, at_end] = sizes();
    let largest = |a: usize| listed(&at_start, a).max(listed(&at_end, a));
    (0..count).any(|a| change(a) > of_a_law(largest(a)))
}

/// Returns whether a step lowers the entropy by more than [round-off](of_a_law) of its terms, in the same way.
pub(crate) fn falls<L>(
    [before, after]: [&Laws<L>; 2],
    sizes: impl FnOnce() -> [Laws<L>; 2],
) -> bool {
    let falls = |sizes: &Laws<L>| before.entropy - after.entropy > of_a_law(sizes.entropy.abs());
    falls(after) && sizes().iter().all(falls)
}

#[cfg(test)]
mod tests {
    use super::{breaks_first_law, breaks_invariants, falls, is_dissipated};
    use crate::step::Laws;

    #[test]
    fn fifty_roundings_of_the_terms_of_a_law_in_a_step_are_round_off() {
        let laws =
            |entropy: f64, invariant: f64| Laws { energy: 0.0, entropy, invariants: [invariant] };
        let start = laws(1.0, 1.0);
        let rounded = |count: f64| 1.0 + count * f64::EPSILON;
        let never = || unreachable!("the value is large enough");
        // Terms that are three times as large as their sum.
        let terms = || [laws(3.0, 3.0), laws(3.5, 3.5)];
        assert!(!breaks_invariants([&start, &laws(1.0, rounded(-40.0))], never));
        assert!(!breaks_invariants([&start, &laws(1.0, rounded(140.0))], terms));
        assert!(breaks_invariants([&start, &laws(1.0, rounded(160.0))], || [
            laws(0.0, 3.0),
            laws(0.0, 3.0)
        ]));
        assert!(!falls([&start, &laws(2.0, 0.0)], never));
        assert!(!falls([&start, &laws(rounded(-140.0), 1.0)], terms));
        assert!(falls([&start, &laws(rounded(-200.0), 1.0)], terms));
    }

    #[test]
    fn what_changes_an_entropy_in_a_million_steps_is_dissipated() {
        let roundings = |count: f64| is_dissipated(count * 1e-6 * f64::EPSILON, -1.0);
        assert!(roundings(2.0) && !roundings(0.5));
    }

    #[test]
    fn a_change_of_a_millionth_of_the_energy_is_no_round_off() {
        // An energy of two terms that nearly cancel: the terms count, and not their sum.
        let breaks = |change| breaks_first_law(change, 1e-9, || [3.0, 2.0]);
        assert_eq!(breaks(1e-6), None);
        assert_eq!(breaks(-4e-6), Some(2.0));
        assert_eq!(
            breaks_first_law(1e-6, 2.0, || unreachable!("the energy is large enough")),
            None
        );
        // Below the last digits of all numbers every change is round-off.
        assert_eq!(breaks_first_law(1e-300, 0.0, || [0.0; 2]), None);
        assert_eq!(breaks_first_law(1e-280, 0.0, || [0.0; 2]), Some(0.0));
    }
}
