//! States inside a step.
//!
//! In the chart at the start `x` of a step, with the coordinates `q₁` of its end and the velocity `f`, the cubic
//! of Hermite is
//!
//! ```math
//! q(\theta) = \theta^2 (3 - 2\theta)\, q_1 + \theta (1 - \theta)^2\, h f(0) - \theta^2 (1 - \theta)\, h f(q_1) .
//! ```
//!
//! Its error is `O(h⁴)`, and it breaks the laws by as much. So the state is moved onto them: onto the energy and
//! the further invariants of the run, and onto the entropy `S(θ)`, which is the cubic with the production `σ` as
//! its slope at both ends. Its slopes are limited after Fritsch and Carlson (1980), so that `S(θ)` is monotone: at
//! any two times in a step the later entropy is not the smaller one.

use metriplectic_dynamics::SecondLaw;

use super::{Element, Entries, Flow, Laws, PlainFlow, Promises, StepEnds, Vector, both};

/// The cubic of Hermite in the chart at the start of a step.
#[derive(Clone, Debug)]
pub(crate) struct Hermite<V> {
    end: V,
    slopes: [V; 2],
}

impl<V: Vector> Hermite<V> {
    /// The cubic through a step; `None` if the flow does not say what lies between its ends. Where the velocity
    /// has no value it is a straight line.
    pub(crate) fn through<F: Flow<Vector = V> + ?Sized>(step: &StepEnds<'_, F>) -> Option<Self> {
        let flow = step.flow;
        let end = flow.displacement(step.x, step.end)?;
        let slope = |q: &V| Some(flow.rates(step.x, q)?.map(|v| step.h * v));
        let slopes = slope(&end.map(|_| 0.0)).and_then(|start| Some([start, slope(&end)?]));
        Some(Self { slopes: slopes.unwrap_or_else(|| [end.clone(), end.clone()]), end })
    }

    /// The displacement from the start at the fraction `θ`.
    pub(crate) fn at(&self, theta: f64) -> V {
        let [start, end] = &self.slopes;
        self.end.with(|i| cubic(self.end.get(i), [start.get(i), end.get(i)], theta))
    }
}

/// Returns whether a flow says what lies between two states that are near each other.
pub(crate) fn says_between<F: Flow + ?Sized>(flow: &F, x: &Element<F>) -> bool {
    flow.displacement(x, x).is_some()
}

/// The cubic from 0 to `rise` with these slopes.
pub(crate) fn cubic(rise: f64, [start, end]: [f64; 2], theta: f64) -> f64 {
    let rest = 1.0 - theta;
    theta * (theta * (3.0 - 2.0 * theta) * rise + rest * (rest * start - theta * end))
}

/// The largest slopes for which the cubic from 0 to `rise` is monotone, at most the given ones (Fritsch, Carlson
/// 1980, eq. 4): those in the circle of radius 3 around 0 in units of the rise.
pub(crate) fn limited(rise: f64, slopes: [f64; 2]) -> [f64; 2] {
    let units = slopes.map(|slope| (slope / rise).max(0.0));
    let radius = units[0].hypot(units[1]);
    let factor = if radius > 3.0 { 3.0 / radius } else { 1.0 };
    units.map(|unit| unit * factor * rise)
}

/// The entropy at the fraction `θ` of a step. A rise that is not positive is round-off: the entropy is then the
/// one at the start.
fn entropy<F: Flow + ?Sized>(step: &StepEnds<'_, F>, theta: f64) -> f64 {
    let [start, end] = both(step.values, |laws| laws.entropy);
    let rise = end - start;
    if rise <= 0.0 {
        return start;
    }
    let slope = |x| step.flow.production(x).filter(|slope| slope.is_finite());
    let slopes = match (slope(step.x), slope(step.end)) {
        (Some(a), Some(b)) => limited(rise, [step.h * a, step.h * b]),
        _ => [rise, rise],
    };
    (start + cubic(rise, slopes, theta)).min(end)
}

/// Computes the laws at the fraction `θ` of a step: a law that is promised has the value of the run, as far as
/// both ends have it; another one goes from its value at the start to that at the end.
fn targets<F: Flow + ?Sized>(
    step: &StepEnds<'_, F>,
    promises: Promises,
    theta: f64,
) -> Laws<F::Numbers> {
    let target = |promised, reference: f64, [start, end]: [f64; 2]| {
        if promised {
            reference.max(start.min(end)).min(start.max(end))
        } else {
            start + theta * (end - start)
        }
    };
    let [start, end] = step.values;
    let mut laws = start.clone();
    laws.energy = target(promises.energy, step.reference.energy, [start.energy, end.energy]);
    for k in 0..start.invariants.as_ref().len() {
        let of = |laws: &Laws<F::Numbers>| laws.invariants.as_ref()[k];
        let (a, b, reference) = (of(start), of(end), of(step.reference));
        laws.invariants[k] = target(promises.invariants, reference, [a, b]);
    }
    laws
}

/// The state at the fraction `θ` of a step; `None` if the flow does not say what lies between its ends.
#[inline(never)]
pub(crate) fn between<F: Flow + ?Sized>(
    step: &StepEnds<'_, F>,
    promises: Promises,
    theta: f64,
) -> Option<Element<F>> {
    let flow = step.flow;
    if theta <= 0.0 || step.x == step.end {
        return Some(step.x.clone());
    }
    if theta >= 1.0 {
        return Some(step.end.clone());
    }
    let curve = Hermite::through(step)?;
    let has_entropy = promises.entropy && flow.entropy_law() != SecondLaw::NoEntropy;
    let target = has_entropy.then(|| entropy(step, theta));
    let y = flow.moved(step.x, &curve.at(theta));
    let line = || flow.moved(step.x, &curve.end.map(|q| theta * q));
    let target = Target::new(step, promises, theta, target);
    Some(target.reached_from(&y, line))
}

/// The state at the fraction `θ` of a step in plain numbers: compiled with this library.
#[inline(never)]
pub(crate) fn between_in_numbers(
    step: &StepEnds<'_, PlainFlow<'_>>,
    promises: Promises,
    theta: f64,
) -> Option<Entries> {
    between(step, promises, theta)
}

/// The target of the state at the fraction `θ` of a step: the laws of the run, and an entropy.
pub(crate) struct Target<'a, F: Flow + ?Sized> {
    step: &'a StepEnds<'a, F>,
    laws: Laws<F::Numbers>,
    entropy: Option<f64>,
    theta: f64,
}

impl<'a, F: Flow + ?Sized> Target<'a, F> {
    pub(crate) fn new(
        step: &'a StepEnds<'a, F>,
        promises: Promises,
        theta: f64,
        entropy: Option<f64>,
    ) -> Self {
        Self { step, laws: targets(step, promises, theta), entropy, theta }
    }

    /// The state near `y` with these laws. If `y` is too far from them, the state on the straight line is moved onto
    /// them, and at last it is the nearer end, where the laws hold.
    pub(crate) fn reached_from(
        &self,
        y: &Element<F>,
        line: impl FnOnce() -> Element<F>,
    ) -> Element<F> {
        let &Self { step, theta, .. } = self;
        let near = || if theta < 0.5 { step.x.clone() } else { step.end.clone() };
        self.near(y).or_else(|| self.near(&line())).unwrap_or_else(near)
    }

    /// The state near `y` with these laws, or near an equilibrium with all but the entropy.
    pub(crate) fn near(&self, y: &Element<F>) -> Option<Element<F>> {
        let &Self { step, ref laws, entropy, .. } = self;
        let flow = step.flow;
        let on_all = flow.onto(y, laws, entropy);
        if on_all.is_some() || entropy.is_none() {
            return on_all;
        }
        // Near an equilibrium the other laws determine the entropy.
        let [least, most] = both(step.values, |laws| laws.entropy);
        let round_off = flow.entropy_round_off([step.x, step.end]);
        flow.onto(y, laws, None).filter(|y| {
            let entropy = flow.laws(y).entropy;
            entropy >= least - round_off && entropy <= most + round_off
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_limited_cubic_is_monotone(
            rise in 1e-12_f64..1e3, slopes in prop::array::uniform2(-10.0..1e4_f64),
        ) {
            let slopes = limited(rise, slopes.map(|slope| slope * rise));
            let values: Vec<f64> =
                (0..=200).map(|i| cubic(rise, slopes, f64::from(i) / 200.0)).collect();
            prop_assert!(values.is_sorted_by(|a, b| *b >= a - 1e-14 * rise));
            prop_assert!(values[0] == 0.0 && (values[200] - rise).abs() <= 1e-15 * rise);
        }

        #[test]
        fn a_cubic_is_reproduced(c in prop::array::uniform3(-1.0..1.0_f64), theta in 0.0..1.0_f64) {
            let f = |t: f64| t * (c[0] + t * (c[1] + t * c[2]));
            let slope = |t: f64| c[0] + t * (2.0 * c[1] + t * 3.0 * c[2]);
            let off = cubic(f(1.0), [slope(0.0), slope(1.0)], theta) - f(theta);
            prop_assert!(off.abs() < 1e-14);
        }
    }

    #[test]
    fn slopes_that_keep_the_cubic_monotone_are_kept() {
        assert_eq!(limited(2.0, [1.0, 3.0]).map(f64::to_bits), [1.0, 3.0].map(f64::to_bits));
        assert_eq!(limited(2.0, [-1.0, 12.0]).map(f64::to_bits), [0.0, 6.0].map(f64::to_bits));
    }
}
