//! The projection of a state onto its laws, at dual numbers.

use metriplectic_dynamics::{Metriplectic, system::Point};
use metriplectic_fields::{Column as _, Dimension as _, Jet2, Space, Vector, power_of_two};
use metriplectic_manifolds::{Manifold, MovingBase};
use num_dual::Dual64;

use super::CORRECTIONS;
use super::duals::{Direction, Dual, ENERGY, ENTROPY, Fields, Numbers, derivative};
use super::error::Unlinearised;
use super::model::Model;
use crate::round_off::bound::{self as round_off, INDEPENDENT};
use crate::step::Dim;

/// The values of the laws, for each column, and the units of the entries.
pub(super) struct Aim<Y: Metriplectic> {
    pub(super) energy: Numbers,
    pub(super) invariants: Vec<Numbers>,
    pub(super) entropy: Option<Numbers>,
    pub(super) units: Vec<Dual<Y>>,
}

/// A projection by Newton's method along the differentials, as explicit steps do it, of a state with its derivatives.
pub(super) struct Landing<'a, K: Model> {
    pub(super) model: &'a K,
    pub(super) aim: &'a Aim<K::System>,
    /// The parameter that moves with each column.
    pub(super) parameters: &'a [Option<usize>],
}

/// A law made independent of those before it.
struct Normal<V> {
    hat: V,
    square: Dual64,
    residual: Dual64,
    /// The round-off of the residual.
    rounding: f64,
}

/// A correction, relative to the size of its entry, after which one more leaves nothing: they converge quadratically, and
/// their derivatives are one correction behind.
pub(super) const SMALL: f64 = 1e-9;

/// A point of a system with derivatives.
pub(super) type DualPoint<Y> = <<Y as Metriplectic>::Manifold as Space>::Point<Dual64>;

/// The residuals of the laws that are corrected. The derivative of a correction by round-off does not belong to the step, and near
/// an equilibrium it is far above round-off.
#[derive(Clone, Copy)]
pub(super) enum Residuals {
    All,
    AboveRounding,
    None,
}

/// The points of all columns on their laws.
pub(super) struct Landed<Y: Metriplectic> {
    /// From the end of the step that was taken.
    pub(super) points: Vec<DualPoint<Y>>,
    /// The end that was found.
    pub(super) reached: Point<Y>,
    /// The displacement that the round-off of the laws makes: near an equilibrium it is far above that of the entries.
    pub(super) rounding: Vector<Y::Manifold>,
}

impl<K, Y> Landing<'_, K>
where
    Y: Metriplectic<Manifold: MovingBase>,
    K: Model<System = Y>,
{
    /// Moves the points of all columns, whose real parts are the same, and takes their derivatives at the end of the step that was taken.
    pub(super) fn land(
        &self,
        mut points: Vec<DualPoint<Y>>,
        end: &Point<Y>,
    ) -> Result<Landed<Y>, Unlinearised> {
        let mut rounding = Vector::<Y::Manifold>::zero();
        for _ in 0..CORRECTIONS {
            let fields = self.fields(Y::Manifold::real(&points[0]))?;
            let scales = Y::Manifold::scales(&fields.y);
            let [u, by_rounding] = self.pass(&fields, &mut points, Residuals::AboveRounding);
            rounding = by_rounding;
            let sized = (0..Dim::<Y>::LEN).filter(|i| u[*i] > rounding[*i] && scales[*i] > 0.0);
            if sized.map(|i| u[i] / scales[i]).fold(0.0, f64::max) <= SMALL {
                break;
            }
        }
        let mut reached = Y::Manifold::real(&points[0]);
        let scales = Y::Manifold::scales(&reached);
        if (0..Dim::<Y>::LEN).any(|i| rounding[i] > SMALL * scales[i]) {
            let mut first = [points[0].clone()];
            self.pass(&self.fields(reached)?, &mut first, Residuals::All);
            reached = Y::Manifold::real(&first[0]);
        }
        self.pass(&self.fields(end.clone())?, &mut points, Residuals::None);
        Ok(Landed { points, reached, rounding })
    }

    fn fields(&self, y: Point<Y>) -> Result<Fields<Y>, Unlinearised> {
        Fields::at(self.model, y).ok_or(Unlinearised::NotSmooth)
    }

    /// Corrects all columns from a point; the size of the correction of the first one, and that of its round-off.
    fn pass(
        &self,
        fields: &Fields<Y>,
        points: &mut [DualPoint<Y>],
        residuals: Residuals,
    ) -> [Vector<Y::Manifold>; 2] {
        let mut normals = Vec::new();
        let mut first = [Vector::<Y::Manifold>::zero(); 2];
        for (column, y) in points.iter_mut().enumerate() {
            let delta = derivative(&Y::Manifold::coordinates(&fields.y, y));
            let direction = Direction { delta, parameter: self.parameters[column] };
            let u = self.correction((fields, residuals), &direction, column, &mut normals);
            if column == 0 {
                let size = Vector::<Y::Manifold>::from_index(|i| u[i].re.abs());
                first = [size, self.rounding(&normals)];
            }
            let velocity = fields.embedded(&delta, &u);
            *y = Y::Manifold::moved_from(&fields.y, &delta, &velocity);
        }
        first
    }

    /// The displacement by the round-off of the laws.
    fn rounding(&self, normals: &[Normal<Dual<Y>>]) -> Vector<Y::Manifold> {
        let units = &self.aim.units[0];
        Vector::<Y::Manifold>::from_index(|i| {
            let parts = normals.iter().map(|n| n.hat[i].re.abs() * (n.rounding / n.square.re));
            parts.sum::<f64>() * units[i].re
        })
    }

    /// The correction of a column.
    fn correction(
        &self,
        (fields, residuals): (&Fields<Y>, Residuals),
        direction: &Direction<Y>,
        column: usize,
        normals: &mut Vec<Normal<Dual<Y>>>,
    ) -> Dual<Y> {
        let (aim, units) = (self.aim, &self.aim.units[column]);
        normals.clear();
        let mut enter = |field: usize, jet: &Jet2<Y::Manifold>, target: Dual64| {
            let whole = whole::<Y>(fields.along(field, jet, direction), target, units);
            let size = whole.square.re;
            let mut normal = independent::<Y>(whole, normals);
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
        enter(ENERGY, &fields.jets.energy, aim.energy[column]);
        let listed = fields.jets.invariants.as_ref().iter().flatten();
        for (k, ((_, jet), target)) in listed.zip(&aim.invariants).enumerate() {
            enter(ENTROPY + 1 + k, jet, target[column]);
        }
        if let Some(entropy) = &aim.entropy {
            enter(ENTROPY, &fields.jets.entropy, entropy[column]);
        }
        let sum = normals.iter().fold(Dual::<Y>::zero(), |sum, normal| {
            sum + normal.hat * (normal.residual / normal.square)
        });
        Dual::<Y>::from_index(|i| sum[i] * units[i])
    }
}

/// A law in units of the entries, and of a power of two near its length.
fn whole<Y: Metriplectic>(
    (value, df): (Dual64, Dual<Y>),
    target: Dual64,
    units: &Dual<Y>,
) -> Normal<Dual<Y>> {
    let whole = Dual::<Y>::from_index(|i| df[i] * units[i]);
    let length = whole.magnitude();
    let factor = if length > 0.0 { power_of_two(length).recip() } else { 1.0 };
    let hat = whole * Dual64::from(factor);
    let terms = (0..Dim::<Y>::LEN).fold(value.re.abs(), |sum, i| sum + whole[i].re.abs());
    let rounding = round_off::ROUNDED * terms * factor;
    Normal { hat, square: hat.dot(&hat), residual: (target - value) * factor, rounding }
}

/// The part of a law that does not depend on those before it.
fn independent<Y: Metriplectic>(
    mut normal: Normal<Dual<Y>>,
    before: &[Normal<Dual<Y>>],
) -> Normal<Dual<Y>> {
    // The second pass removes the rounding error of the first.
    for _ in 0..2 {
        for law in before {
            let share = law.hat.dot(&normal.hat) / law.square;
            normal.hat -= law.hat * share;
            normal.residual -= share * law.residual;
            normal.rounding += share.re.abs() * law.rounding;
        }
    }
    normal.square = normal.hat.dot(&normal.hat);
    normal
}
