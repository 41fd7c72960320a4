//! The projection of a state onto its laws, at dual numbers.

use metriplectic_dynamics::Metriplectic;
use metriplectic_fields::{Column as _, Dimension as _, Jet2, Space, Vector, power_of_two};
use metriplectic_manifolds::{Manifold, MovingBase};
use num_dual::Dual64;

use super::duals::{Dual, Fields, Numbers, along, derivative};
use super::error::Unlinearised;
use crate::step::Dim;

/// The values of the laws, for each column, and the units of the entries.
pub(super) struct Aim<Y: Metriplectic> {
    pub(super) energy: Numbers,
    pub(super) invariants: Vec<Numbers>,
    pub(super) entropy: Option<Numbers>,
    pub(super) units: Vec<Dual<Y>>,
}

/// A projection by Newton's method along the differentials, as explicit steps do it, of a state with its derivatives.
pub(super) struct Landing<'a, Y: Metriplectic> {
    pub(super) system: &'a Y,
    pub(super) aim: &'a Aim<Y>,
}

/// A law made independent of those before it.
struct Normal<V> {
    hat: V,
    square: Dual64,
    residual: Dual64,
}

/// The independent fraction of a differential below which it is a combination of others.
const INDEPENDENT: f64 = 1e-10;
/// The most corrections.
const CORRECTIONS: usize = 10;
/// A correction, relative to the size of its entry, after which one more leaves nothing: they converge quadratically, and
/// their derivatives are one correction behind.
const SMALL: f64 = 1e-9;

/// A point of a system with derivatives.
pub(super) type DualPoint<Y> = <<Y as Metriplectic>::Manifold as Space>::Point<Dual64>;

impl<Y: Metriplectic<Manifold: MovingBase>> Landing<'_, Y> {
    /// Moves the points of all columns, whose real parts are the same.
    pub(super) fn land(
        &self,
        mut points: Vec<DualPoint<Y>>,
    ) -> Result<Vec<DualPoint<Y>>, Unlinearised> {
        let mut is_last = false;
        for _ in 0..CORRECTIONS {
            let Some(first) = points.first() else { break };
            let fields =
                Fields::at(self.system, Y::Manifold::real(first)).ok_or(Unlinearised::NotSmooth)?;
            let mut largest = 0.0_f64;
            let scales = Y::Manifold::scales(&fields.y);
            for (column, y) in points.iter_mut().enumerate() {
                let delta: Vector<Y::Manifold> =
                    derivative(&Y::Manifold::coordinates(&fields.y, y));
                let u = self.correction(&fields, &delta, column);
                for i in 0..Dim::<Y>::LEN {
                    if scales[i] > 0.0 {
                        largest = largest.max(u[i].re.abs() / scales[i]);
                    }
                }
                let velocity = Y::Manifold::embed(&fields.place(&delta), &u);
                *y = Y::Manifold::moved_from(&fields.y, &delta, &velocity);
            }
            if is_last {
                break;
            }
            is_last = largest <= SMALL;
        }
        Ok(points)
    }

    /// The correction of a column.
    fn correction(
        &self,
        fields: &Fields<Y>,
        delta: &Vector<Y::Manifold>,
        column: usize,
    ) -> Dual<Y> {
        let (aim, units) = (self.aim, &self.aim.units[column]);
        let mut normals: Vec<Normal<Dual<Y>>> = Vec::with_capacity(aim.invariants.len() + 2);
        let mut enter = |jet: &Jet2<Y::Manifold>, target: Dual64| {
            let whole = whole::<Y>(along::<Y>(jet, delta), target, units);
            let size = whole.square.re;
            let normal = independent::<Y>(whole, &normals);
            if normal.square.re > INDEPENDENT * INDEPENDENT * size {
                normals.push(normal);
            }
        };
        enter(&fields.jets.energy, aim.energy[column]);
        let listed = fields.jets.invariants.as_ref().iter().flatten();
        for ((_, jet), target) in listed.zip(&aim.invariants) {
            enter(jet, target[column]);
        }
        if let Some(entropy) = &aim.entropy {
            enter(&fields.jets.entropy, entropy[column]);
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
    Normal { hat, square: hat.dot(&hat), residual: (target - value) * factor }
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
        }
    }
    normal.square = normal.hat.dot(&normal.hat);
    normal
}
