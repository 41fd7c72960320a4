//! The velocity of a model and the production of entropy, with their derivatives along the state.

use metriplectic_equations::{ENTROPY, Equations, Model, Sizes, Slopes, slopes};
use nalgebra::{DMatrix, DVector};

use super::algebra::Matrix;
use super::parts::{OfLaws, Parts, WithJacobian};
use super::velocity::written_velocity_jet;
use crate::numbers::AtRunTime;
use crate::step::Directions;
use crate::system::NO_CLOCK;

/// A law at a state: its value, its differential and its Hessian.
#[derive(Clone, Debug)]
pub(crate) struct LawAt {
    pub(crate) value: f64,
    pub(crate) df: DVector<f64>,
    pub(crate) hf: DMatrix<f64>,
}

impl LawAt {
    /// Returns whether all of its numbers are finite.
    pub(crate) fn is_finite(&self) -> bool {
        let all = self.df.iter().chain(self.hf.iter());
        all.fold(self.value * 0.0, |sum, number| sum + 0.0 * number) == 0.0
    }
}

/// The laws of a system at a state, the energy first, and what its motion needs there.
pub(crate) struct LawsAt<'a> {
    pub(crate) laws: Vec<LawAt>,
    by: By<'a>,
}

/// How the derivatives of a motion are formed.
enum By<'a> {
    /// By those of its parts.
    Parts(&'a dyn Model),
    /// By differences of the whole of it. Those of the parts of such a model leave out that friction may depend on `dS`.
    Differences(&'a dyn Equations, Option<Slopes>),
}

/// Evaluates the laws of a system at a state.
pub(crate) fn laws_at<'a>(system: &'a dyn Equations, x: &[f64]) -> LawsAt<'a> {
    let Sizes { directions: n, laws, .. } = system.sizes();
    if let Some(model) = system.model()
        && !model.has_derivatives_by_differences()
    {
        let law = |law| {
            let (mut df, mut hf) = (DVector::zeros(n), DMatrix::zeros(n, n));
            // A Hessian is symmetric: its rows are its columns.
            let value = model.hessian(law, NO_CLOCK, x, df.as_mut_slice(), hf.as_mut_slice());
            LawAt { value, df, hf }
        };
        return LawsAt { laws: (0..laws).map(law).collect(), by: By::Parts(model) };
    }
    let (mut values, mut w) = (vec![0.0; laws], vec![0.0; laws * n]);
    system.differentials(NO_CLOCK, x, &mut values, &mut w);
    let slopes = slopes(system, NO_CLOCK, x);
    let law = |law: usize| {
        let df = DVector::from_column_slice(&w[law * n..][..n]);
        let hf = slopes.as_ref().map_or_else(
            || DMatrix::from_element(n, n, f64::NAN),
            |slopes| DMatrix::from_column_slice(n, n, &slopes.hessians[law * n * n..][..n * n]),
        );
        LawAt { value: values[law], df, hf }
    };
    LawsAt { laws: (0..laws).map(law).collect(), by: By::Differences(system, slopes) }
}

/// The velocity `v = Π dH + f(dH) + K dS` of a system, as it is written by hand, and the production `σ = ⟨dS, K dS⟩`.
#[derive(Clone, Debug)]
pub(crate) struct Motion {
    pub(crate) velocity: DVector<f64>,
    /// `∂v/∂x`.
    pub(crate) slope: DMatrix<f64>,
    pub(crate) production: f64,
    /// `∂σ/∂x`.
    pub(crate) rise: DVector<f64>,
}

impl LawsAt<'_> {
    /// Computes the motion at the state; `None` where it has no value.
    pub(crate) fn motion(&self, x: &[f64]) -> Option<Motion> {
        match &self.by {
            By::Parts(model) => by_parts(*model, x, &self.laws),
            By::Differences(system, slopes) => {
                let (n, slopes) = (x.len(), slopes.as_ref()?);
                let mut velocity = DVector::zeros(n);
                let production = system.velocity(NO_CLOCK, x, velocity.as_mut_slice())?;
                let slope = DMatrix::from_row_slice(n, n, &slopes.velocity);
                let rise = DVector::from_column_slice(&slopes.production);
                Some(Motion { velocity, slope, production, rise })
            }
        }
    }
}

/// Computes the motion at a state, from the laws there; `None` where it has no value.
fn by_parts(model: &dyn Model, x: &[f64], laws: &[LawAt]) -> Option<Motion> {
    let parts = &Parts::<AtRunTime>::of(model);
    let n = x.len();
    let w: OfLaws<WithJacobian<AtRunTime>> = parts.each_law(|law| {
        let LawAt { df, hf, .. } = &laws[law];
        let (value, mut slope) = (Directions::of(df.as_slice()), Matrix::zeros(n));
        slope.numbers_mut().copy_from_slice(hf.as_slice());
        WithJacobian::new(value, slope)
    });
    let jet = written_velocity_jet(parts, &x.into(), &w)?;
    let mut rise = DVector::zeros(n);
    if let Some(WithJacobian { value, slope, .. }) = &jet.irreversible {
        let LawAt { df: ds, hf: hs, .. } = &laws[ENTROPY];
        rise = of(slope).tr_mul(ds) + hs * DVector::from_column_slice(value.numbers());
    }
    let WithJacobian { value, slope, .. } = &jet.velocity;
    let velocity = DVector::from_column_slice(value.numbers());
    Some(Motion { velocity, slope: of(slope), production: jet.production, rise })
}

/// The matrix with these rows.
fn of(a: &Matrix<AtRunTime>) -> DMatrix<f64> {
    DMatrix::from_row_slice(a.n(), a.n(), a.numbers())
}
