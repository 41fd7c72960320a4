//! The noise of an open system: that of its own friction, and that of each bath.
//!
//! The first group of terms keeps the energy. A bath moves the state at a frozen time, and the energy changes by its heat,
//! `Q = H(t, x') − H(t, x)`, so the balance holds on every path.

use std::ops::Range;

use metriplectic_dynamics::exchange::{
    BathTerm, Entries as _, Exchange, ExchangeArgs, ExchangeTerms, Part, PartKind, Visitor,
};
use metriplectic_dynamics::noise::{
    Around, NoiseTerm, NoiseTerms, Place, friction_vector, kinetic_drift, noise_drift,
    noise_vector, place, seeded_place,
};
use metriplectic_dynamics::system::Point;
use metriplectic_dynamics::{
    Dissipation as _, Invariants, Metriplectic, ModelError, Report, SecondLaw, Verify as _,
};
use metriplectic_equations::judge::RADIUS;
use metriplectic_fields::{Column, Real, ScalarField, Vector};
use metriplectic_manifolds::{Canonical, Manifold, MetricAt, MetricError, Riemannian};

use super::clock::Clock;
use super::state::{Booked, OpenState};
use super::system::{OpenSystem, StateOf};
use super::vector::OpenVector;
use crate::noise::{
    Drawn, Fluctuating, Judged, Landing, Noise, NoiseError, ROUND_OFF, examine_model, vanishes,
};
use crate::step::Flow;

/// A vector of a system.
type VectorOf<Y> = Vector<<Y as Metriplectic>::Manifold>;

/// How far the terms of a bath are off its friction, in units of the coordinates.
#[derive(Clone, Copy, Default)]
struct Compared {
    off: f64,
    /// The largest entry of the velocity.
    size: f64,
    /// The largest entry of `T Σ ρ b bᵀ`.
    tensor: f64,
}

/// The velocities of the baths of a list.
struct Velocities<V>(Vec<V>);

impl<M: Manifold> Visitor<M> for Velocities<Vector<M>> {
    fn visit(&mut self, part: Part<'_>, velocity: &Vector<M, Real>, _: &Vector<M, Real>) {
        if let PartKind::Bath { .. } = part.kind {
            self.0.push(velocity.real());
        }
    }
}

impl<Y, C, X> OpenSystem<Y, C, X>
where
    Y: Metriplectic<Dissipation: NoiseTerms<Y::Manifold, Y::Metric>>,
    C: Clock<Y::Manifold, Y::Energy>,
    X: ExchangeTerms<Y::Manifold, Y::Metric>,
{
    /// Passes the terms of all baths at a place to the visitor.
    fn each_bath_term(
        &self,
        t: f64,
        place: &Place<Y::Manifold>,
        visit: &mut dyn FnMut(BathTerm<Vector<Y::Manifold, Real>>),
    ) -> Result<(), MetricError> {
        let g = MetricAt::new(self.closed().metric(), &place.x);
        let at = ExchangeArgs { t, g: &g, w: &place.w, s: &place.s };
        self.exchange().each_term(&at, visit)
    }

    /// Computes `Σ a_r √(κ T ρ_r) b_r` over some terms of the baths, which are numbered from `first` on.
    fn bath_noise(
        &self,
        x: &StateOf<Y>,
        terms: &Range<usize>,
        (strength, numbers): Drawn<'_>,
    ) -> Result<VectorOf<Y>, MetricError> {
        let model = self.without_exchange(x.time);
        let (mut sum, mut r) = (VectorOf::<Y>::zero(), self.closed().dissipation().count());
        self.each_bath_term(
            x.time,
            &place(&model, &x.x),
            &mut |BathTerm { temperature, term, .. }| {
                if terms.contains(&r) {
                    let size = (strength * (temperature * term.rate.re)).sqrt();
                    sum += term.b.real::<VectorOf<Y>>() * (size * numbers(r));
                }
                r += 1;
            },
        )?;
        Ok(sum)
    }

    /// Computes the velocity of the friction of all baths, `Σ ρ_r b_r ⟨b_r, T dS − dH⟩`.
    fn bath_friction(&self, x: &StateOf<Y>) -> Result<VectorOf<Y>, MetricError> {
        let place = place(&self.without_exchange(x.time), &x.x);
        let mut sum = VectorOf::<Y>::zero();
        self.each_bath_term(x.time, &place, &mut |BathTerm { temperature, term, .. }| {
            let NoiseTerm { rate, b } = term;
            let force = temperature * b.dot(&place.s).re - b.dot(&place.w).re;
            sum += b.real::<VectorOf<Y>>() * (rate.re * force);
        })?;
        Ok(sum)
    }

    /// Verifies at a start and around it that the terms of each bath are those of its friction, and that the kinetic drift is
    /// that of their values.
    fn examine_baths<U: ScalarField<Y::Manifold>>(
        &self,
        t: f64,
        around: &Around<Y::Manifold>,
        noise: &Noise<U>,
    ) -> Result<(), NoiseError>
    where
        Canonical: Riemannian<Y::Manifold>,
    {
        let units = &around.units;
        let has_no_drift = |bath| self.exchange().is_closed(bath) && noise.is_uniform;
        for x in &around.points {
            // Where they have no value, the verification of the model says why.
            let Ok(baths) = self.compared_baths(t, x, units) else { continue };
            for (bath, Compared { off, size, tensor }) in baths.into_iter().enumerate() {
                if off > ROUND_OFF * size {
                    return Err(NoiseError::BathTermsDiffer { bath, off, size });
                }
                let state = OpenState { time: t, ..self.start(x.clone()) };
                if has_no_drift(bath)
                    && let Ok(drift) = self.bath_drift(&state, bath, &noise.measure)
                {
                    vanishes::<Y>(&drift, units, tensor)?;
                }
            }
        }
        if (0..X::BATHS).all(has_no_drift) {
            return Ok(());
        }
        let found = around.lost_in_terms(&self.without_exchange(t), |place, visit| {
            let mut r = 0;
            self.each_bath_term(t, place, &mut |BathTerm { term, .. }| {
                visit(r, term);
                r += 1;
            })
        });
        match found {
            Some([derivative, quotient]) => {
                let what = "the terms of the baths";
                Err(NoiseError::LostDerivative { what, derivative, quotient })
            }
            None => Ok(()),
        }
    }

    /// Compares the velocity of each bath with that of its terms, for a generic covector in place of `dS`.
    fn compared_baths(
        &self,
        t: f64,
        x: &Point<Y>,
        units: &VectorOf<Y>,
    ) -> Result<Vec<Compared>, MetricError> {
        let n = <VectorOf<Y> as Column<f64>>::LEN;
        let here = place(&self.without_exchange(t), x);
        let largest = (0..n).map(|i| (here.w[i].re * units[i]).abs()).fold(0.0, f64::max);
        let mut temperatures = Vec::new();
        self.exchange().temperatures(t, &mut temperatures);
        let hottest = temperatures.iter().copied().fold(0.0, f64::max);
        // `T dS` as large as `dH`, so that both count.
        let scale = if largest > 0.0 && hottest > 0.0 { largest / hottest } else { 1.0 };
        let s = Vector::<Y::Manifold, Real>::from_index(|i| {
            Real::from(scale * (1.0 + i as f64).sin() / units[i])
        });
        let place = Place { s, ..here };
        let g = MetricAt::new(self.closed().metric(), &place.x);
        let at = ExchangeArgs { t, g: &g, w: &place.w, s: &place.s };
        let mut velocities = Velocities(Vec::new());
        self.exchange().each(&at, &mut velocities)?;
        let mut rest = velocities.0;
        let mut baths = vec![Compared::default(); rest.len()];
        self.exchange().each_term(&at, &mut |BathTerm { bath, temperature, term }| {
            let (b, rate): (VectorOf<Y>, f64) = (term.b.real(), term.rate.re);
            let [s, w] = [&place.s, &place.w].map(Column::real::<VectorOf<Y>>);
            let affinity = s * temperature - w;
            rest[bath] -= b * (rate * b.dot(&affinity));
            let terms: f64 = (0..n).map(|i| (b[i] * affinity[i]).abs()).sum();
            let reach = (0..n).map(|i| (b[i] / units[i]).abs()).fold(0.0, f64::max);
            let Compared { size, tensor, .. } = &mut baths[bath];
            *size = size.max(rate * reach * terms);
            *tensor = tensor.max(temperature * rate * reach * reach);
        })?;
        for (compared, rest) in baths.iter_mut().zip(&rest) {
            compared.off = (0..n).map(|i| (rest[i] / units[i]).abs()).fold(0.0, f64::max);
        }
        Ok(baths)
    }

    /// Computes `T Σ c_r b_r` of a bath.
    fn bath_drift<U: ScalarField<Y::Manifold>>(
        &self,
        x: &StateOf<Y>,
        bath: usize,
        measure: &U,
    ) -> Result<VectorOf<Y>, MetricError>
    where
        Canonical: Riemannian<Y::Manifold>,
    {
        let model = self.without_exchange(x.time);
        kinetic_drift(
            &x.x,
            measure,
            |directions| seeded_place(&model, &x.x, directions),
            |place, visit| {
                let mut r = 0;
                self.each_bath_term(x.time, place, &mut |of| {
                    if of.bath == bath {
                        // The rate of a bath is in the unit of 1/T.
                        let NoiseTerm { rate, b } = of.term;
                        visit(r, NoiseTerm { rate: rate * of.temperature, b });
                        r += 1;
                    }
                })
            },
        )
    }
}

impl<Y, C, X, U> Fluctuating<U> for OpenSystem<Y, C, X>
where
    Y: Metriplectic<Dissipation: NoiseTerms<Y::Manifold, Y::Metric>>,
    C: Clock<Y::Manifold, Y::Energy>,
    X: ExchangeTerms<Y::Manifold, Y::Metric>,
    U: ScalarField<Y::Manifold>,
    Canonical: Riemannian<Y::Manifold>,
{
    fn groups(&self) -> Vec<Range<usize>> {
        let mut counts = vec![self.closed().dissipation().count()];
        self.exchange().counts(&mut counts);
        let mut first = 0;
        let next = |count| {
            let group = first..first + count;
            first += count;
            group
        };
        counts.into_iter().map(next).collect()
    }

    fn noise(
        &self,
        x: &StateOf<Y>,
        terms: Range<usize>,
        (strength, numbers): Drawn<'_>,
    ) -> Option<Self::Vector> {
        let is_own = terms.start < self.closed().dissipation().count();
        let v = if is_own {
            noise_vector(&self.without_exchange(x.time), &x.x, terms, (strength, numbers))
        } else {
            self.bath_noise(x, &terms, (strength, numbers))
        };
        v.ok().filter(|v| v.is_finite()).map(OpenVector::of)
    }

    fn drift(&self, x: &StateOf<Y>, group: usize, noise: &Noise<U>) -> Option<Self::Vector> {
        let v = match group.checked_sub(1) {
            None => noise_drift(&self.without_exchange(x.time), &x.x, &noise.measure),
            Some(bath) => self.bath_drift(x, bath, &noise.measure),
        };
        v.ok().filter(|v| v.is_finite()).map(OpenVector::of)
    }

    fn friction(&self, x: &StateOf<Y>) -> Option<Self::Vector> {
        let own = friction_vector(&self.without_exchange(x.time), &x.x);
        let v = own.and_then(|own| Ok(own + self.bath_friction(x)?));
        v.ok().filter(|v| v.is_finite()).map(OpenVector::of)
    }

    fn has_drift(&self, group: usize, noise: &Noise<U>) -> bool {
        let dissipation = self.closed().dissipation();
        let is_closed = match group.checked_sub(1) {
            None if dissipation.is_none() => return false,
            None => dissipation.is_closed() && Y::Invariants::COUNT == 0,
            Some(bath) => self.exchange().is_closed(bath),
        };
        !(is_closed && noise.is_uniform)
    }

    fn landed(&self, landing: Landing<'_, Self>) -> Option<StateOf<Y>> {
        let Landing { group, from, to, laws } = landing;
        let (time, ledger) = (from.time, &from.ledger);
        let Some(bath) = group.checked_sub(1) else {
            return self.onto(&OpenState { x: to.x, time, ledger: ledger.clone() }, laws, None);
        };
        let heat = self.energy(time, &to.x) - self.energy(time, &from.x);
        if !heat.is_finite() {
            return None;
        }
        let mut temperatures = Vec::new();
        self.exchange().temperatures(time, &mut temperatures);
        let temperature = *temperatures.get(bath)?;
        let entropy = if temperature > 0.0 { -heat / temperature } else { 0.0 };
        let column = self.columns().heat(bath)?;
        let entries = X::Entries::from_index(|i| {
            let booked = [heat, entropy];
            i.checked_sub(column).and_then(|k| booked.get(k)).copied().unwrap_or(0.0)
        });
        let ledger = ledger.with(&Booked { parameter: 0.0, entries });
        Some(OpenState { x: to.x, time, ledger })
    }

    fn examine_noise(&self, x: &StateOf<Y>, noise: &Noise<U>) -> Result<(), NoiseError> {
        if self.closed().second_law() == SecondLaw::Published {
            return Err(NoiseError::NoiseAndPublished);
        }
        if Y::Invariants::COUNT > 0 && X::BATHS > 0 {
            return Err(NoiseError::InvariantsInABath);
        }
        let view = self.without_exchange(x.time);
        let around = Around::of(&view, &x.x);
        examine_model(&view, &around, noise)?;
        if X::BATHS > 0 { self.examine_baths(x.time, &around, noise) } else { Ok(()) }
    }

    fn check_start_alone(&self, x0: &StateOf<Y>) -> Result<(), ModelError> {
        self.judged(x0, |model, x| model.verified_as_member(x).map(drop))
    }
}

impl<Y, C, X> Judged for OpenSystem<Y, C, X>
where
    Y: Metriplectic,
    C: Clock<Y::Manifold, Y::Energy>,
    X: Exchange<Y::Manifold, Y::Metric>,
{
    type Broken = ModelError;
    type Report = Report;

    fn radius() -> f64 {
        RADIUS
    }

    fn verify_model(&self, x0: &StateOf<Y>, radius: f64) -> Result<(), ModelError> {
        self.verify(x0, radius)
    }

    fn report_model(&self, x0: &StateOf<Y>) -> Report {
        self.report(x0)
    }

    fn is_sound(report: &Report) -> bool {
        report.verdict.is_ok()
    }
}
