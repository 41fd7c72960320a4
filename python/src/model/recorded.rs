//! A system of tapes at values of its parameters, which answers the questions of the library in plain numbers.

use std::fmt;
use std::sync::Arc;

use metriplectic_equations::judge::coordinate_scales;
use metriplectic_equations::room::with_numbers;
use metriplectic_equations::{
    Covectors, ENERGY, ENTROPY, Equations, FrictionTerms, Jet, Kind, MetricError, Model, Part,
    Paths, PointError, SecondLaw, Sizes, Terms,
};
use metriplectic_fields::Real;
use metriplectic_recording::Tape;

use super::along::{Along, law_of};
use super::bracket::Poisson;
use super::definition::{self, Definition};
use super::error::DefinitionError;
use super::friction::{Around, Rub};
use super::law::Law;
use super::layout::put_block;
use super::metric::{Inner, Metric};
use super::normals::{Normals, dot};
use super::reals::with_reals;
use super::space::{Layout, Placed};
use super::tapes::{self, OfState};

/// A system of tapes at values of its parameters. Derivatives are those of the tapes and of the charts, and no differences.
///
/// A clone is cheap.
#[derive(Clone)]
pub struct Recorded {
    inner: Arc<Bound>,
    /// The parameters along which it knows its derivatives.
    along: Option<Arc<Along>>,
}

/// The parts of a system with the values of the parameters in them.
struct Bound {
    definition: Arc<Definition>,
    theta: Vec<f64>,
    around: Around,
    energy: Law,
    entropy: Option<Law>,
    invariants: Vec<(Kind, Law)>,
    bracket: Poisson,
    friction: Rub,
    in_time: bool,
}

// By hand, because a tape may have millions of instructions.
impl fmt::Debug for Recorded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Recorded").field("theta", &self.inner.theta).finish_non_exhaustive()
    }
}

/// Puts the values of the parameters into the tape of a law.
fn bound(
    part: &'static str,
    tape: &Tape,
    outputs: usize,
    layout: tapes::Layout<'_>,
) -> Result<OfState, DefinitionError> {
    definition::expect(part, tape, layout.inputs(), outputs)?;
    OfState::bound(tape, layout).map_err(|source| DefinitionError::Tape { part, source })
}

/// Refuses a law that depends on the time.
fn at_rest(part: &'static str, tape: OfState) -> Result<OfState, DefinitionError> {
    if tape.in_time { Err(DefinitionError::InTime { part }) } else { Ok(tape) }
}

impl Recorded {
    /// Makes the system of a definition at values of its parameters.
    ///
    /// # Errors
    ///
    /// [`DefinitionError`] with the first part that makes no sense.
    pub fn new(
        definition: impl Into<Arc<Definition>>,
        theta: &[f64],
    ) -> Result<Self, DefinitionError> {
        let definition = definition.into();
        let (found, expected) = (theta.len(), definition.parameters.len());
        if found != expected {
            return Err(DefinitionError::Parameters { found, expected });
        }
        if let Some(k) = theta.iter().position(|value| !value.is_finite()) {
            let name = definition.parameters[k].clone();
            return Err(DefinitionError::ParameterNotFinite { name, value: theta[k] });
        }
        let (space, layout) = (&definition.space, Layout::of(&definition.space));
        let of_state = tapes::Layout { states: layout.entries, theta };
        let energy = Law(bound("energy", &definition.energy, 1, of_state)?);
        let entropy = definition.entropy.as_ref().map(|tape| {
            let part = "entropy";
            at_rest(part, bound(part, tape, 1, of_state)?).map(Law)
        });
        let entropy = entropy.transpose()?;
        let invariants = definition.invariants.iter().map(|(kind, tape)| {
            let part = "invariant";
            Ok((*kind, Law(at_rest(part, bound(part, tape, 1, of_state)?)?)))
        });
        let invariants = invariants.collect::<Result<Vec<_>, DefinitionError>>()?;
        let metric = definition.metric.as_ref().map(|tape| {
            let (part, n) = ("metric", layout.directions);
            if !layout.is_flat {
                return Err(DefinitionError::Metric { space: space.to_string() });
            }
            Ok(Metric::new(n, at_rest(part, bound(part, tape, n * n, of_state)?)?))
        });
        let metric = metric.transpose()?;
        let bracket = Poisson::of(&definition.bracket, space, theta)?;
        let friction = Rub::of(&definition.friction, &layout, theta)?;
        if !friction.is_none() && entropy.is_none() {
            return Err(DefinitionError::FrictionWithoutEntropy);
        }
        let in_time = energy.0.in_time || bracket.in_time() || friction.in_time();
        let inner = Bound {
            theta: theta.to_vec(),
            around: Around { layout, metric },
            energy,
            entropy,
            invariants,
            bracket,
            friction,
            in_time,
            definition: Arc::clone(&definition),
        };
        Ok(Self { inner: Arc::new(inner), along: None })
    }

    /// Makes the same system at other values of its parameters.
    ///
    /// # Errors
    ///
    /// [`DefinitionError`] with another number of parameters, or one that is not finite.
    pub fn at(&self, theta: &[f64]) -> Result<Self, DefinitionError> {
        Self::new(Arc::clone(&self.inner.definition), theta)
    }

    /// Makes the same system with its derivatives along the parameters at these places, on a flat space with the canonical metric; it
    /// knows none elsewhere.
    ///
    /// # Errors
    ///
    /// [`DefinitionError`] if a tape grows too large.
    pub fn along(&self, places: &[usize]) -> Result<Self, DefinitionError> {
        let is_known = self.layout().is_flat && self.inner.around.metric.is_none();
        let along = is_known.then(|| Along::of(&self.inner.definition, places).map(Arc::new));
        Ok(Self { inner: Arc::clone(&self.inner), along: along.transpose()? })
    }

    /// The definition.
    #[must_use]
    pub fn definition(&self) -> &Arc<Definition> {
        &self.inner.definition
    }

    /// The values of the parameters.
    #[must_use]
    pub fn theta(&self) -> &[f64] {
        &self.inner.theta
    }

    /// Returns whether the friction is known as a sum of terms, of which thermal noise is made: contacts on a flat space, or the friction
    /// of the canonical metric.
    #[must_use]
    pub fn has_terms(&self) -> bool {
        self.inner.friction.term_count(&self.inner.around).is_some()
    }

    fn layout(&self) -> &Layout {
        &self.inner.around.layout
    }

    /// The law with a number; `None` for an entropy that is zero.
    fn law(&self, law: usize) -> Option<&Law> {
        match law {
            ENERGY => Some(&self.inner.energy),
            ENTROPY => self.inner.entropy.as_ref(),
            _ => Some(&self.inner.invariants[law - ENTROPY - 1].1),
        }
    }

    fn count(&self) -> usize {
        ENTROPY + 1 + self.inner.invariants.len()
    }

    /// Computes the velocity and the production at a state with these differentials of all laws; `None` where they have no value.
    #[inline]
    fn motion(&self, t: f64, x: &[f64], w: &[f64], v: &mut [f64]) -> Option<f64> {
        let (n, Bound { around, bracket, friction, invariants, entropy, .. }) =
            (v.len(), &*self.inner);
        let (energy, of_entropy) = (&w[..n], &w[n..2 * n]);
        let rubs = !friction.is_none() && entropy.is_some();
        let production = with_numbers(2 * n, |room| {
            let (still, k) = room.split_at_mut(n);
            bracket.apply(t, (x, still), energy, v).ok()?;
            if !rubs {
                return Some(0.0);
            }
            if invariants.is_empty() {
                friction.apply(around, t, (x, still), [energy, of_entropy], k).ok()?;
            } else {
                self.projected(t, x, w, still, k)?;
            }
            v.iter_mut().zip(&*k).for_each(|(v, k)| *v += k);
            Some(dot(of_entropy, k))
        })?;
        v.iter().all(|v| v.is_finite()).then_some(production)
    }

    /// Computes `Q K_w Qᵀ dS`, where `Q` projects off the parts of the further invariants that are orthogonal to `dH`.
    fn projected(&self, t: f64, x: &[f64], w: &[f64], still: &[f64], k: &mut [f64]) -> Option<()> {
        let (n, Bound { around, friction, .. }) = (k.len(), &*self.inner);
        let rows = w.len() / n;
        let applied = around.with_inner(x, |inner| {
            with_numbers(Normals::room(n, rows) + n, |room| {
                let (alpha, room) = room.split_at_mut(n);
                let mut normals = Normals::new(inner, n, room);
                normals.push(&w[..n]);
                let first = normals.len();
                w.chunks_exact(n).skip(ENTROPY + 1).for_each(|l| {
                    normals.push(l);
                });
                alpha.copy_from_slice(&w[n..2 * n]);
                normals.project_covector(first, alpha);
                friction.apply(around, t, (x, still), [&w[..n], alpha], k)?;
                normals.project_vector(first, k);
                Ok::<(), MetricError>(())
            })
        });
        applied.ok()?.ok()
    }
}

impl Equations for Recorded {
    fn sizes(&self) -> Sizes {
        let layout = self.layout();
        Sizes { entries: layout.entries, directions: layout.directions, laws: self.count() }
    }

    fn values(&self, t: f64, x: &[f64], values: &mut [f64]) {
        for (law, value) in values.iter_mut().enumerate() {
            *value = self.value(law, t, x);
        }
    }

    fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        let rows = w.chunks_exact_mut(self.layout().directions);
        for (law, (value, row)) in values.iter_mut().zip(rows).enumerate() {
            *value = self.jet(law, t, x, row);
        }
    }

    fn velocity(&self, t: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
        let (laws, n) = (self.count(), v.len());
        with_numbers(laws * (n + 1), |room| {
            let (values, w) = room.split_at_mut(laws);
            self.differentials(t, x, values, w);
            let is_finite = values.iter().chain(&*w).all(|number| number.is_finite());
            if is_finite { self.motion(t, x, w, v) } else { None }
        })
    }

    fn velocity_with(&self, t: f64, x: &[f64], w: &[f64], v: &mut [f64]) -> Option<f64> {
        self.motion(t, x, w, v)
    }

    fn second_law(&self) -> SecondLaw {
        if self.inner.entropy.is_some() { SecondLaw::Exact } else { SecondLaw::NoEntropy }
    }

    fn kind(&self, invariant: usize) -> Kind {
        self.inner.invariants[invariant].0
    }

    /// Returns whether energy, bracket or friction depend on time: a closed run would freeze any of them.
    fn energy_depends_on_time(&self) -> bool {
        self.inner.in_time
    }

    fn power(&self, t: f64, x: &[f64]) -> f64 {
        self.inner.energy.power(t, x)
    }

    fn check(&self, x: &[f64]) -> Result<(), PointError> {
        self.layout().check(x)
    }

    fn defect(&self, x: &[f64]) -> f64 {
        self.layout().defect(x)
    }

    fn scales(&self, x: &[f64], sizes: &mut [f64]) {
        self.layout().scales(x, sizes);
    }

    fn is_vector_space(&self) -> bool {
        self.layout().is_flat
    }

    fn chart(&self, x: &[f64], q: &[f64], y: &mut [f64]) {
        self.layout().chart(x, q, y);
    }

    fn coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) -> bool {
        self.layout().coordinates(x, y, q)
    }

    fn stage_state(&self, x: &[f64], q: &[f64], y: &mut [f64]) -> bool {
        self.layout().stage_state(x, q, y)
    }

    fn stage_coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) {
        self.layout().stage_coordinates(x, y, q);
    }

    fn stage_rates(&self, x: &[f64], q: &[f64], y: &[f64], v: &[f64], rates: &mut [f64]) {
        self.layout().stage_rates(x, q, y, v, rates);
    }

    fn model(&self) -> Option<&dyn Model> {
        Some(self)
    }
}

impl Model for Recorded {
    fn is_zero(&self, part: Part) -> bool {
        match part {
            Part::Reversible => self.inner.bracket.is_zero(),
            Part::Gyroscopic => true,
            Part::Irreversible => self.inner.friction.is_none(),
        }
    }

    fn is_poisson(&self) -> bool {
        self.inner.bracket.is_poisson
    }

    fn adapts(&self) -> bool {
        self.inner.friction.is_of_metric()
    }

    fn has_canonical_metric(&self) -> bool {
        self.inner.around.metric.is_none()
    }

    fn paths(&self) -> Option<&dyn Paths> {
        Some(&self.inner.around)
    }

    fn value(&self, law: usize, t: f64, x: &[f64]) -> f64 {
        self.law(law).map_or(0.0, |law| law.value(t, x))
    }

    fn along(&self, law: usize, t: f64, x: &[f64], [u, v]: [&[f64]; 2]) -> [f64; 4] {
        let Some(law) = self.law(law) else { return [0.0; 4] };
        with_reals(u.len(), |q| {
            (0..u.len()).for_each(|i| q[i] = Real::new(0.0, u[i], v[i], 0.0));
            let f = law.real(self.layout(), t, x, q);
            [f.re, f.eps1, f.eps2, f.eps1eps2]
        })
    }

    #[inline]
    fn jet(&self, law: usize, t: f64, x: &[f64], df: &mut [f64]) -> f64 {
        match self.law(law) {
            Some(law) => law.jet(self.layout(), t, x, df),
            None => {
                df.fill(0.0);
                0.0
            }
        }
    }

    fn hessian(&self, law: usize, t: f64, x: &[f64], df: &mut [f64], hf: &mut [f64]) -> f64 {
        match self.law(law) {
            Some(law) => law.hessian(self.layout(), t, x, df, hf),
            None => {
                df.fill(0.0);
                hf.fill(0.0);
                0.0
            }
        }
    }

    fn differential_at(&self, law: usize, t: f64, x: &[f64], q: &[f64], df: &mut [f64]) {
        match self.law(law) {
            Some(law) => law.differential_at(self.layout(), t, x, q, df),
            None => df.fill(0.0),
        }
    }

    fn hessian_at(&self, law: usize, t: f64, x: &[f64], q: &[f64], hf: &mut [f64]) {
        match self.law(law) {
            Some(law) => law.hessian_at(self.layout(), t, x, q, hf),
            None => hf.fill(0.0),
        }
    }

    /// As that of a system in types: fractions in units of the sizes of the coordinates.
    fn independence(&self, t: f64, x: &[f64], fractions: &mut [f64]) {
        if fractions.is_empty() {
            return;
        }
        let (n, laws) = (self.layout().directions, self.count());
        let units = coordinate_scales(self, t, x).units;
        let is_exact = self.second_law() == SecondLaw::Exact;
        with_numbers(laws * (n + 1), |room| {
            let (values, w) = room.split_at_mut(laws);
            self.differentials(t, x, values, w);
            let row = |law: usize| &w[law * n..][..n];
            let size = Normals::room(n, laws);
            with_numbers(2 * size, |room| {
                let (first, second) = room.split_at_mut(size);
                let inner = Inner::Units(&units);
                let (mut casimirs, mut all) =
                    (Normals::new(inner, n, first), Normals::new(inner, n, second));
                if is_exact {
                    all.push(row(ENTROPY));
                }
                if is_exact && !self.inner.bracket.is_zero() {
                    casimirs.push(row(ENTROPY));
                }
                all.push(row(ENERGY));
                for (k, fraction) in fractions.iter_mut().enumerate() {
                    let l = row(ENTROPY + 1 + k);
                    *fraction = all.push(l);
                    if self.kind(k) == Kind::Casimir {
                        *fraction = fraction.min(casimirs.push(l));
                    }
                }
            });
        });
    }

    fn metric(&self, x: &[f64], q: &[f64], g: &mut [f64]) {
        let Around { layout, metric } = &self.inner.around;
        let n = layout.directions;
        if let Some(metric) = metric {
            return with_numbers(n, |y| {
                layout.chart(x, q, y);
                metric.matrix(y, g);
            });
        }
        g.fill(0.0);
        (0..n).for_each(|i| g[i * n + i] = 1.0);
        if q.iter().all(|q| *q == 0.0) {
            return;
        }
        for Placed { factor, entries, directions, .. } in &layout.factors {
            let (x, q, m) = (&x[entries.clone()], &q[directions.clone()], directions.len());
            if factor.is_flat() {
                continue;
            }
            // The frame of the chart at x seen in the orthonormal one at y.
            with_numbers(x.len() + 2 * m * m, |room| {
                let (y, room) = room.split_at_mut(x.len());
                let (columns, block) = room.split_at_mut(m * m);
                factor.chart(x, q, y);
                factor.paths().turn_all(y, x, q, columns);
                for (i, a) in columns.chunks_exact(m).enumerate() {
                    for (j, b) in columns.chunks_exact(m).enumerate() {
                        block[i * m + j] = dot(a, b);
                    }
                }
                put_block(n, directions, block, g);
            });
        }
    }

    fn check_metric(&self, x: &[f64], _: bool) -> Result<(), MetricError> {
        self.inner.around.with_inner(x, |_| ())
    }

    fn metric_slopes(&self, x: &[f64], slopes: &mut [f64]) -> bool {
        let Some(metric) = &self.inner.around.metric else { return false };
        metric.slopes(x, slopes);
        true
    }

    fn flat(&self, x: &[f64], d: &[f64], w: &mut [f64]) -> Result<(), MetricError> {
        let Some(metric) = &self.inner.around.metric else {
            w.copy_from_slice(d);
            return Ok(());
        };
        metric.with_inner(x, |_| ())?;
        let n = d.len();
        with_numbers(n * n, |g| {
            metric.matrix(x, g);
            w.iter_mut().zip(g.chunks_exact(n)).for_each(|(w, row)| *w = dot(row, d));
        });
        Ok(())
    }

    fn tensor(
        &self,
        part: Part,
        t: f64,
        x: &[f64],
        w: Covectors<'_>,
        to: &mut [f64],
    ) -> Result<(), MetricError> {
        let Bound { around, bracket, friction, .. } = &*self.inner;
        match part {
            Part::Reversible => bracket.tensor(t, x, to),
            Part::Gyroscopic => {
                to.fill(0.0);
                Ok(())
            }
            Part::Irreversible => friction.tensor(around, t, x, w.energy, to),
        }
    }

    fn apply(
        &self,
        part: Part,
        t: f64,
        place: (&[f64], &[f64]),
        w: Covectors<'_>,
        alpha: &[f64],
        v: &mut [f64],
    ) -> Result<(), MetricError> {
        let Bound { around, bracket, friction, .. } = &*self.inner;
        match part {
            Part::Reversible => bracket.apply(t, place, alpha, v),
            Part::Gyroscopic => {
                v.fill(0.0);
                Ok(())
            }
            Part::Irreversible => friction.apply(around, t, place, [w.energy, alpha], v),
        }
    }

    fn linearise(
        &self,
        part: Part,
        t: f64,
        x: &[f64],
        w: Covectors<'_>,
        alpha: &[f64],
        jet: &mut Jet<'_>,
    ) -> Result<(), MetricError> {
        let Bound { around, bracket, friction, .. } = &*self.inner;
        match part {
            Part::Reversible => bracket.linearise(t, x, alpha, jet),
            Part::Gyroscopic => {
                let Jet { value, along_x, along_w, tensor } = jet;
                [value, along_x, along_w, tensor].into_iter().for_each(|numbers| numbers.fill(0.0));
                Ok(())
            }
            Part::Irreversible => friction.linearise(around, t, x, [w.energy, alpha], jet),
        }
    }

    fn bracket_slope(
        &self,
        t: f64,
        x: &[f64],
        [u, _]: [&[f64]; 2],
        _: &[f64],
        slope: &mut [f64],
    ) -> Result<(), MetricError> {
        self.inner.bracket.slope(t, x, u, slope)
    }

    fn bracket_slope_of(
        &self,
        t: f64,
        x: &[f64],
        [u, _]: [&[f64]; 2],
        _: &[f64],
        alpha: &[f64],
        slope: &mut [f64],
    ) -> Result<(), MetricError> {
        self.inner.bracket.slope_of(t, x, u, alpha, slope)
    }

    fn parameters(&self) -> usize {
        self.along.as_ref().map_or(0, |along| along.places.len())
    }

    fn law_along_parameter(
        &self,
        law: usize,
        parameter: usize,
        t: f64,
        x: &[f64],
        df: &mut [f64],
    ) -> f64 {
        df.fill(f64::NAN);
        let Some(along) = &self.along else { return f64::NAN };
        let Some(tape) = law_of(&self.inner.definition, law) else {
            df.fill(0.0);
            return 0.0;
        };
        Along::law(tape, (along.places[parameter], &self.inner.theta), t, x, df)
    }

    fn part_along_parameter(
        &self,
        (part, parameter): (Part, usize),
        t: f64,
        x: &[f64],
        w: Covectors<'_>,
        alpha: &[f64],
        v: &mut [f64],
    ) -> Result<(), MetricError> {
        v.fill(f64::NAN);
        let Some(along) = &self.along else { return Ok(()) };
        let (at, covectors) = ((along.places[parameter], &self.inner.theta[..]), [w.energy, alpha]);
        let mut unscaled = Ok(());
        match part {
            Part::Reversible => along.bracket(at, t, x, alpha, v),
            Part::Gyroscopic => v.fill(0.0),
            Part::Irreversible => {
                let of_metric =
                    |v: &mut [f64]| unscaled = Rub::unscaled(&self.inner.around, x, covectors, v);
                along.friction(at, t, x, covectors, of_metric, v);
            }
        }
        unscaled
    }

    /// Returns `false`: an invariant comes without its symmetry.
    fn generator(&self, _: usize, _: &[f64], _: &mut [f64], _: &mut [f64]) -> bool {
        false
    }

    /// Leaves the state where it is; no invariant comes with its symmetry.
    fn action(&self, _: usize, x: &[f64], _: f64, y: &mut [f64], tangent: &mut [f64]) {
        let n = self.layout().directions;
        y.copy_from_slice(x);
        tangent.fill(0.0);
        (0..n).for_each(|i| tangent[i * n + i] = 1.0);
    }
}

impl FrictionTerms for Recorded {
    fn term_count(&self) -> usize {
        self.inner.friction.term_count(&self.inner.around).unwrap_or(0)
    }

    fn terms(&self, t: f64, x: &[f64], w: Covectors<'_>, term: &mut Terms<'_>) {
        self.inner.friction.terms(&self.inner.around, t, x, w.energy, term);
    }
}
