//! The rise of the entropy near an equilibrium, where it is below the round-off of its values.
//!
//! At an equilibrium `dS = β dH + Σ γ_a dL_a`. A deviation `δ` from it lowers the entropy by `O(δ²)`, which two
//! values show only if `|δ| > √ε`. The integral along the straight line between two states,
//!
//! ```math
//! \int_0^1 \langle dS - \beta\, dH - \textstyle\sum_a \gamma_a\, dL_a,\; d \rangle\, dt , \qquad
//! \varphi_x(d) = x' ,
//! ```
//!
//! with `β` and `γ_a` of its middle, is the same rise for states of one energy. Both of its factors are `O(δ)`, so it
//! shows deviations down to `ε`.

use metriplectic_dynamics::velocity::{Covectors, differentials};
use metriplectic_dynamics::{Invariants as _, Metriplectic, system::Point};
use metriplectic_fields::{ChartPoint, Column, Dimension, Space, Vector};
use metriplectic_manifolds::Manifold;

use crate::round_off::bound::INDEPENDENT;
use crate::step::CountOf;

/// The rounding of a differential, and of a product with it, in units of `ε` of its terms.
/// A factor of four fails `tests/explicit.rs::a_start_beside_an_unstable_axis_leaves_it_with_friction_that_produces_nothing`.
pub(crate) const ROUNDING: f64 = 8.0;

/// A law along a line: its differentials at the start, in the middle and at the end, made independent of others.
#[derive(Clone, Copy, Debug)]
struct Along<V> {
    w: [V; 3],
    /// The absolute terms of the differential in the middle.
    terms: V,
    /// The components `s_i ∂_iF` of the differential in the middle, with the sizes `s` of the entries.
    hat: V,
    square: f64,
}

impl<V: Column<f64>> Along<V> {
    /// Removes the part that depends on another law.
    fn without(self, law: &Self) -> Self {
        let has_digits = law.square > 0.0;
        if !has_digits {
            return self;
        }
        let share = law.hat.dot(&self.hat) / law.square;
        let with = |k: usize| self.w[k] + law.w[k] * -share;
        let w = [with(0), with(1), with(2)];
        let (hat, terms) = (self.hat - law.hat * share, self.terms + law.terms * share.abs());
        Self { w, terms, hat, square: hat.dot(&hat) }
    }
}

/// Returns whether the entropy falls from `x` to the near state `y` by more than the error of the integral. The error
/// is its rounding, and the difference of Simpson's rule and the trapezoidal rule, which agree on a quadratic entropy.
pub(super) fn falls<Y: Metriplectic>(system: &Y, x: &Point<Y>, y: &Point<Y>) -> bool {
    let d = Y::Manifold::coordinates::<f64>(x, y);
    let at = |t| differentials(system, &ChartPoint::<Y::Manifold> { base: x.clone(), q: d * t });
    let (start, middle, end) = (at(0.0), at(0.5), at(1.0));
    let scales = Y::Manifold::scales(x);
    let law = |w: [Vector<Y::Manifold>; 3]| {
        let hat = Vector::<Y::Manifold>::from_index(|i| scales[i].max(d[i].abs()) * w[1][i]);
        Along { w, terms: w[1].abs(), hat, square: hat.dot(&hat) }
    };
    let energy = law([start.energy, middle.energy, end.energy]);
    let mut listed = CountOf::<Y>::array(|_| None);
    let independent =
        |whole: Along<_>, listed: &<CountOf<Y> as Dimension>::Array<Option<Along<_>>>| {
            // The second pass removes the rounding error of the first.
            let mut rest = whole;
            for _ in 0..2 {
                rest = rest.without(&energy);
                if const { Y::Invariants::COUNT > 0 } {
                    rest = listed.as_ref().iter().flatten().fold(rest, Along::without);
                }
            }
            rest
        };
    if const { Y::Invariants::COUNT > 0 } {
        for k in 0..Y::Invariants::COUNT {
            let of = |w: &Covectors<CountOf<Y>, _>| w.invariants[k].map(|(_, l)| l);
            let (before, between, after) = (of(&start), of(&middle), of(&end));
            let (Some(before), Some(between), Some(after)) = (before, between, after) else {
                break;
            };
            let whole = law([before, between, after]);
            let rest = independent(whole, &listed);
            let is_new = rest.square > INDEPENDENT * INDEPENDENT * whole.square;
            listed[k] = is_new.then_some(rest);
        }
    }
    let entropy = independent(law([start.entropy, middle.entropy, end.entropy]), &listed);
    let [before, between, after] = &entropy.w;
    let (before, between, after) = (before.dot(&d), between.dot(&d), after.dot(&d));
    let (simpson, trapezoid) = ((before + 4.0 * between + after) / 6.0, 0.5 * (before + after));
    let rounding = entropy.terms.dot(&d.abs()) + entropy.w[1].abs().dot(&scales);
    simpson + (simpson - trapezoid).abs() + ROUNDING * f64::EPSILON * rounding < 0.0
}
