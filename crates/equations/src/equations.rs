//! The questions that every system answers.

use crate::room::with_numbers;
use crate::{Evaluated, Kind, Model, PointError, SecondLaw};

/// The number of the energy `H` among the laws.
pub const ENERGY: usize = 0;
/// The number of the entropy `S` among the laws. A system without an entropy has `S = 0`.
pub const ENTROPY: usize = 1;

/// The lengths of the slices that a system takes and fills.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sizes {
    /// The numbers of a state `x`.
    pub entries: usize,
    /// The directions `n` of the chart at a state: the numbers of a displacement, a velocity and a covector.
    pub directions: usize,
    /// The laws: energy, entropy and the further invariants, at least 2.
    pub laws: usize,
}

/// A system `x' = Π dH + f(dH) + K dS` in plain numbers: its laws, its velocity and its space.
///
/// The slices have the lengths of [`sizes`](Self::sizes): `x` and `y` that of `entries`; `q`, `v` and sizes that of
/// `directions`, in the frame of the chart at `x`; values that of `laws`; rows of covectors `laws × directions`. Times
/// `t` are those of the clock, which most systems do not look at: a closed run asks at the time 0, and an open one at that of the state. A slice that is filled keeps nothing of what it held.
///
/// Four questions have no default. The others have that of a closed system on a flat space.
///
/// Laws ([`laws::equations`](crate::laws::equations)): 1. the differentials are those of the values; 2. `⟨dH, x'⟩ = 0` and
/// `⟨dL_a, x'⟩ = 0`; 3. the production is not negative, and `⟨dS, x'⟩` of an exact second law; 4. `φ_x(0) = x`, and the coordinates are the
/// inverse of the chart; 5. `ψ_x(0) = x`, and the rates there are the velocity; 6. in a [vector space](Self::is_vector_space) both charts
/// are translations; 7. the [power](Self::power) is the rate of the energy at a frozen state.
pub trait Equations {
    /// Returns the lengths of all slices. They do not change.
    fn sizes(&self) -> Sizes;

    /// Evaluates the laws `H, S, L_a` at a state.
    fn values(&self, t: f64, x: &[f64], values: &mut [f64]);

    /// Evaluates the laws with their differentials `dH, dS, dL_a` at a state.
    fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]);

    /// Computes the velocity `x'` at a state, and returns the production of entropy `⟨dS, K dS⟩`; `None` where it has no
    /// value.
    fn velocity(&self, t: f64, x: &[f64], v: &mut [f64]) -> Option<f64>;

    /// Returns the promise of the system about its entropy.
    fn second_law(&self) -> SecondLaw {
        SecondLaw::NoEntropy
    }

    /// Returns which fields are evaluated from a recording, as found at a state; nothing where none is written to be recorded.
    fn evaluated(&self, x: &[f64]) -> Vec<Evaluated> {
        let _ = x;
        Vec::new()
    }

    /// Returns why the further invariant with this number, from 0 on, is conserved.
    fn kind(&self, invariant: usize) -> Kind {
        let _ = invariant;
        Kind::Casimir
    }

    /// Returns whether the energy depends on time. Then it runs as an open system alone, and answers
    /// [`power`](Self::power).
    fn energy_depends_on_time(&self) -> bool {
        false
    }

    /// Computes the rate `∂_tH(t, x)` at which the energy changes at a state that stands still: the power of what changes it.
    fn power(&self, t: f64, x: &[f64]) -> f64 {
        let _ = (t, x);
        0.0
    }

    /// Checks that the entries are a state.
    ///
    /// # Errors
    ///
    /// [`PointError`] with the first entry that is not finite, or the distance from the space.
    fn check(&self, x: &[f64]) -> Result<(), PointError> {
        let bad = x.iter().position(|entry| !entry.is_finite());
        bad.map_or(Ok(()), |index| Err(PointError::NotFinite { index, value: x[index] }))
    }

    /// Measures how far a state is off its space; infinite outside of an open one, and NaN if an entry is.
    fn defect(&self, x: &[f64]) -> f64 {
        x.iter().fold(0.0, |sum, entry| sum + 0.0 * entry)
    }

    /// Returns the sizes of the entries of a state, one for each direction, in their units. Round-off is relative to them. The
    /// default is `|x_i|`.
    fn scales(&self, x: &[f64], sizes: &mut [f64]) {
        for (size, x) in sizes.iter_mut().zip(x) {
            *size = x.abs();
        }
    }

    /// Returns whether the space is a vector space: both charts are `x + q` everywhere, and the sizes are `|x_i|`, as in the defaults
    /// here. Then they need not be asked for.
    fn is_vector_space(&self) -> bool {
        false
    }

    /// Computes the state `y = φ_x(q)`. The default is `x + q`.
    fn chart(&self, x: &[f64], q: &[f64], y: &mut [f64]) {
        for ((y, x), q) in y.iter_mut().zip(x).zip(q) {
            *y = x + q;
        }
    }

    /// Computes the coordinates `q = φ_x⁻¹(y)`, and returns whether `y` is well inside the chart. The default is `y − x`.
    fn coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) -> bool {
        for ((q, y), x) in q.iter_mut().zip(y).zip(x) {
            *q = y - x;
        }
        q.iter().all(|q| q.is_finite())
    }

    /// Computes the state `y = ψ_x(q)` at which an explicit method takes a stage; returns `false` beyond the edge of this chart
    /// or of the domain. The chart `ψ_x` agrees with `φ_x` to first order and may be cheaper. The default is `φ_x`.
    fn stage_state(&self, x: &[f64], q: &[f64], y: &mut [f64]) -> bool {
        self.chart(x, q, y);
        y.iter().all(|y| y.is_finite())
    }

    /// Computes the coordinates `q = ψ_x⁻¹(y)`. The default is `φ_x⁻¹(y)`.
    fn stage_coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) {
        let _ = self.coordinates(x, y, q);
    }

    /// Computes the rates `q'` at `y = ψ_x(q)` of the velocity `v` in the frame at `y`: `d/ds ψ_x⁻¹(φ_y(sv))`. The default is `v` where
    /// the charts are translations, and elsewhere this derivative by a difference, with some twelve digits.
    fn stage_rates(&self, x: &[f64], q: &[f64], y: &[f64], v: &[f64], rates: &mut [f64]) {
        crate::paths::rates(self, [x, q, y, v], rates);
    }

    /// Computes the velocity and the production at a state whose differentials `w` are known, of all laws: what a step asks for
    /// at its ends. The default forms the differentials anew.
    fn velocity_with(&self, t: f64, x: &[f64], w: &[f64], v: &mut [f64]) -> Option<f64> {
        let _ = w;
        self.velocity(t, x, v)
    }

    /// Takes a stage of an explicit method: computes the rates `q'` at `y = ψ_x(q)`, and returns the production there; `None`
    /// beyond the edge of the chart or of the domain. The default asks for the state, its velocity and the rates one after
    /// another.
    fn stage(&self, t: f64, x: &[f64], q: &[f64], rates: &mut [f64]) -> Option<f64> {
        with_numbers(x.len() + q.len(), |room| {
            let (y, v) = room.split_at_mut(x.len());
            if !self.stage_state(x, q, y) {
                return None;
            }
            let production = self.velocity(t, y, v)?;
            let is_finite = v.iter().all(|v| v.is_finite());
            self.stage_rates(x, q, y, v, rates);
            is_finite.then_some(production)
        })
    }

    /// Returns whether the system was verified before, so that a run checks its laws at its start without samples around it.
    fn is_verified(&self) -> bool {
        false
    }

    /// Returns the parts of the system apart, if they are known.
    fn model(&self) -> Option<&dyn Model> {
        None
    }
}
