//! A metriplectic system as a flow for explicit methods.

use metriplectic_dynamics::velocity::{Covectors, Gradient, irreversible};
use metriplectic_dynamics::{Bracket, Invariants, Metriplectic, SecondLaw, system::Point};
use metriplectic_fields::{
    ChartPoint, Column, Dimension, Jet1, ScalarField, Space, Vector, power_of_two,
};
use metriplectic_manifolds::Manifold;

use super::referred_rise;
use crate::explicit::{Projected, ProjectionError, StageFlow, Target};
use crate::round_off::bound::{INDEPENDENT, NO_DIGITS, of_an_increment_to};
use crate::step::{Components, CountOf, Dim, Laws, Numbers};

type Tangent<Y> = Components<Vector<<Y as Metriplectic>::Manifold>>;

/// The values and differentials of all fields at a point.
struct Jets<'a, M: Space>(&'a M::Point<f64>);

/// The value of a field and its differential.
#[derive(Clone, Copy, Debug)]
struct Jet<V> {
    value: f64,
    df: V,
}

impl<M: Space> Gradient<M> for Jets<'_, M> {
    type Covector = Jet<Vector<M>>;

    #[inline]
    fn of(&mut self, f: &impl ScalarField<M>) -> Self::Covector {
        let Jet1 { value, df } = f.jet1(self.0);
        Jet { value, df }
    }
}

/// The laws of a system at a point, with their differentials.
#[derive(Clone, Copy, Debug)]
pub struct LawJets<N: Dimension, C: Dimension> {
    values: Laws<C::Array<f64>>,
    /// The differentials.
    w: Covectors<C, N::Vector<f64>>,
}

/// The laws of a system with their differentials.
pub(crate) type JetsOf<Y> = LawJets<Dim<Y>, CountOf<Y>>;

impl<N: Dimension, C: Dimension> LawJets<N, C> {
    #[inline]
    fn at<Y>(system: &Y, x: &Point<Y>) -> Self
    where
        Y: Metriplectic<Manifold: Space<Dim = N>, Invariants: Invariants<Y::Manifold, Count = C>>,
    {
        let mut jets = Jets::<Y::Manifold>(x);
        let laws = [jets.of(system.energy()), jets.of(system.entropy())];
        let jets = Covectors::new(laws, system.invariants(), &mut jets);
        let listed = jets.invariants.as_ref();
        let values = Laws {
            energy: jets.energy.value,
            entropy: jets.entropy.value,
            invariants: C::array(|k| listed[k].map_or(0.0, |(_, l)| l.value)),
        };
        let invariants = C::array(|k| listed[k].map(|(kind, l)| (kind, l.df)));
        let w = Covectors { energy: jets.energy.df, entropy: jets.entropy.df, invariants };
        Self { values, w }
    }

    /// The values of the laws.
    pub(crate) const fn values(&self) -> Laws<C::Array<f64>> {
        self.values
    }

    /// The differentials of the laws.
    pub(crate) const fn covectors(&self) -> &Covectors<C, N::Vector<f64>> {
        &self.w
    }

    fn is_finite(&self) -> bool {
        let Self { values, w } = self;
        let listed = w.invariants.as_ref().iter().flatten().zip(values.invariants.as_ref());
        // Zero if all of it is finite, and NaN otherwise.
        let of = |value: f64, w: &N::Vector<f64>| {
            (0..N::LEN).fold(0.0 * value, |sum, i| sum + 0.0 * w[i])
        };
        let laws = of(values.energy, &w.energy) + of(values.entropy, &w.entropy);
        listed.fold(laws, |sum, ((_, l), &value)| sum + of(value, l)) == 0.0
    }
}

impl<Y: Metriplectic> StageFlow for Y {
    type Gradients = JetsOf<Y>;

    #[inline]
    fn gradients(&self, x: &Point<Y>) -> Option<JetsOf<Y>> {
        let jets = LawJets::at(self, x);
        jets.is_finite().then_some(jets)
    }

    #[inline]
    fn values(&self, gradients: &JetsOf<Y>) -> Laws<Numbers<Y>> {
        gradients.values
    }

    #[inline]
    fn entropy_round_off_to(&self, ends: [&Point<Y>; 2], end: &JetsOf<Y>) -> f64 {
        let end = Jet1 { value: end.values.entropy, df: end.w.entropy };
        of_an_increment_to(self, ends, &end)
    }

    #[inline]
    fn velocity(&self, x: &Point<Y>, LawJets { w, .. }: &JetsOf<Y>) -> Option<(Tangent<Y>, f64)> {
        motion(self, x, w)
    }

    #[inline]
    fn motion(&self, x: &Point<Y>) -> Option<(Tangent<Y>, f64)> {
        let jets = LawJets::at(self, x);
        // A differential that is not finite is not in the velocity, or the velocity is not finite either. The end of a step asks for all.
        let Laws { energy, entropy, .. } = jets.values;
        if 0.0 * energy + 0.0 * entropy == 0.0 { motion(self, x, &jets.w) } else { None }
    }

    #[inline]
    fn stage(&self, x: &Point<Y>, q: &Tangent<Y>) -> Option<Point<Y>> {
        if !Y::Manifold::is_stage(&q.0) {
            return None;
        }
        let y = Y::Manifold::stage(x, &q.0);
        self.manifold().is_inside(&y).then_some(y)
    }

    #[inline]
    fn stage_rates(
        &self,
        x: &Point<Y>,
        (q, y): (&Tangent<Y>, &Point<Y>),
        v: &Tangent<Y>,
    ) -> Tangent<Y> {
        Components(Y::Manifold::stage_rates(x, (&q.0, y), &v.0))
    }

    #[inline]
    fn stage_coordinates(&self, x: &Point<Y>, y: &Point<Y>) -> Tangent<Y> {
        Components(Y::Manifold::stage_coordinates(x, y))
    }

    fn falls_below_round_off(&self, x: &Point<Y>, y: &Point<Y>) -> bool {
        referred_rise::falls(self, x, y)
    }

    #[inline]
    fn project(
        &self,
        y: Point<Y>,
        target: &Target<'_, Y>,
    ) -> Result<Projected<Y>, ProjectionError> {
        Projection { system: self, target }.from(y)
    }
}

/// The velocity and the production at a state with these differentials. In place of a call, which would move the
/// differentials of each stage through memory.
#[inline(always)]
fn motion<Y: Metriplectic>(
    system: &Y,
    x: &Point<Y>,
    w: &Covectors<CountOf<Y>, Vector<Y::Manifold>>,
) -> Option<(Tangent<Y>, f64)> {
    let x = ChartPoint::<Y::Manifold>::centre(x);
    let g = system.metric_at(&x);
    let args = system.bracket_args(&g, &w.entropy);
    let reversible = system.bracket().apply(&args, &w.energy).ok()?;
    let friction = irreversible(system, &g, w).ok()?;
    let velocity = reversible + friction;
    velocity.is_finite().then(|| (Components(velocity), w.entropy.dot(&friction)))
}

/// A law made independent of those before it: by Gram and Schmidt on their differentials, with the same
/// combination of their residuals.
#[derive(Clone, Copy, Debug)]
struct Normal<V> {
    /// The components `s_i ∂_iF/f` of its differential, with the units `s` of the entries. The factor `f` is a power of
    /// two near their length, so that no square underflows.
    hat: V,
    /// The square of its length.
    square: f64,
    /// The target less the value, over `f`.
    residual: f64,
    /// The round-off of the residual.
    round_off: f64,
    /// The factor `f`.
    factor: f64,
    /// Whether its differential depends on those before it.
    dependent: bool,
}

impl<V> Normal<V> {
    /// The residual in units of its round-off. What depends on other laws has their residual.
    fn excess(&self) -> f64 {
        if self.dependent || self.residual == 0.0 {
            0.0
        } else {
            self.residual.abs() / self.round_off
        }
    }
}

/// The laws of a system at a point, made independent of each other.
struct Normals<N: Dimension, C: Dimension> {
    energy: Normal<N::Vector<f64>>,
    invariants: C::Array<Option<Normal<N::Vector<f64>>>>,
    entropy: Option<Normal<N::Vector<f64>>>,
    /// The residual of the entropy in units of its round-off, whatever it depends on.
    off: f64,
}

/// The residual of an entropy, in units of its round-off, from which on the round-off of the other laws, which
/// moves it too, is corrected.
/// A factor of four fails `tests/explicit.rs::nothing_drifts_in_a_million_steps`.
pub(crate) const OFF: f64 = 0.8;
/// The most corrections.
/// A factor of four fails `tests/open/traps.rs::a_protocol_that_jumps_is_resolved_by_small_steps`.
pub(crate) const CORRECTIONS: usize = 8;
/// Residuals, in units of round-off, with which a state is accepted that no correction improves.
/// A factor of four fails `tests/dense_output.rs::outputs_keep_the_laws_and_change_no_step`.
pub(crate) const STAGNATED: f64 = 2.0;
/// The limit where no entropy is asked for.
/// A factor of four fails `system/stages.rs::a_state_that_no_correction_improves_is_accepted_without_an_entropy`.
pub(crate) const CONSERVED: f64 = 64.0;

/// A projection along the differentials `s² dF`, where `s_i` is the unit of entry `i`: the shortest correction in these
/// units.
///
/// A metric of the user adds squares of entries that have different units of measurement, so it says nothing of how
/// independent two laws are.
struct Projection<'a, Y: Metriplectic> {
    system: &'a Y,
    target: &'a Target<'a, Y>,
}

impl<Y: Metriplectic> Projection<'_, Y> {
    fn from(&self, mut y: Point<Y>) -> Result<Projected<Y>, ProjectionError> {
        let Self { system, target } = *self;
        let mut moved = 0.0;
        let mut best: Option<(f64, Projected<Y>)> = None;
        for _ in 0..=CORRECTIONS {
            let gradients = LawJets::at(system, &y);
            if !gradients.is_finite() || !system.manifold().is_inside(&y) {
                return Err(ProjectionError::Outside);
            }
            let scales = Y::Manifold::scales(&y);
            let units = target.units.map_or(scales, |units| units.0);
            let normals = self.normals(&gradients, &scales, &units);
            let excess = normals.excess(target.with_entropy)?;
            // Two ends whose entropies are each off by less cannot differ by a fall.
            let is_off = target.with_entropy && normals.off > OFF;
            if excess <= 1.0 && !is_off {
                return Ok(normals.projected(y, gradients, target));
            }
            let excess = if is_off { excess.max(normals.off / OFF) } else { excess };
            if let Some((before, better)) = best.take()
                && before <= excess
            {
                // No correction improves it.
                return self.stagnated(before, better);
            }
            if target.with_entropy && normals.is_blurred() {
                return Err(ProjectionError::NoEntropy);
            }
            let correction = normals.correction(target.with_entropy, is_off);
            moved += correction.magnitude();
            let limit = target.limit.map(|limit| in_units(&limit.entries().0, &units).magnitude());
            if !moved.is_finite() || limit.is_some_and(|limit| moved > limit) {
                return Err(ProjectionError::Far);
            }
            let u = Vector::<Y::Manifold>::from_index(|i| units[i] * correction[i]);
            let unseen = (0..Dim::<Y>::LEN).all(|i| u[i].abs() <= f64::EPSILON * scales[i]);
            let next = Y::Manifold::chart(&y, &u);
            let here = normals.projected(std::mem::replace(&mut y, next), gradients, target);
            if unseen && excess <= CONSERVED {
                return Ok(here);
            }
            best = Some((excess, here));
        }
        match best {
            Some((excess, here)) => self.stagnated(excess, here),
            None => Err(ProjectionError::Far),
        }
    }

    /// Decides on the best state, if no correction improves it.
    fn stagnated(&self, excess: f64, best: Projected<Y>) -> Result<Projected<Y>, ProjectionError> {
        match self.target.with_entropy {
            _ if excess <= STAGNATED => Ok(best),
            true => Err(ProjectionError::NoEntropy),
            false if excess <= CONSERVED => Ok(best),
            false => Err(ProjectionError::Far),
        }
    }

    fn normals(
        &self,
        LawJets { values, w }: &JetsOf<Y>,
        scales: &Vector<Y::Manifold>,
        units: &Vector<Y::Manifold>,
    ) -> Normals<Dim<Y>, CountOf<Y>> {
        let laws = self.target.laws;
        let normal = |w: &Vector<Y::Manifold>, target: f64, value: f64| {
            let whole = Vector::<Y::Manifold>::from_index(|i| units[i] * w[i]);
            let length = whole.magnitude();
            // No displacement of a unit changes a law whose differential has no digits.
            let (whole, factor) = if length > NO_DIGITS {
                (whole, power_of_two(length))
            } else {
                (Vector::<Y::Manifold>::zero(), 1.0)
            };
            let hat = whole * factor.recip();
            let terms = 2.0 * target.abs() + w.abs().dot(scales);
            Normal {
                hat,
                square: hat.dot(&hat),
                residual: (target - value) / factor,
                round_off: f64::EPSILON * terms / factor + NO_DIGITS / factor,
                factor,
                dependent: false,
            }
        };
        let energy = normal(&w.energy, laws.energy, values.energy);
        let mut normals = Normals::<Dim<Y>, CountOf<Y>> {
            energy: Normal { dependent: energy.square == 0.0, ..energy },
            invariants: CountOf::<Y>::array(|_| None),
            entropy: None,
            off: 0.0,
        };
        for (k, listed) in w.invariants.as_ref().iter().enumerate() {
            let Some((_, l)) = listed else { break };
            let whole = normal(l, laws.invariants[k], values.invariants[k]);
            normals.enter(k, whole);
        }
        if self.system.second_law() == SecondLaw::Exact {
            let whole = normal(&w.entropy, laws.entropy, values.entropy);
            normals.off = whole.excess();
            normals.entropy = Some(normals.independent(whole));
        }
        normals
    }
}

/// The components `v_i/s_i`; those of an entry without a unit vanish.
fn in_units<V: Column<f64>>(v: &V, units: &V) -> V {
    V::from_index(|i| if v[i] == 0.0 { 0.0 } else { v[i] / units[i] })
}

impl<N: Dimension, C: Dimension> Normals<N, C> {
    fn enter(&mut self, k: usize, whole: Normal<N::Vector<f64>>) {
        let independent = self.independent(whole);
        self.invariants[k] = Some(independent);
    }

    /// Removes the part of a law that depends on those before it.
    fn independent(&self, whole: Normal<N::Vector<f64>>) -> Normal<N::Vector<f64>> {
        let mut normal = whole;
        // The second pass removes the rounding error of the first.
        for _ in 0..2 {
            self.each_before(|before| {
                let share = before.hat.dot(&normal.hat) / before.square;
                normal.hat -= before.hat * share;
                normal.residual -= share * before.residual;
                normal.round_off += share.abs() * before.round_off;
            });
        }
        normal.square = normal.hat.dot(&normal.hat);
        let independent = normal.square > INDEPENDENT * INDEPENDENT * whole.square;
        Normal { dependent: !independent, ..normal }
    }

    /// Visits the independent laws so far. Without further invariants no loop is left, which an iterator would keep.
    #[inline(always)]
    fn each_before(&self, mut visit: impl FnMut(&Normal<N::Vector<f64>>)) {
        if !self.energy.dependent {
            visit(&self.energy);
        }
        for normal in self.invariants.as_ref().iter().flatten() {
            if !normal.dependent {
                visit(normal);
            }
        }
    }

    /// The largest residual in units of its round-off.
    ///
    /// # Errors
    ///
    /// [`ProjectionError::NoEntropy`] if the entropy depends on the other laws, and has another value.
    fn excess(&self, with_entropy: bool) -> Result<f64, ProjectionError> {
        let mut conserved: f64 = 0.0;
        self.each_before(|normal| conserved = conserved.max(normal.excess()));
        match &self.entropy {
            Some(entropy) if with_entropy => {
                if entropy.dependent && entropy.residual.abs() > entropy.round_off {
                    return Err(ProjectionError::NoEntropy);
                }
                Ok(conserved.max(entropy.excess()))
            }
            _ => Ok(conserved),
        }
    }

    /// Returns whether the round-off of the entropy is as long as a unit: a state moved onto an entropy has an error then which
    /// no smaller step makes smaller.
    fn is_blurred(&self) -> bool {
        let length = |entropy: &Normal<_>| entropy.round_off / entropy.square.sqrt();
        self.entropy.iter().any(|entropy| !entropy.dependent && length(entropy) > 1.0)
    }

    /// The correction, in units of the entries. A residual below half its round-off is left, unless the last digits
    /// are asked for.
    fn correction(&self, with_entropy: bool, last_digits: bool) -> N::Vector<f64> {
        let least = if last_digits { 0.0 } else { 0.5 };
        let mut sum = N::Vector::<f64>::zero();
        let mut add = |normal: &Normal<N::Vector<f64>>| {
            if normal.excess() > least {
                sum += normal.hat * (normal.residual / normal.square);
            }
        };
        self.each_before(&mut add);
        match &self.entropy {
            Some(entropy) if with_entropy && !entropy.dependent => add(entropy),
            _ => {}
        }
        sum
    }

    fn projected<Y>(
        &self,
        x: Point<Y>,
        gradients: JetsOf<Y>,
        target: &Target<'_, Y>,
    ) -> Projected<Y>
    where
        Y: Metriplectic<Manifold: Space<Dim = N>, Invariants: Invariants<Y::Manifold, Count = C>>,
    {
        let (residual, entropy_round_off) = self.entropy.map_or((0.0, 0.0), |entropy| {
            (entropy.residual * entropy.factor, entropy.round_off * entropy.factor)
        });
        let entropy = target.laws.entropy - residual;
        Projected { x, gradients, entropy, entropy_round_off }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use metriplectic_dynamics::{Symplectic, System};
    use metriplectic_fields::Real;
    use metriplectic_manifolds::Euclidean;
    use nalgebra::{Vector2, Vector3, vector};

    use crate::step::Flow as _;

    #[test]
    fn a_state_that_no_correction_improves_is_accepted_without_an_entropy() {
        let system = System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy(|x: &Vector2<Real>| x.norm_squared() * 0.5)
            .build()
            .unwrap();
        let x = vector![1.0, 0.5];
        let laws = system.laws(&x);
        let target =
            Target { laws: &laws, with_entropy: false, limit: None, units: None, error: None };
        let projection = Projection { system: &system, target: &target };
        let accepted = |excess: f64| {
            let best = projection.from(x).unwrap();
            projection.stagnated(excess, best).is_ok()
        };
        assert!(accepted(40.0) && !accepted(100.0));
    }

    #[test]
    fn a_law_with_a_part_of_ten_billionths_is_independent() {
        let is_independent = |part: f64| {
            let system = System::on(Euclidean::<3>)
                .energy(|x: &Vector3<Real>| x.x + x.y)
                .entropy(|x: &Vector3<Real>| x.y)
                .casimir(move |x: &Vector3<Real>| x.x + x.y + x.z * part * 2_f64.sqrt())
                .build()
                .unwrap();
            let x = vector![1.0, 1.0, 1.0];
            let laws = system.laws(&x);
            let target =
                Target { laws: &laws, with_entropy: false, limit: None, units: None, error: None };
            let projection = Projection { system: &system, target: &target };
            let normals = projection.normals(&LawJets::at(&system, &x), &x, &x);
            !normals.invariants[0].is_none_or(|normal| normal.dependent)
        };
        assert!(is_independent(2e-10) && !is_independent(5e-11));
    }
}
