//! The projection of a state onto the laws of a model, with its derivatives.

use metriplectic_equations::{ENERGY, ENTROPY, Equations};
use metriplectic_fields::power_of_two;
use nalgebra::{DMatrix, DVector};
use num_dual::Dual64;

use crate::implicit::{LawAt, laws_at};
use crate::round_off::bound::{self as round_off, INDEPENDENT};
use crate::tangent::CORRECTIONS;
use crate::tangent::error::Unlinearised;
use crate::tangent::landing::{Residuals, SMALL};

/// A vector with its derivatives along all columns.
#[derive(Clone)]
pub(super) struct Along {
    pub(super) value: DVector<f64>,
    pub(super) slopes: DMatrix<f64>,
}

impl Along {
    pub(super) fn zero(n: usize, columns: usize) -> Self {
        Self { value: DVector::zeros(n), slopes: DMatrix::zeros(n, columns) }
    }

    pub(super) fn add(&mut self, w: f64, other: &Self) {
        self.value.axpy(w, &other.value, 1.0);
        add(&mut self.slopes, w, &other.slopes);
    }
}

/// `A += w B`.
fn add(a: &mut DMatrix<f64>, w: f64, b: &DMatrix<f64>) {
    a.zip_apply(b, |a, b| *a += w * b);
}

/// The values of the laws, for each column, and the units of the entries.
pub(super) struct Aim {
    pub(super) energy: Vec<Dual64>,
    pub(super) invariants: Vec<Vec<Dual64>>,
    pub(super) entropy: Option<Vec<Dual64>>,
    pub(super) units: Vec<Vec<Dual64>>,
}

/// A projection by Newton's method along the differentials, as explicit steps do it, of a state with its derivatives.
pub(super) struct Landing<'a> {
    pub(super) model: &'a dyn Equations,
    pub(super) aim: &'a Aim,
    /// How the parameters move along the columns.
    pub(super) parameters: &'a DMatrix<f64>,
}

/// A law made independent of those before it.
struct Normal {
    hat: Vec<Dual64>,
    square: Dual64,
    residual: Dual64,
    /// The round-off of the residual.
    rounding: f64,
}

/// The state on its laws.
pub(super) struct Landed {
    /// Its derivatives, from the end of the step that was taken.
    pub(super) slopes: DMatrix<f64>,
    /// The end that was found.
    pub(super) reached: DVector<f64>,
    /// The displacement that the round-off of the laws makes: near an equilibrium it is far above that of the entries.
    pub(super) rounding: DVector<f64>,
}

fn dot(a: &[Dual64], b: &[Dual64]) -> Dual64 {
    a.iter().zip(b).fold(Dual64::from(0.0), |sum, (a, b)| sum + *a * *b)
}

impl Landing<'_> {
    /// Moves a state onto the laws, and takes its derivatives at the end of the step that was taken.
    pub(super) fn land(&self, mut y: Along, end: &[f64]) -> Result<Landed, Unlinearised> {
        let n = end.len();
        let mut rounding = DVector::zeros(n);
        for _ in 0..CORRECTIONS {
            let laws = self.laws(y.value.as_slice())?;
            let scales = y.value.abs();
            let [u, by_rounding] = self.pass(&laws, &mut y, Residuals::AboveRounding);
            rounding = by_rounding;
            let sized = (0..n).filter(|&i| u[i] > rounding[i] && scales[i] > 0.0);
            if sized.map(|i| u[i] / scales[i]).fold(0.0, f64::max) <= SMALL {
                break;
            }
        }
        let mut reached = y.value.clone();
        if (0..n).any(|i| rounding[i] > SMALL * reached[i].abs()) {
            let mut first =
                Along { value: reached.clone(), slopes: y.slopes.columns(0, 1).into_owned() };
            self.pass(&self.laws(reached.as_slice())?, &mut first, Residuals::All);
            reached = first.value;
        }
        y.value.copy_from_slice(end);
        self.pass(&self.laws(end)?, &mut y, Residuals::None);
        Ok(Landed { slopes: y.slopes, reached, rounding })
    }

    fn laws(&self, y: &[f64]) -> Result<Vec<LawAt>, Unlinearised> {
        let laws = laws_at(self.model, y, self.parameters.nrows()).laws;
        if laws.iter().all(LawAt::is_finite) { Ok(laws) } else { Err(Unlinearised::NotSmooth) }
    }

    /// Corrects a state and its columns; the size of the correction of the first one, and that of its round-off.
    fn pass(&self, laws: &[LawAt], y: &mut Along, residuals: Residuals) -> [DVector<f64>; 2] {
        let (n, columns) = y.slopes.shape();
        // The values and the differentials along all columns.
        let parameters = self.parameters.columns(0, columns);
        let along_columns = |LawAt { df, hf, along, df_along, .. }: &LawAt| {
            let rise = y.slopes.tr_mul(df) + parameters.tr_mul(along);
            (rise, hf * &y.slopes + df_along * parameters)
        };
        let along: Vec<_> = laws.iter().map(along_columns).collect();
        let mut normals = Vec::new();
        let mut first = [DVector::zeros(n), DVector::zeros(n)];
        let mut value = y.value.clone();
        for c in 0..columns {
            let law = |law: usize| {
                let (LawAt { value, df, .. }, (rise, bend)) = (&laws[law], &along[law]);
                let df: Vec<_> = (0..n).map(|i| Dual64::new(df[i], bend[(i, c)])).collect();
                (Dual64::new(*value, rise[c]), df)
            };
            let u = self.correction((&law, residuals), c, &mut normals);
            if c == 0 {
                first = [DVector::from_fn(n, |i, _| u[i].re.abs()), self.rounding(&normals)];
                (0..n).for_each(|i| value[i] += u[i].re);
            }
            (0..n).for_each(|i| y.slopes[(i, c)] += u[i].eps);
        }
        y.value = value;
        first
    }

    /// The displacement by the round-off of the laws.
    fn rounding(&self, normals: &[Normal]) -> DVector<f64> {
        let units = &self.aim.units[0];
        DVector::from_fn(units.len(), |i, _| {
            let parts = normals.iter().map(|n| n.hat[i].re.abs() * (n.rounding / n.square.re));
            parts.sum::<f64>() * units[i].re
        })
    }

    /// The correction of a column.
    fn correction(
        &self,
        (law, residuals): (&dyn Fn(usize) -> (Dual64, Vec<Dual64>), Residuals),
        column: usize,
        normals: &mut Vec<Normal>,
    ) -> Vec<Dual64> {
        let (aim, units) = (self.aim, &self.aim.units[column]);
        normals.clear();
        let mut enter = |number: usize, target: Dual64| {
            let whole = whole(law(number), target, units);
            let size = whole.square.re;
            let mut normal = independent(whole, normals);
            let is_rounding = normal.residual.re.abs() <= normal.rounding;
            match residuals {
                Residuals::None => normal.residual.re = 0.0,
                Residuals::AboveRounding if is_rounding => normal.residual.re = 0.0,
                Residuals::AboveRounding | Residuals::All => {}
            }
            if normal.square.re > INDEPENDENT * INDEPENDENT * size {
                normals.push(normal);
            }
        };
        enter(ENERGY, aim.energy[column]);
        for (k, target) in aim.invariants.iter().enumerate() {
            enter(ENTROPY + 1 + k, target[column]);
        }
        if let Some(entropy) = &aim.entropy {
            enter(ENTROPY, entropy[column]);
        }
        let mut sum = vec![Dual64::from(0.0); units.len()];
        for Normal { hat, square, residual, .. } in &*normals {
            let share = *residual / *square;
            sum.iter_mut().zip(hat).for_each(|(sum, hat)| *sum += *hat * share);
        }
        sum.iter().zip(units).map(|(sum, unit)| *sum * *unit).collect()
    }
}

/// A law in units of the entries, and of a power of two near its length.
fn whole((value, df): (Dual64, Vec<Dual64>), target: Dual64, units: &[Dual64]) -> Normal {
    let mut hat: Vec<_> = df.iter().zip(units).map(|(df, unit)| *df * *unit).collect();
    let terms = hat.iter().fold(value.re.abs(), |sum, hat| sum + hat.re.abs());
    let length = DVector::from_iterator(hat.len(), hat.iter().map(|hat| hat.re));
    let length = metriplectic_fields::length(length.as_slice());
    let factor = if length > 0.0 { power_of_two(length).recip() } else { 1.0 };
    hat.iter_mut().for_each(|hat| *hat *= factor);
    let rounding = round_off::ROUNDED * terms * factor;
    Normal { square: dot(&hat, &hat), hat, residual: (target - value) * factor, rounding }
}

/// The part of a law that does not depend on those before it.
fn independent(mut normal: Normal, before: &[Normal]) -> Normal {
    // The second pass removes the rounding error of the first.
    for _ in 0..2 {
        for law in before {
            let share = dot(&law.hat, &normal.hat) / law.square;
            normal.hat.iter_mut().zip(&law.hat).for_each(|(to, hat)| *to -= *hat * share);
            normal.residual -= share * law.residual;
            normal.rounding += share.re.abs() * law.rounding;
        }
    }
    normal.square = dot(&normal.hat, &normal.hat);
    normal
}
