//! The velocity of a model and the production of entropy, with their derivatives along the state.

use metriplectic_equations::{ENTROPY, Equations, Model, Sizes, Slopes, slopes};
use nalgebra::{DMatrix, DVector};

use super::algebra::Matrix;
use super::parts::{OfLaws, Parts, WithJacobian};
use super::velocity::{Columns, written_velocity_jet};
use crate::numbers::AtRunTime;
use crate::step::Directions;
use crate::system::NO_CLOCK;

/// A law at a state: its value, its differential and its Hessian, and the derivatives of the first two along parameters.
#[derive(Clone, Debug)]
pub(crate) struct LawAt {
    pub(crate) value: f64,
    pub(crate) df: DVector<f64>,
    pub(crate) hf: DMatrix<f64>,
    /// `∂F/∂θ`.
    pub(crate) along: DVector<f64>,
    /// `∂dF/∂θ`, a column for each parameter.
    pub(crate) df_along: DMatrix<f64>,
}

impl LawAt {
    /// Returns whether all of its numbers are finite.
    pub(crate) fn is_finite(&self) -> bool {
        let all = self.df.iter().chain(&self.hf).chain(&self.along).chain(&self.df_along);
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

/// Computes the derivatives of a law of a model and of its differential along its first parameters, at a state: a column for each.
pub(crate) fn law_along_parameters(
    model: &dyn Model,
    law: usize,
    x: &[f64],
    count: usize,
) -> (DVector<f64>, DMatrix<f64>) {
    let (mut along, mut df_along) = (DVector::zeros(count), DMatrix::zeros(x.len(), count));
    let mut df = DVector::zeros(x.len());
    for k in 0..count {
        along[k] = model.law_along_parameter(law, k, NO_CLOCK, x, df.as_mut_slice());
        df_along.set_column(k, &df);
    }
    (along, df_along)
}

/// Evaluates the laws of a system at a state, with their derivatives along its first parameters, which a model with derivatives of its
/// own may know.
pub(crate) fn laws_at<'a>(system: &'a dyn Equations, x: &[f64], parameters: usize) -> LawsAt<'a> {
    let Sizes { directions: n, laws, .. } = system.sizes();
    if let Some(model) = system.model()
        && !model.has_derivatives_by_differences()
    {
        let law = |law| {
            let (mut df, mut hf) = (DVector::zeros(n), DMatrix::zeros(n, n));
            // A Hessian is symmetric: its rows are its columns.
            let value = model.hessian(law, NO_CLOCK, x, df.as_mut_slice(), hf.as_mut_slice());
            let (along, df_along) = law_along_parameters(model, law, x, parameters);
            LawAt { value, df, hf, along, df_along }
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
        let (along, df_along) = (DVector::zeros(0), DMatrix::zeros(n, 0));
        LawAt { value: values[law], df, hf, along, df_along }
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
    /// `∂v/∂θ`, a column for each parameter.
    pub(crate) along: DMatrix<f64>,
    /// `∂σ/∂θ`.
    pub(crate) rise_along: DVector<f64>,
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
                let (along, rise_along) = (DMatrix::zeros(n, 0), DVector::zeros(0));
                Some(Motion { velocity, slope, production, rise, along, rise_along })
            }
        }
    }
}

/// Computes the motion at a state, from the laws there; `None` where it has no value.
fn by_parts(model: &dyn Model, x: &[f64], laws: &[LawAt]) -> Option<Motion> {
    let parts = &Parts::<AtRunTime>::of(model);
    let n = x.len();
    let state = x.into();
    // The velocity and the production with their derivatives along the columns of these derivatives of the differentials.
    let motion = |columns: Columns, slope: &dyn Fn(&LawAt, usize, usize) -> f64| {
        let w: OfLaws<WithJacobian<AtRunTime>> = parts.each_law(|law| {
            let value = Directions::of(laws[law].df.as_slice());
            WithJacobian::new(value, Matrix::of(n, |i, c| slope(&laws[law], i, c)))
        });
        let jet = written_velocity_jet(parts, &state, columns, &w)?;
        let mut rise = DVector::zeros(n);
        if let Some(WithJacobian { value, slope, .. }) = &jet.irreversible {
            let along_entropy = of(&w.entropy.slope);
            rise = of(slope).tr_mul(&laws[ENTROPY].df)
                + along_entropy.tr_mul(&DVector::from_column_slice(value.numbers()));
        }
        Some((jet, rise))
    };
    let (jet, rise) = motion(Columns::Directions(1.0), &|law, i, c| law.hf[(c, i)])?;
    let count = laws[ENTROPY].along.len();
    let (mut along, mut rise_along) = (DMatrix::zeros(n, count), DVector::zeros(count));
    for first in (0..count).step_by(n) {
        let chunk = first..count.min(first + n);
        let (at, len) = (chunk.start, chunk.len());
        let slope = |law: &LawAt, i: usize, c: usize| {
            if c < len { law.df_along[(i, at + c)] } else { 0.0 }
        };
        let (jet, rise) = motion(Columns::Parameters(chunk), &slope)?;
        along.columns_mut(at, len).copy_from(&of(&jet.velocity.slope).columns(0, len));
        rise_along.rows_mut(at, len).copy_from(&rise.rows(0, len));
    }
    let WithJacobian { value, slope, .. } = &jet.velocity;
    let velocity = DVector::from_column_slice(value.numbers());
    let (slope, production) = (of(slope), jet.production);
    Some(Motion { velocity, slope, production, rise, along, rise_along })
}

/// The matrix with these rows.
fn of(a: &Matrix<AtRunTime>) -> DMatrix<f64> {
    DMatrix::from_row_slice(a.n(), a.n(), a.numbers())
}
