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
use crate::round_off::stable_gradient::but_round_off;
use crate::step::Dim;

/// The manifold of a wide system.
type Whole<D> = <Wide<D> as Metriplectic>::Manifold;

/// A system with parameters at the ends of a step.
struct Places<'a, D: Differentiable> {
    system: &'a D,
    ends: [&'a Point<D>; 2],
}

impl<D: Differentiable> Places<'_, D> {
    /// `∂_θF(x')` and `∂_θF(x)`, in `⌈P/2⌉` evaluations at each end.
    fn at_ends(&self, f: &impl ScalarField<Whole<D>>) -> Vec<[f64; 2]> {
        let (n, all) = (Dim::<D>::LEN, Dim::<Wide<D>>::LEN);
        let mut slopes = vec![[0.0; 2]; all - n];
        for (x, which) in self.ends.into_iter().zip([1, 0]) {
            let x = D::Manifold::constant::<Real>(x);
            for (k, pair) in slopes.chunks_mut(2).enumerate() {
                let value = f.at_real(&self.system.seeded(x.clone(), [2 * k, 2 * k + 1]));
                for (slopes, slope) in pair.iter_mut().zip([value.eps1, value.eps2]) {
                    slopes[which] = slope;
                }
            }
        }
        slopes
    }
}

/// The defect `F(x') − F(x) − ⟨w̄, d⟩` of a derivative of a field, or zero where it is round-off.
fn defect([end, start]: [f64; 2], slope: f64) -> f64 {
    but_round_off(end - start - slope, end.abs() + start.abs())
}

/// The sum over the fields of `V_F ∂_θ w_F`, one column a parameter.
struct Velocities<'a, D: Differentiable> {
    places: &'a Places<'a, D>,
    both: &'a Both<D>,
    /// `V_F`, and whether differences of `F` lose digits, field by field; `None` where `w_F` is a differential.
    along: std::vec::IntoIter<(Matrix<D::Manifold>, Option<bool>)>,
    columns: Vec<Vector<D::Manifold>>,
}

impl<D: Differentiable> Gradient<Whole<D>> for Velocities<'_, D> {
    type Covector = ();

    fn of(&mut self, f: &impl ScalarField<Whole<D>>) {
        let Some((along, is_short)) = self.along.next() else { return };
        let (Places { system, .. }, Both { z, d, at, .. }) = (self.places, self.both);
        let (n, ends) = (Dim::<D>::LEN, self.places.at_ends(f));
        let seeded = D::Manifold::seeds(z);
        for (k, (column, ends)) in self.columns.iter_mut().zip(ends).enumerate() {
            let mixed = |i| f.at_real(&system.seeded(seeded(i, n), [usize::MAX, k])).eps1eps2;
            let mean = Vector::<D::Manifold>::from_index(mixed);
            let defect = if is_short.is_some() { defect(ends, mean.dot(d)) } else { 0.0 };
            *column += along * (mean + at.correction * defect);
        }
    }
}

/// The sum over the fields of `⟨q_F, ∂_θ w_F⟩`, one number a parameter, with `q_F = V_Fᵀ r`.
struct Products<'a, D: Differentiable> {
    places: &'a Places<'a, D>,
    both: &'a Both<D>,
    /// `q_F`, and whether differences of `F` lose digits; `None` where `w_F` is a differential.
    along: std::vec::IntoIter<(Vector<D::Manifold>, Option<bool>)>,
    sums: Vec<f64>,
}

impl<D: Differentiable> Gradient<Whole<D>> for Products<'_, D> {
    type Covector = ();

    fn of(&mut self, f: &impl ScalarField<Whole<D>>) {
        let Some((q, is_short)) = self.along.next() else { return };
        let (Places { system, .. }, Both { z, d, at, .. }) = (self.places, self.both);
        let along = |p: &Vector<D::Manifold>| {
            let seed = Vector::<D::Manifold, Real>::from_index(|i| Real::new(0.0, p[i], 0.0, 0.0));
            let z = D::Manifold::chart(z, &seed);
            move |k| f.at_real(&system.seeded(z.clone(), [usize::MAX, k])).eps1eps2
        };
        let share = if is_short.is_some() { q.dot(&at.correction) } else { 0.0 };
        let sums = self.sums.iter_mut().zip(self.places.at_ends(f)).enumerate();
        if is_short == Some(true) {
            // The defect alone, since it may be round-off.
            let (along_q, along_d) = (along(&q), along(d));
            for (k, (sum, ends)) in sums {
                *sum += along_q(k) + share * defect(ends, along_d(k));
            }
            return;
        }
        let along_p = along(&(q - *d * share));
        for (k, (sum, [end, start])) in sums {
            *sum += along_p(k) + share * (end - start);
        }
    }
}

/// The entries of all fields, in the order in which they are visited.
fn listed<D: Differentiable, T>(
    both: &Both<D>,
    entry: impl Fn(&Matrix<D::Manifold>, Option<bool>) -> T,
) -> Option<std::vec::IntoIter<T>> {
    let along = both.at.along.as_ref()?;
    let invariants = along.invariants.as_ref().iter().flatten().map(|(_, along)| along);
    let all = [&along.energy, &along.entropy].into_iter().chain(invariants);
    Some(all.map(|(v, is_short)| entry(v, *is_short)).collect::<Vec<_>>().into_iter())
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
    let along = listed(both, |v, is_short| (*v, is_short))?;
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
    let along = listed(both, |v, is_short| (transposed::<D>(v, &through), is_short));
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
