//! The thermal noise of a system of your own, from the terms of its friction. Derivatives are central differences.

use std::ops::Range;

use metriplectic_dynamics::noise::{Boltzmann, Uniform};
use metriplectic_dynamics::{ModelError, SecondLaw};
use metriplectic_equations::judge::{Judge, RADIUS};
use metriplectic_equations::{
    Covectors, ENERGY, ENTROPY, Equations, FrictionTerms, Part, Report, Sizes,
};

use super::closed::ROUND_OFF;
use super::error::NoiseError;
use super::fluctuating::{Drawn, Fluctuating, Landing, Noise};
use super::judged::Judged;
use super::system::Noisy;
use crate::numbers::FromEquations;
use crate::step::{Directions, Entries, Flow as _};

/// The part of the terms of a divergence that its differences may leave.
/// A factor of four fails `noise/equations.rs::a_motion_that_changes_the_volume_by_a_millionth_is_refused`.
const DIFFERENCE: f64 = 1e-6;
/// The time that a closed system is asked at.
const NO_CLOCK: f64 = 0.0;

impl<S: Equations> FromEquations<S> {
    /// Gives the system the thermal noise that its friction fixes, `√(2 k_B ρ) b` for each [term](FrictionTerms) `ρ b bᵀ` of it. It lives
    /// on a vector space, and its reversible motion keeps the volume.
    pub fn with_noise(self, noise: Boltzmann) -> Noisy<Self, Uniform>
    where
        S: FrictionTerms,
    {
        Noisy::new(self, Noise::of(noise))
    }
}

/// The size of each entry, or that of the largest one where it is zero.
fn sizes_of_differences(x: &[f64]) -> Vec<f64> {
    let largest = x.iter().fold(0.0, |most, x| f64::max(most, x.abs()));
    let unit = if largest > 0.0 { largest } else { 1.0 };
    x.iter().map(|x| if *x == 0.0 { unit } else { x.abs() }).collect()
}

/// The half widths of differences, where their rounding is as large as their error: the entries times `ε^{1/3}`.
fn half_widths(x: &[f64]) -> Vec<f64> {
    sizes_of_differences(x).into_iter().map(|size| size * f64::EPSILON.cbrt()).collect()
}

/// A term of a friction.
pub(crate) struct Term {
    pub(crate) rate: f64,
    pub(crate) b: Vec<(usize, f64)>,
}

impl Term {
    /// The entry of `b` in a direction.
    fn entry(&self, direction: usize) -> f64 {
        self.b.iter().filter(|(k, _)| *k == direction).map(|(_, b)| b).sum()
    }

    /// `⟨w, b⟩`, and the size of its terms.
    pub(crate) fn along(&self, w: &[f64]) -> [f64; 2] {
        let products = self.b.iter().map(|&(k, b)| w[k] * b);
        products.fold([0.0; 2], |[sum, size], product| [sum + product, size + product.abs()])
    }

    /// Adds `c b`.
    pub(crate) fn add_to(&self, v: &mut [f64], c: f64) {
        self.b.iter().for_each(|&(k, b)| v[k] += c * b);
    }
}

/// Computes the kinetic drift `Σ_r c_r b_r` of terms, with `c_r = ρ_r div b_r + ½ ⟨dρ_r, b_r⟩`, in `n` directions.
pub(crate) fn kinetic_drift(
    n: usize,
    x: &[f64],
    terms_at: impl Fn(&[f64]) -> Vec<Term>,
) -> Option<Directions> {
    let here = terms_at(x);
    let mut factors = vec![0.0; here.len()];
    for (k, width) in half_widths(x).into_iter().enumerate() {
        let [up, down] = [width, -width].map(|by| {
            let mut y = x.to_vec();
            y[k] += by;
            terms_at(&y)
        });
        let quotient = |up: f64, down: f64| (up - down) / (2.0 * width);
        for (r, factor) in factors.iter_mut().enumerate() {
            // A friction that lists fewer terms there has no value.
            let (up, down) = (up.get(r)?, down.get(r)?);
            *factor += here[r].rate * quotient(up.entry(k), down.entry(k))
                + 0.5 * quotient(up.rate, down.rate) * here[r].entry(k);
        }
    }
    summed(n, |v| here.iter().zip(factors).for_each(|(term, c)| term.add_to(v, c)))
}

/// A vector of `n` directions as a sum, if it is finite.
pub(crate) fn summed(n: usize, add: impl FnOnce(&mut [f64])) -> Option<Directions> {
    let mut v = vec![0.0; n];
    add(&mut v);
    v.iter().all(|v| v.is_finite()).then(|| Directions::of(&v))
}

/// A system whose friction is known as a sum of terms, at a time.
#[derive(Clone, Copy)]
pub(crate) struct OwnTerms<'a> {
    pub(crate) system: &'a dyn FrictionTerms,
    pub(crate) t: f64,
}

impl OwnTerms<'_> {
    /// The number of directions.
    pub(crate) fn directions(&self) -> usize {
        self.system.sizes().directions
    }

    /// The covectors of energy and entropy at a state.
    pub(crate) fn both_covectors(&self, x: &[f64]) -> [Vec<f64>; 2] {
        let Sizes { laws, directions: n, .. } = self.system.sizes();
        let [mut values, mut w] = [laws, laws * n].map(|count| vec![0.0; count]);
        self.system.differentials(self.t, x, &mut values, &mut w);
        [ENERGY, ENTROPY].map(|law| w[law * n..][..n].to_vec())
    }

    /// The terms at a state with these covectors.
    pub(crate) fn terms_with(&self, x: &[f64], [energy, entropy]: &[Vec<f64>; 2]) -> Vec<Term> {
        let mut terms = Vec::with_capacity(self.system.term_count());
        let w = Covectors { energy, entropy };
        self.system.terms(self.t, x, w, &mut |rate, b| terms.push(Term { rate, b: b.to_vec() }));
        terms
    }

    pub(crate) fn terms_at(&self, x: &[f64]) -> Vec<Term> {
        self.terms_with(x, &self.both_covectors(x))
    }

    /// The component `k` of the reversible motion `x' − K dS`, and the size of its terms.
    fn reversible(&self, x: &[f64], k: usize) -> Option<[f64; 2]> {
        let (w, mut v) = (self.both_covectors(x), vec![0.0; x.len()]);
        self.system.velocity(self.t, x, &mut v)?;
        let terms = self.terms_with(x, &w);
        let by_term = terms.iter().map(|term| term.entry(k) * term.rate * term.along(&w[1])[0]);
        Some(by_term.fold([v[k], v[k].abs()], |[sum, size], by| [sum - by, size + by.abs()]))
    }

    /// Verifies the terms at a state.
    ///
    /// # Errors
    ///
    /// [`NoiseError::BadTerms`], [`NoiseError::TermsOff`].
    fn examine_terms(&self, x: &[f64]) -> Result<(), NoiseError> {
        let (w, directions) = (self.both_covectors(x), self.system.sizes().directions);
        let (terms, expected) = (self.terms_with(x, &w), self.system.term_count());
        let outside = |term: &Term| term.b.iter().any(|(k, _)| *k >= directions);
        if terms.len() != expected || terms.iter().any(outside) {
            return Err(NoiseError::BadTerms { found: terms.len(), expected, directions });
        }
        // Numbers without digits are zeros.
        let holds = |law: &'static str, off: f64, size: f64| {
            let allowed = ROUND_OFF * size + f64::MIN_POSITIVE / f64::EPSILON;
            if off.abs() <= allowed { Ok(()) } else { Err(NoiseError::TermsOff { law, off, size }) }
        };
        let mut produced = 0.0;
        for term in &terms {
            holds("ρ ≥ 0", term.rate.min(0.0), 0.0)?;
            let [off, size] = term.along(&w[0]);
            holds("⟨dH, b⟩ = 0", off, size)?;
            produced += term.rate * term.along(&w[1])[0].powi(2);
        }
        let mut v = vec![0.0; directions];
        let Some(production) = self.system.velocity(self.t, x, &mut v) else { return Ok(()) };
        holds("Σ ρ ⟨dS, b⟩² = ⟨dS, K dS⟩", produced - production, produced + production.abs())?;
        let Some(model) = self.system.model() else { return Ok(()) };
        // Along a covector that no term knows of.
        let alpha: Vec<f64> = w[1]
            .iter()
            .zip(&w[0])
            .enumerate()
            .map(|(k, (s, w))| s + w * (k as f64).sin())
            .collect();
        let (place, covectors) =
            ((x, &vec![0.0; x.len()][..]), Covectors { energy: &w[0], entropy: &w[1] });
        let applied = model.apply(Part::Irreversible, self.t, place, covectors, &alpha, &mut v);
        if model.is_zero(Part::Irreversible) || applied.is_err() {
            return Ok(());
        }
        let (mut sum, mut sizes) = (vec![0.0; directions], vec![0.0; directions]);
        for term in &terms {
            let [along, size] = term.along(&alpha);
            term.add_to(&mut sum, term.rate * along);
            term.b.iter().for_each(|&(k, b)| sizes[k] += (term.rate * size * b).abs());
        }
        let each = sum.iter().zip(&v).zip(&sizes);
        each.into_iter()
            .try_for_each(|((sum, v), size)| holds("Σ ρ b ⟨b, α⟩ = K α", sum - v, *size))
    }

    /// Verifies that the reversible motion keeps the volume.
    ///
    /// # Errors
    ///
    /// [`NoiseError::NotUnimodular`].
    fn examine_volume(&self, x: &[f64]) -> Result<(), NoiseError> {
        let [mut divergence, mut size, mut rounding] = [0.0; 3];
        for ((k, width), scale) in
            half_widths(x).into_iter().enumerate().zip(sizes_of_differences(x))
        {
            let moved = [width, -width].map(|by| {
                let mut y = x.to_vec();
                y[k] += by;
                self.reversible(&y, k)
            });
            let [Some([up, above]), Some([down, below])] = moved else { return Ok(()) };
            divergence += (up - down) / (2.0 * width);
            size += up.abs().max(down.abs()) / scale;
            // Without a reversible motion it is the round-off of the friction.
            rounding += 8.0 * f64::EPSILON * (above + below) / width;
        }
        if f64::abs(divergence) > DIFFERENCE * size + rounding {
            return Err(NoiseError::NotUnimodular { divergence, size });
        }
        Ok(())
    }

    /// Verifies at a state and near it the terms and the volume.
    ///
    /// # Errors
    ///
    /// [`NoiseError::NotAVectorSpace`], [`NoiseError::BadTerms`], [`NoiseError::TermsOff`], [`NoiseError::NotUnimodular`].
    pub(crate) fn examine(&self, x: &[f64]) -> Result<(), NoiseError> {
        if !self.system.is_vector_space() {
            return Err(NoiseError::NotAVectorSpace);
        }
        start_and_near(x).iter().try_for_each(|x| {
            self.examine_terms(x)?;
            self.examine_volume(x)
        })
    }

    /// The sum `Σ_r a_r √(κ ρ_r) b_r` over some terms at a state.
    pub(crate) fn noise(
        &self,
        x: &[f64],
        terms: Range<usize>,
        (strength, numbers): Drawn<'_>,
    ) -> Option<Directions> {
        let all = self.terms_at(x);
        summed(self.directions(), |v| {
            for r in terms {
                all[r].add_to(v, (strength * all[r].rate).sqrt() * numbers(r));
            }
        })
    }

    /// The kinetic drift at a state.
    pub(crate) fn drift(&self, x: &[f64]) -> Option<Directions> {
        kinetic_drift(self.directions(), x, |x| self.terms_at(x))
    }

    /// Adds the velocity `K dS` of the friction with these covectors.
    pub(crate) fn add_friction(&self, x: &[f64], w: &[Vec<f64>; 2], v: &mut [f64]) {
        for term in self.terms_with(x, w) {
            term.add_to(v, term.rate * term.along(&w[1])[0]);
        }
    }
}

/// A state, and one near by: the divergence of a motion may vanish at the start by a symmetry.
pub(crate) fn start_and_near(x: &[f64]) -> [Vec<f64>; 2] {
    let mut near = x.to_vec();
    for (k, scale) in sizes_of_differences(x).into_iter().enumerate() {
        near[k] += RADIUS * scale * (k as f64 + 0.5).sin();
    }
    [x.to_vec(), near]
}

impl<S: FrictionTerms> FromEquations<S> {
    fn own_terms(&self) -> OwnTerms<'_> {
        OwnTerms { system: &self.0, t: NO_CLOCK }
    }
}

impl<S: FrictionTerms> Fluctuating<Uniform> for FromEquations<S> {
    fn groups(&self) -> Vec<Range<usize>> {
        let all = 0..self.0.term_count();
        vec![all]
    }

    fn noise(&self, x: &Entries, terms: Range<usize>, drawn: Drawn<'_>) -> Option<Directions> {
        self.own_terms().noise(x, terms, drawn)
    }

    fn drift(&self, x: &Entries, _: usize, _: &Noise<Uniform>) -> Option<Directions> {
        self.own_terms().drift(x)
    }

    fn friction(&self, x: &Entries) -> Option<Directions> {
        let own = self.own_terms();
        summed(own.directions(), |v| own.add_friction(x, &own.both_covectors(x), v))
    }

    fn has_drift(&self, _: usize, _: &Noise<Uniform>) -> bool {
        true
    }

    fn landed(&self, Landing { to, laws, .. }: Landing<'_, Self>) -> Option<Entries> {
        self.onto(&to, laws, None)
    }

    fn examine_noise(&self, x: &Entries, _: &Noise<Uniform>) -> Result<(), NoiseError> {
        if self.0.second_law() != SecondLaw::Exact {
            return Err(NoiseError::NoiseAndPublished);
        }
        self.own_terms().examine(x)
    }

    fn check_start_alone(&self, x0: &Entries) -> Result<(), ModelError> {
        Judge::of(&self.0, NO_CLOCK).check_start(x0)
    }
}

impl<S: Equations> Judged for FromEquations<S> {
    type Broken = ModelError;
    type Report = Report;

    fn radius() -> f64 {
        RADIUS
    }

    fn verify_model(&self, x0: &Entries, radius: f64) -> Result<(), ModelError> {
        self.verify(x0, radius)
    }

    fn report_model(&self, x0: &Entries) -> Report {
        self.report(x0)
    }

    fn is_sound(report: &Report) -> bool {
        report.verdict.is_ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use metriplectic_equations::Terms;

    /// `H = x + y + z + xy` and `S = z` with the bracket `b(y) = 1 + a y` of `x` and `y`, without friction.
    struct Compressed(f64);

    impl Equations for Compressed {
        fn sizes(&self) -> Sizes {
            Sizes { entries: 3, directions: 3, laws: 2 }
        }

        fn values(&self, _: f64, x: &[f64], values: &mut [f64]) {
            values.copy_from_slice(&[x[0] + x[1] + x[2] + x[0] * x[1], x[2]]);
        }

        fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
            self.values(t, x, values);
            w.copy_from_slice(&[1.0 + x[1], 1.0 + x[0], 1.0, 0.0, 0.0, 1.0]);
        }

        fn velocity(&self, _: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
            let b = 1.0 + self.0 * x[1];
            v.copy_from_slice(&[b * (1.0 + x[0]), -b * (1.0 + x[1]), 0.0]);
            Some(0.0)
        }
    }

    impl FrictionTerms for Compressed {
        fn term_count(&self) -> usize {
            0
        }

        fn terms(&self, _: f64, _: &[f64], _: Covectors<'_>, _: &mut Terms<'_>) {}
    }

    #[test]
    fn a_motion_that_changes_the_volume_by_a_millionth_is_refused() {
        let changes = |part: f64| {
            let system = OwnTerms { system: &Compressed(part), t: NO_CLOCK };
            let verdict = system.examine_volume(&[0.7, 1.2, 0.3]);
            matches!(verdict, Err(NoiseError::NotUnimodular { .. }))
        };
        // The divergence is 2.2 times this part, of terms of the size 4.3.
        assert!(changes(4e-6) && !changes(1e-6));
    }
}
