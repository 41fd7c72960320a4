//! The points of a step with stages around its root, along the directions of its unknowns.
//!
//! With the displacements `h k_j` in the chart at its middle `z`, and `d = Σ b_j h k_j`, a step has
//!
//! ```math
//! x = \varphi_z(-\tfrac12 d), \qquad X_i = \varphi_z\Bigl(\sum_j (a_{ij} - \tfrac12 b_j)\, h k_j\Bigr), \qquad
//! x' = \varphi_z(\tfrac12 d) .
//! ```
//!
//! So both ends follow from `(z, hk)`, and neither is prior to the other.

use metriplectic_dynamics::{Metriplectic, system::Point};
use metriplectic_fields::{
    ChartPoint, Column as _, Dimension as _, Matrix, Real, Space as _, Square as _, Vector,
};
use metriplectic_manifolds::{Manifold as _, MovingBase};
use num_dual::Dual64;

use super::super::duals::{Dual, Hyperdual};
use super::super::linearised::Piece;
use crate::collocation::{STAGES, Stages, StepRoot, combined};
use crate::step::Dim;

/// A number for each stage.
type Coefficients = [f64; STAGES];

/// A direction of the unknowns of a step, or of its size.
pub(super) struct Direction<Y: Metriplectic> {
    /// Of the middle.
    middle: Vector<Y::Manifold>,
    /// Of the displacements of the stages.
    displacements: Stages<Vector<Y::Manifold>>,
    /// Of the size of the step.
    size: f64,
}

impl<Y: Metriplectic> Direction<Y> {
    /// The directions of the middle, those of the displacements, and the one of the size.
    pub(super) fn all(stages: usize) -> Vec<Self> {
        let (n, zero) = (Dim::<Y>::LEN, Vector::<Y::Manifold>::zero());
        let still = || Self { middle: zero, displacements: [zero; STAGES], size: 0.0 };
        let unit = Vector::<Y::Manifold>::basis;
        let mut all: Vec<Self> = (0..n).map(|c| Self { middle: unit(c), ..still() }).collect();
        for stage in 0..stages {
            for c in 0..n {
                let mut direction = still();
                direction.displacements[stage] = unit(c);
                all.push(direction);
            }
        }
        all.push(Self { size: 1.0, ..still() });
        all
    }
}

/// A step around its root.
pub(super) struct Around<'a, Y: Metriplectic> {
    pub(super) system: &'a Y,
    pub(super) piece: &'a Piece<'a, Y>,
    pub(super) root: StepRoot<Y>,
    /// The stages `X_i`.
    pub(super) points: Vec<Point<Y>>,
}

/// A step along a direction.
pub(super) struct Moved<Y: Metriplectic> {
    /// The size of the step.
    pub(super) size: Dual64,
    /// The derivative of its start, in the frame there.
    pub(super) start: Vector<Y::Manifold>,
    /// The derivative of its end.
    pub(super) end: Vector<Y::Manifold>,
    pub(super) stages: Vec<MovedStage<Y>>,
}

/// A stage along a direction, in the chart at `X_i`.
pub(super) struct MovedStage<Y: Metriplectic> {
    pub(super) place: ChartPoint<Y::Manifold, Dual64>,
    /// The derivative of the point.
    pub(super) delta: Vector<Y::Manifold>,
    /// The displacement `h v_i`.
    pub(super) displacement: Dual<Y>,
}

/// The rates of coordinates along `ε₂`, with their derivatives along `ε₁`.
fn rates<Y: Metriplectic>(q: &Vector<Y::Manifold, Real>) -> Dual<Y> {
    Dual::<Y>::from_index(|c| Dual64::new(q[c].eps2, q[c].eps1eps2))
}

impl<'a, Y: Metriplectic<Manifold: MovingBase>> Around<'a, Y> {
    pub(super) fn new(system: &'a Y, piece: &'a Piece<'a, Y>, root: StepRoot<Y>) -> Self {
        let mut around = Self { system, piece, root, points: Vec::new() };
        let (z, s) = (&around.root.z, around.root.tableau.stages);
        let stage = |i| {
            let position = around.position(i);
            Y::Manifold::chart(z, &combined(s, &position, &around.root.displacements))
        };
        around.points = (0..s).map(stage).collect();
        around
    }

    /// The coefficients `a_ij − b_j/2` of a stage.
    fn position(&self, i: usize) -> Coefficients {
        let tableau = self.root.tableau;
        std::array::from_fn(|j| tableau.matrix[i][j] - 0.5 * tableau.weights[j])
    }

    /// The point `φ_z(Σ_j p_j hk_j + ε₂ Σ_j r_j hk_j)`, along a direction.
    pub(super) fn along(
        &self,
        direction: &Direction<Y>,
        position: &Coefficients,
        rate: &Coefficients,
    ) -> Hyperdual<Y> {
        let StepRoot { tableau, z, displacements, .. } = &self.root;
        let at = |coefficients| {
            [displacements, &direction.displacements]
                .map(|vectors| combined(tableau.stages, coefficients, vectors))
        };
        let ([q, dq], [v, dv]) = (at(position), at(rate));
        let q = Vector::<Y::Manifold, Real>::from_index(|c| Real::new(q[c], dq[c], v[c], dv[c]));
        Y::Manifold::chart_from(z, &direction.middle, &q)
    }

    pub(super) fn moved(&self, direction: &Direction<Y>) -> Moved<Y> {
        let (tableau, none) = (self.root.tableau, [0.0; STAGES]);
        let end = |at: &Point<Y>, sign: f64| {
            let half = tableau.weights.map(|b| 0.5 * sign * b);
            let q = Y::Manifold::coordinates(at, &self.along(direction, &half, &none));
            Vector::<Y::Manifold>::from_index(|c| q[c].eps1)
        };
        let stage = |i: usize| {
            let rate = std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 });
            let y = self.along(direction, &self.position(i), &rate);
            let q = Y::Manifold::coordinates(&self.points[i], &y);
            let delta = Vector::<Y::Manifold>::from_index(|c| q[c].eps1);
            let moving = Dual::<Y>::from_index(|c| Dual64::new(0.0, delta[c]));
            let place = ChartPoint { base: self.points[i].clone(), q: moving };
            MovedStage { place, delta, displacement: rates::<Y>(&q) }
        };
        Moved {
            size: Dual64::new(self.piece.h, direction.size),
            start: end(self.piece.x, -1.0),
            end: end(self.piece.end, 1.0),
            stages: (0..tableau.stages).map(stage).collect(),
        }
    }

    /// The map of velocities in the chart at the middle to those at a stage, or at the start, and its derivative.
    pub(super) fn map(
        &self,
        direction: &Direction<Y>,
        stage: Option<usize>,
    ) -> [Matrix<Y::Manifold>; 2] {
        let StepRoot { tableau, z, displacements, .. } = &self.root;
        let (position, at) = match stage {
            Some(i) => (self.position(i), &self.points[i]),
            None => (tableau.weights.map(|b| -0.5 * b), self.piece.x),
        };
        let [q, dq] = [displacements, &direction.displacements]
            .map(|vectors| combined(tableau.stages, &position, vectors));
        let columns = Dim::<Y>::array(|k| {
            let part = |c| if c == k { 1.0 } else { 0.0 };
            let q =
                Vector::<Y::Manifold, Real>::from_index(|c| Real::new(q[c], dq[c], part(c), 0.0));
            let y = Y::Manifold::chart_from(z, &direction.middle, &q);
            rates::<Y>(&Y::Manifold::coordinates(at, &y))
        });
        let columns = columns.as_ref();
        [
            Matrix::<Y::Manifold>::from_entries(|i, k| columns[k][i].re),
            Matrix::<Y::Manifold>::from_entries(|i, k| columns[k][i].eps),
        ]
    }

    /// The sizes of the entries at the end.
    pub(super) fn scales(&self) -> Vector<Y::Manifold> {
        Y::Manifold::scales(self.piece.end)
    }
}
