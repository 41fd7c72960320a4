//! The derivative of a self-adjoint step along parameters of its fields.
//!
//! At fixed ends the residual `R = d − h V(z, w)` depends on `θ` through the discrete gradients `w_F` alone:
//!
//! ```math
//! \frac{\partial R}{\partial\theta} = -h \sum_F V_F\, \partial_\theta w_F , \qquad
//! \partial_\theta w_F = \partial_\theta dF(z)
//!   + \frac{\flat d}{G(d, d)} \bigl( \partial_\theta F(x') - \partial_\theta F(x) - \langle\partial_\theta dF(z), d\rangle \bigr) ,
//! ```
//!
//! with `V_F` the derivative of the velocity along a covector, and `∂x'/∂θ = −E A⁻¹ ∂R/∂θ`. So the equations have `n` unknowns and
//! `P` right-hand sides. The mixed derivatives `∂_θ dF` cost `nP` evaluations of a field in a tangent, and `P` in a
//! transposed step, where one direction of the state is enough.

use metriplectic_dynamics::system::Point;
use metriplectic_dynamics::velocity::{Covectors, Gradient};
use metriplectic_dynamics::{Differentiable, Metriplectic};
use metriplectic_fields::{Column as _, Dimension as _, Matrix, Real, ScalarField, Space, Vector};

use super::columns::Columns;
use super::error::Unlinearised;
use super::linearised::Propagated;
use super::part::Wide;
use super::schemes::{Both, Factored};
use crate::step::Dim;

/// The manifold of a wide system.
type Whole<D> = <Wide<D> as Metriplectic>::Manifold;

/// A system with parameters at the ends of a step.
struct Places<'a, D: Differentiable> {
    system: &'a D,
    ends: [&'a Point<D>; 2],
}

impl<D: Differentiable> Places<'_, D> {
    /// `∂_θF(x') − ∂_θF(x)`, in `⌈P/2⌉` evaluations at each end.
    fn difference(&self, f: &impl ScalarField<Whole<D>>) -> Vec<f64> {
        let (n, all) = (Dim::<D>::LEN, Dim::<Wide<D>>::LEN);
        let mut difference = vec![0.0; all - n];
        for (x, sign) in self.ends.into_iter().zip([-1.0, 1.0]) {
            let x = D::Manifold::constant::<Real>(x);
            for (k, pair) in difference.chunks_mut(2).enumerate() {
                let value = f.at_real(&self.system.seeded(x.clone(), [2 * k, 2 * k + 1]));
                for (entry, slope) in pair.iter_mut().zip([value.eps1, value.eps2]) {
                    *entry += sign * slope;
                }
            }
        }
        difference
    }
}

/// The sum over the fields of `V_F ∂_θ w_F`, one column a parameter.
struct Velocities<'a, D: Differentiable> {
    places: &'a Places<'a, D>,
    both: &'a Both<D>,
    /// `V_F`, and how far the derivative of its defect is trusted, field by field.
    along: std::vec::IntoIter<(Matrix<D::Manifold>, f64)>,
    columns: Vec<Vector<D::Manifold>>,
}

impl<D: Differentiable> Gradient<Whole<D>> for Velocities<'_, D> {
    type Covector = ();

    fn of(&mut self, f: &impl ScalarField<Whole<D>>) {
        let Some((along, trust)) = self.along.next() else { return };
        let (Places { system, .. }, Both { z, d, at, .. }) = (self.places, self.both);
        let (n, difference) = (Dim::<D>::LEN, self.places.difference(f));
        let seeded = D::Manifold::seeds(z);
        for (k, (column, difference)) in self.columns.iter_mut().zip(difference).enumerate() {
            let mixed = |i| f.at_real(&system.seeded(seeded(i, n), [usize::MAX, k])).eps1eps2;
            let mean = Vector::<D::Manifold>::from_index(mixed);
            let defect = trust * (difference - mean.dot(d));
            *column += along * (mean + at.correction * defect);
        }
    }
}

/// The sum over the fields of `⟨q_F, ∂_θ w_F⟩`, one number a parameter, with `q_F = V_Fᵀ r`.
struct Products<'a, D: Differentiable> {
    places: &'a Places<'a, D>,
    both: &'a Both<D>,
    /// `q_F`, and how far the derivative of its defect is trusted.
    along: std::vec::IntoIter<(Vector<D::Manifold>, f64)>,
    sums: Vec<f64>,
}

impl<D: Differentiable> Gradient<Whole<D>> for Products<'_, D> {
    type Covector = ();

    fn of(&mut self, f: &impl ScalarField<Whole<D>>) {
        let Some((q, trust)) = self.along.next() else { return };
        let (Places { system, .. }, Both { z, d, at, .. }) = (self.places, self.both);
        let share = trust * q.dot(&at.correction);
        let p = q - *d * share;
        let seed = Vector::<D::Manifold, Real>::from_index(|i| Real::new(0.0, p[i], 0.0, 0.0));
        let z = D::Manifold::chart(z, &seed);
        let difference = self.places.difference(f);
        for (k, (sum, difference)) in self.sums.iter_mut().zip(difference).enumerate() {
            let mixed = f.at_real(&system.seeded(z.clone(), [usize::MAX, k])).eps1eps2;
            *sum += mixed + share * difference;
        }
    }
}

/// The entries of all fields, in the order in which they are visited.
fn listed<D: Differentiable, T>(
    both: &Both<D>,
    entry: impl Fn(&Matrix<D::Manifold>, f64) -> T,
) -> Option<std::vec::IntoIter<T>> {
    let along = both.at.along.as_ref()?;
    let invariants = along.invariants.as_ref().iter().flatten().map(|(_, along)| along);
    let all = [&along.energy, &along.entropy].into_iter().chain(invariants);
    Some(all.map(|(v, trust)| entry(v, *trust)).collect::<Vec<_>>().into_iter())
}

/// Visits all fields of the wide system.
fn each_field<D: Differentiable>(
    system: &D,
    gradient: &mut impl Gradient<Whole<D>, Covector = ()>,
) {
    let wide = system.wide();
    let laws = [gradient.of(wide.energy()), gradient.of(wide.entropy())];
    Covectors::new(laws, wide.invariants(), gradient);
}

/// `∂x'/∂θ`, column by column, in the frame of the end.
pub(super) fn end_along_parameters<D: Differentiable>(
    system: &D,
    ends: [&Point<D>; 2],
    both: &Both<D>,
    a: &Factored<D>,
) -> Option<Vec<Vector<D::Manifold>>> {
    let count = Dim::<Wide<D>>::LEN - Dim::<D>::LEN;
    let places = Places { system, ends };
    let along = listed(both, |v, trust| (*v, trust))?;
    let columns = vec![Vector::<D::Manifold>::zero(); count];
    let mut velocities = Velocities { places: &places, both, along, columns };
    each_field(system, &mut velocities);
    let columns = velocities.columns.iter();
    columns.map(|column| both.end_along(a, &(*column * both.h))).collect()
}

/// The derivative of a loss along the start and the parameters of a step from that along its end.
pub(super) fn pulled_back<D: Differentiable>(
    system: &D,
    ends: [&Point<D>; 2],
    both: &Both<D>,
    costate: &Vector<Whole<D>>,
) -> Result<Vector<Whole<D>>, Unlinearised> {
    let (n, all) = (Dim::<D>::LEN, Dim::<Wide<D>>::LEN);
    let row = Vector::<D::Manifold>::from_index(|i| costate[i]);
    let [through, point] = both.pulled_back(ends[0], &row)?;
    let places = Places { system, ends };
    let along = listed(both, |v, trust| (transposed::<D>(v, &through), trust));
    let along = along.ok_or(Unlinearised::Singular)?;
    let mut products = Products { places: &places, both, along, sums: vec![0.0; all - n] };
    each_field(system, &mut products);
    let sums = products.sums;
    if sums.iter().any(|sum| !sum.is_finite()) {
        return Err(Unlinearised::NotSmooth);
    }
    Ok(Vector::<Whole<D>>::from_index(|i| {
        if i < n { point[i] } else { costate[i] + both.h * sums[i - n] }
    }))
}

fn transposed<D: Differentiable>(
    v: &Matrix<D::Manifold>,
    r: &Vector<D::Manifold>,
) -> Vector<D::Manifold> {
    metriplectic_fields::Square::transpose_times(v, r)
}

/// The tangent after a step with the derivatives `J = ∂x'/∂x` and `∂x'/∂θ`: the parameters stay where they are.
pub(super) fn with_parameters<D: Differentiable>(
    columns: &Columns<Wide<D>>,
    j: &Matrix<D::Manifold>,
    (along, along_h): (&[Vector<D::Manifold>], &Vector<D::Manifold>),
) -> Propagated<Wide<D>> {
    let (n, all) = (Dim::<D>::LEN, Dim::<Wide<D>>::LEN);
    let mut columns = columns.clone();
    for c in 0..all {
        let before = Vector::<D::Manifold>::from_index(|i| columns.t[(i, c)]);
        let mut after = *j * before;
        if let Some(along) = c.checked_sub(n).map(|k| &along[k]) {
            after += *along;
        }
        for i in 0..n {
            columns.t[(i, c)] = after[i];
        }
    }
    let along_h = Vector::<Whole<D>>::from_index(|i| if i < n { along_h[i] } else { 0.0 });
    Propagated { columns, along_h }
}
