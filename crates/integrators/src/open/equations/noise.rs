//! The thermal noise of a system of your own in surroundings: that of its own friction, and that of each bath.
//!
//! The first group of terms keeps the energy. A bath moves the state at a frozen time, and the energy changes by its heat,
//! `Q = H(t, x') − H(t, x)`, so the balance holds on every path.

use std::ops::Range;

use metriplectic_dynamics::noise::{Boltzmann, Uniform};
use metriplectic_dynamics::{ModelError, SecondLaw};
use metriplectic_equations::judge::{Judge, RADIUS};
use metriplectic_equations::{ENTROPY, Equations, FrictionTerms, Report};

use super::{EntriesAt, OpenEquations, PartKind, Surrounding};
use crate::noise::{
    Drawn, Fluctuating, Judged, Landing, Noise, NoiseError, Noisy, OwnTerms, Term, kinetic_drift,
    start_and_near, summed,
};
use crate::open::surrounded::per_energy;
use crate::open::{Beside, OpenFlow, OpenState};
use crate::step::{Directions, Entries, Flow as _};

/// A bath with noise.
struct Bath<'a> {
    part: &'a Surrounding,
    /// The numbers of its terms among those of the system and of all baths.
    terms: Range<usize>,
}

impl<S: FrictionTerms> OpenEquations<S> {
    /// Gives the system and its baths the thermal noise that their friction fixes: `√(2 k_B ρ) b` for each
    /// [term](FrictionTerms) `ρ b bᵀ` of its own, and `√(2 k_B T ρ) b` for each contact of a bath of the temperature `T`. `contacts` says for
    /// each bath, in their order, how many contacts its friction has at every state.
    ///
    /// The system lives on a vector space, and its reversible motion keeps the volume. A run refuses other systems
    /// ([`NoiseError`]). Add ports and baths before.
    ///
    /// ```
    /// use metriplectic_dynamics::noise::Boltzmann;
    /// use metriplectic_equations::{Covectors, ENERGY, ENTROPY, Equations, FrictionTerms, Sizes, Terms};
    /// use metriplectic_integrators::{DormandPrince5, FromEquations, Method as _, RandomFlow, Span};
    ///
    /// /// So many masses on springs, `H = Σ ½p² + ½q²`.
    /// struct Masses(usize);
    ///
    /// impl Equations for Masses {
    ///     fn sizes(&self) -> Sizes {
    ///         Sizes { entries: 2 * self.0, directions: 2 * self.0, laws: 2 }
    ///     }
    ///
    ///     fn values(&self, _: f64, x: &[f64], values: &mut [f64]) {
    ///         values[ENERGY] = 0.5 * x.iter().map(|x| x * x).sum::<f64>();
    ///         values[ENTROPY] = 0.0;
    ///     }
    ///
    ///     fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
    ///         self.values(t, x, values);
    ///         w.fill(0.0);
    ///         w[..x.len()].copy_from_slice(x);
    ///     }
    ///
    ///     fn velocity(&self, _: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
    ///         v[..self.0].copy_from_slice(&x[self.0..]);
    ///         (0..self.0).for_each(|i| v[self.0 + i] = -x[i]);
    ///         Some(0.0)
    ///     }
    ///
    ///     fn is_vector_space(&self) -> bool {
    ///         true
    ///     }
    /// }
    ///
    /// impl FrictionTerms for Masses {
    ///     fn term_count(&self) -> usize {
    ///         0
    ///     }
    ///
    ///     fn terms(&self, _: f64, _: &[f64], _: Covectors<'_>, _: &mut Terms<'_>) {}
    /// }
    ///
    /// let n: usize = "20".parse()?;
    /// let masses = FromEquations(Masses(n))
    ///     .opened()
    ///     .bath("water", 0.8, move |_, contact| (n..2 * n).for_each(|p| contact(0.5, &[(p, 1.0)])))
    ///     .with_noise(Boltzmann(1.0), &[n]);
    /// let start = masses.flow().start(vec![0.0; 2 * n]);
    /// let run = RandomFlow(DormandPrince5).seed(1).run(&masses, start, Span::steps(0.05, 100))?;
    /// let state = &run.last().point;
    /// assert!(run.certificate().keeps_energy());
    /// assert!((masses.flow().energy_at(state) - state.ledger.heat("water").unwrap()).abs() < 1e-13);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn with_noise(mut self, noise: Boltzmann, contacts: &[usize]) -> Noisy<Self, Uniform> {
        self.contacts = contacts.to_vec();
        Noisy::new(self, Noise::of(noise))
    }

    fn own_terms(&self, t: f64) -> OwnTerms<'_> {
        OwnTerms { system: &self.system, t }
    }

    /// The baths, in their order.
    fn all_baths(&self) -> Vec<Bath<'_>> {
        let (mut first, mut counts) = (self.system.term_count(), self.contacts.iter());
        let baths = self.parts.iter().filter(|part| part.is_bath()).map(|part| {
            let terms = first..first + counts.next().copied().unwrap_or(0);
            first = terms.end;
            Bath { part, terms }
        });
        baths.collect()
    }

    /// The terms of a bath at a time and entries, with rates of the unit of friction times the temperature.
    fn terms_of(&self, part: &Surrounding, t: f64, x: &[f64]) -> Vec<Term> {
        let (temperature, [w, s]) =
            (part.temperature(t).unwrap_or(0.0), self.own_terms(t).both_covectors(x));
        let mut terms = Vec::new();
        if let PartKind::Bath { friction, .. } = &part.kind {
            friction(&EntriesAt { t, x, w: &w, s: &s }, &mut |rate, b| {
                terms.push(Term { rate: rate * temperature, b: b.to_vec() });
            });
        }
        terms
    }

    /// A direction of the points alone.
    fn of_points(&self, v: Directions) -> Beside<Directions> {
        let mut beside = vec![0.0];
        beside.extend(self.empty.entry_sizes());
        Beside { v, beside }
    }
}

impl<S: FrictionTerms> Fluctuating<Uniform> for OpenEquations<S> {
    fn groups(&self) -> Vec<Range<usize>> {
        let own = std::iter::once(0..self.system.term_count());
        own.chain(self.all_baths().into_iter().map(|bath| bath.terms)).collect()
    }

    fn noise(
        &self,
        x: &OpenState<Entries>,
        terms: Range<usize>,
        (strength, numbers): Drawn<'_>,
    ) -> Option<Beside<Directions>> {
        let own = self.own_terms(x.time);
        let baths = self.all_baths();
        let v = match baths.iter().find(|bath| bath.terms.contains(&terms.start)) {
            None => own.noise(&x.x, terms, (strength, numbers))?,
            Some(bath) => {
                let all = self.terms_of(bath.part, x.time, &x.x);
                if all.len() != bath.terms.len() {
                    return None;
                }
                summed(own.directions(), |v| {
                    for r in terms {
                        let term = &all[r - bath.terms.start];
                        term.add_to(v, (strength * term.rate).sqrt() * numbers(r));
                    }
                })?
            }
        };
        Some(self.of_points(v))
    }

    fn drift(
        &self,
        x: &OpenState<Entries>,
        group: usize,
        _: &Noise<Uniform>,
    ) -> Option<Beside<Directions>> {
        let own = self.own_terms(x.time);
        let v = match group.checked_sub(1) {
            None => own.drift(&x.x)?,
            Some(bath) => {
                let part = self.all_baths().get(bath)?.part;
                kinetic_drift(own.directions(), &x.x, |x_near| self.terms_of(part, x.time, x_near))?
            }
        };
        Some(self.of_points(v))
    }

    fn friction(&self, x: &OpenState<Entries>) -> Option<Beside<Directions>> {
        let own = self.own_terms(x.time);
        let w = own.both_covectors(&x.x);
        let at = EntriesAt { t: x.time, x: &x.x, w: &w[0], s: &w[1] };
        let v = summed(own.directions(), |v| {
            own.add_friction(&x.x, &w, v);
            for part in self.parts.iter().filter(|part| part.is_bath()) {
                let effect = part.effect(part.temperature(x.time).unwrap_or(0.0), &at);
                v.iter_mut().zip(effect.v).for_each(|(sum, v)| *sum += v);
            }
        })?;
        Some(self.of_points(v))
    }

    fn has_drift(&self, group: usize, _: &Noise<Uniform>) -> bool {
        group > 0 || self.system.term_count() > 0
    }

    fn landed(&self, landing: Landing<'_, Self>) -> Option<OpenState<Entries>> {
        let Landing { group, from, to, laws } = landing;
        let (time, ledger) = (from.time, &from.ledger);
        let Some(bath) = group.checked_sub(1) else {
            return self.onto(&OpenState { x: to.x, time, ledger: ledger.clone() }, laws, None);
        };
        let energy = |x: &Entries| self.at(time).laws(x).energy;
        let heat = energy(&to.x) - energy(&from.x);
        if !heat.is_finite() {
            return None;
        }
        let (column, temperature) = *self.baths(time).get(bath)?;
        let mut entries = vec![0.0; self.empty.entry_sizes().len()];
        entries[column + 1] = heat;
        entries[column + 2] = -heat * per_energy(temperature);
        Some(OpenState { x: to.x, time, ledger: ledger.with_entries(&entries) })
    }

    fn examine_noise(&self, x: &OpenState<Entries>, _: &Noise<Uniform>) -> Result<(), NoiseError> {
        if self.system.second_law() == SecondLaw::Published {
            return Err(NoiseError::NoiseAndPublished);
        }
        let (baths, own) = (self.all_baths(), self.own_terms(x.time));
        if self.system.sizes().laws > ENTROPY + 1 && !baths.is_empty() {
            return Err(NoiseError::InvariantsInABath);
        }
        own.examine(&x.x)?;
        let expected = self.contacts.len();
        if baths.len() != expected {
            return Err(NoiseError::OtherBaths { found: baths.len(), expected });
        }
        for near in start_and_near(&x.x) {
            for (index, bath) in baths.iter().enumerate() {
                let found = self.terms_of(bath.part, x.time, &near).len();
                let expected = bath.terms.len();
                if found != expected {
                    return Err(NoiseError::OtherContacts { bath: index, found, expected });
                }
            }
        }
        Ok(())
    }

    fn check_start_alone(&self, x0: &OpenState<Entries>) -> Result<(), ModelError> {
        Judge::of(&self.system, x0.time).check_start(&x0.x)?;
        self.check_clock(x0)?;
        self.check_exchange(x0)
    }
}

impl<S: Equations> Judged for OpenEquations<S> {
    type Broken = ModelError;
    type Report = Report;

    fn radius() -> f64 {
        RADIUS
    }

    fn verify_model(&self, x0: &OpenState<Entries>, radius: f64) -> Result<(), ModelError> {
        self.verify(x0, radius)
    }

    fn report_model(&self, x0: &OpenState<Entries>) -> Report {
        self.report(x0)
    }

    fn is_sound(report: &Report) -> bool {
        report.verdict.is_ok()
    }
}
