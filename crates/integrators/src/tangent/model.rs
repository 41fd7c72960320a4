//! The fields of a system with their second derivatives, along the state and along parameters.

use metriplectic_dynamics::velocity::{Covectors, Gradient};
use metriplectic_dynamics::{Differentiable, Metriplectic, system::Point};
use metriplectic_fields::{Column as _, Dimension as _, Jet2, ScalarField, Space, Vector};

use super::part::Wide;
use crate::step::{CountOf, Dim};

/// The derivatives of a field along a parameter: `∂_θF` and `∂_θ dF`.
pub(super) type AlongParameter<Y> = (f64, Vector<<Y as Metriplectic>::Manifold>);

/// A system whose steps are differentiated.
pub(super) trait Model {
    /// The system whose state moves.
    type System: Metriplectic;

    fn system(&self) -> &Self::System;

    /// The number of parameters that are treated apart.
    fn parameters(&self) -> usize {
        0
    }

    /// The derivatives of all fields along the parameters at a point: field by field, the energy first.
    fn along_parameters(&self, y: &Point<Self::System>) -> Vec<AlongParameter<Self::System>> {
        let _ = y;
        Vec::new()
    }
}

/// A system without parameters, or one whose parameters are entries of the state.
#[derive(Debug)]
pub(super) struct Plain<'a, Y>(pub(super) &'a Y);

impl<Y: Metriplectic> Model for Plain<'_, Y> {
    type System = Y;

    fn system(&self) -> &Y {
        self.0
    }
}

/// A system with parameters of its fields.
#[derive(Debug)]
pub(super) struct WithParameters<'a, D>(pub(super) &'a D);

impl<D: Differentiable> Model for WithParameters<'_, D> {
    type System = D;

    fn system(&self) -> &D {
        self.0
    }

    fn parameters(&self) -> usize {
        Dim::<Wide<D>>::LEN - Dim::<D>::LEN
    }

    fn along_parameters(&self, y: &Point<D>) -> Vec<AlongParameter<D>> {
        let (wide, count) = (self.0.wide(), self.parameters());
        let fields = 2 + CountOf::<D>::LEN;
        let along = Vec::with_capacity(fields * count);
        let mut mixed = Mixed::<D> { system: self.0, y, count, along };
        let (): () = mixed.of(wide.energy());
        let (): () = mixed.of(wide.entropy());
        Covectors::new([(), ()], wide.invariants(), &mut mixed);
        mixed.along
    }
}

/// The mixed derivatives of fields, `n` evaluations for each parameter.
struct Mixed<'a, D: Differentiable> {
    system: &'a D,
    y: &'a Point<D>,
    count: usize,
    along: Vec<AlongParameter<D>>,
}

impl<D: Differentiable> Gradient<<Wide<D> as Metriplectic>::Manifold> for Mixed<'_, D> {
    type Covector = ();

    fn of(&mut self, f: &impl ScalarField<<Wide<D> as Metriplectic>::Manifold>) {
        let (seeded, n) = (D::Manifold::seeds(self.y), Dim::<D>::LEN);
        for k in 0..self.count {
            let mut slope = 0.0;
            let bend = Vector::<D::Manifold>::from_index(|i| {
                let value = f.at_real(&self.system.seeded(seeded(i, n), [usize::MAX, k]));
                slope = value.eps2;
                value.eps1eps2
            });
            self.along.push((slope, bend));
        }
    }
}

/// The second derivatives of all fields at a point.
struct Second<'a, M: Space>(&'a M::Point<f64>);

impl<M: Space> Gradient<M> for Second<'_, M> {
    type Covector = Jet2<M>;

    fn of(&mut self, f: &impl ScalarField<M>) -> Jet2<M> {
        f.jet2(self.0)
    }
}

/// The jets of all fields of a system at a point.
pub(super) fn second<Y: Metriplectic>(
    system: &Y,
    y: &Point<Y>,
) -> Covectors<CountOf<Y>, Jet2<Y::Manifold>> {
    let mut second = Second::<Y::Manifold>(y);
    let laws = [second.of(system.energy()), second.of(system.entropy())];
    Covectors::new(laws, system.invariants(), &mut second)
}
