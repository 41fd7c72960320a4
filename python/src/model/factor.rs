//! The factors of a space: flat spaces of any number of entries, and the curved spaces of the library.

use std::fmt::Debug;

use metriplectic_equations::room::with_numbers;
use metriplectic_equations::{MetricError, Path, PathAt, PathSlopes, Paths, PointError};
use metriplectic_fields::{
    ChartPoint, Column as _, Dimension as _, Factors as _, Matrix, Real, Square as _, Vector,
    Velocity,
};
use metriplectic_manifolds::in_numbers::{PathsInNumbers, column, point, put, put_matrix, write};
use metriplectic_manifolds::{Canonical, Manifold, Riemannian};
use metriplectic_recording::PointEntries;

/// A factor of a space, in plain numbers. Its metric is the canonical one, in which the frame of each chart is orthonormal.
///
/// Slices have as many numbers as there are [`entries`](Self::entries), [`directions`](Self::directions) or
/// [`velocities`](Self::velocities) of the factor. Matrices are row by row.
pub(super) trait Factor: Debug + Send + Sync {
    /// The numbers of a point.
    fn entries(&self) -> usize;

    /// The directions `n` of a chart.
    fn directions(&self) -> usize;

    /// The numbers of a velocity as it is written by hand, on which recorded tensors act: `n` on a flat space, the entries of `x'` on a
    /// sphere, the body angular velocity on SO(3).
    fn velocities(&self) -> usize;

    /// Returns whether the chart is `φ_x(q) = x + q`.
    fn is_flat(&self) -> bool {
        false
    }

    /// Checks that the entries are a point.
    fn check(&self, x: &[f64]) -> Result<(), PointError>;

    /// Measures how far a point is off the space.
    fn defect(&self, x: &[f64]) -> f64;

    /// Returns the sizes of the coordinates.
    fn scales(&self, x: &[f64], sizes: &mut [f64]);

    /// Computes `φ_x(q)`.
    fn chart(&self, x: &[f64], q: &[f64], y: &mut [f64]);

    /// Computes `φ_x⁻¹(y)`, and returns whether `y` is well inside the chart.
    fn coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) -> bool;

    /// Computes `ψ_x(q)`; returns `false` beyond the edge of this chart or of the domain.
    fn stage_state(&self, x: &[f64], q: &[f64], y: &mut [f64]) -> bool;

    /// Computes `ψ_x⁻¹(y)`.
    fn stage_coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]);

    /// Computes the rates at `y = ψ_x(q)` of the velocity `v` there.
    fn stage_rates(&self, x: &[f64], q: &[f64], y: &[f64], v: &[f64], rates: &mut [f64]);

    /// Computes `φ_x(q)` with derivatives.
    fn moved(&self, x: &[f64], q: &[Real], y: &mut [Real]);

    /// Computes the differential `Σ_e w_e ∂x_e/∂qⁱ` in the chart at `x` of a function with the slopes `w` by the entries.
    fn pull_back(&self, x: &[f64], w: &[f64], df: &mut [f64]);

    /// Computes `Σ_e w_e ∂²x_e/∂qⁱ∂qʲ` in the chart at `x`.
    fn bend(&self, x: &[f64], w: &[f64], hf: &mut [f64]);

    /// Computes the matrix `θ⁺ = (θᵀθ)⁻¹θᵀ` at `φ_x(q)`, of a row for each direction and a column for each number of a velocity: it
    /// takes a velocity to its components in the frame of the chart at `x`. Returns `false` where the chart has no frame.
    fn coframe(&self, x: &[f64], q: &[Real], to: &mut [Real]) -> bool;

    /// The paths of steps.
    fn paths(&self) -> &dyn Paths;
}

/// A flat space, Rⁿ or the dual of a Lie algebra: `φ_x(q) = x + q`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flat(pub(super) usize);

impl Factor for Flat {
    fn entries(&self) -> usize {
        self.0
    }

    fn directions(&self) -> usize {
        self.0
    }

    fn velocities(&self) -> usize {
        self.0
    }

    fn is_flat(&self) -> bool {
        true
    }

    fn check(&self, x: &[f64]) -> Result<(), PointError> {
        let bad = x.iter().position(|entry| !entry.is_finite());
        bad.map_or(Ok(()), |index| Err(PointError::NotFinite { index, value: x[index] }))
    }

    fn defect(&self, x: &[f64]) -> f64 {
        x.iter().fold(0.0, |sum, entry| sum + 0.0 * entry)
    }

    fn scales(&self, x: &[f64], sizes: &mut [f64]) {
        sizes.iter_mut().zip(x).for_each(|(size, x)| *size = x.abs());
    }

    fn chart(&self, x: &[f64], q: &[f64], y: &mut [f64]) {
        y.iter_mut().zip(x).zip(q).for_each(|((y, x), q)| *y = x + q);
    }

    fn coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) -> bool {
        q.iter_mut().zip(x).zip(y).for_each(|((q, x), y)| *q = y - x);
        q.iter().all(|q| q.is_finite())
    }

    fn stage_state(&self, x: &[f64], q: &[f64], y: &mut [f64]) -> bool {
        self.chart(x, q, y);
        y.iter().all(|y| y.is_finite())
    }

    fn stage_coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) {
        let _ = self.coordinates(x, y, q);
    }

    fn stage_rates(&self, _: &[f64], _: &[f64], _: &[f64], v: &[f64], rates: &mut [f64]) {
        rates.copy_from_slice(v);
    }

    fn moved(&self, x: &[f64], q: &[Real], y: &mut [Real]) {
        y.iter_mut().zip(x).zip(q).for_each(|((y, x), q)| *y = *q + *x);
    }

    fn pull_back(&self, _: &[f64], w: &[f64], df: &mut [f64]) {
        df.copy_from_slice(w);
    }

    fn bend(&self, _: &[f64], _: &[f64], hf: &mut [f64]) {
        hf.fill(0.0);
    }

    fn coframe(&self, _: &[f64], _: &[Real], to: &mut [Real]) -> bool {
        let n = self.0;
        (0..n * n).for_each(|k| to[k] = Real::from(if k % (n + 1) == 0 { 1.0 } else { 0.0 }));
        true
    }

    fn paths(&self) -> &dyn Paths {
        self
    }
}

/// Refuses a displacement that does not end at a point.
fn finite(end: &[f64]) -> Result<(), MetricError> {
    let quantity = "a coordinate of the end";
    let bad = end.iter().find(|end| !end.is_finite());
    bad.map_or(Ok(()), |&value| Err(MetricError::NotFinite { quantity, value }))
}

/// Writes a multiple of the identity.
fn scaled_identity(n: usize, scale: f64, to: &mut [f64]) {
    to.fill(0.0);
    (0..n).for_each(|i| to[i * n + i] = scale);
}

/// Straight lines.
impl Paths for Flat {
    fn follows(&self, _: Path) -> bool {
        true
    }

    fn path(
        &self,
        path: Path,
        x: &[f64],
        u: &[f64],
        to: &mut PathAt<'_>,
    ) -> Result<(), MetricError> {
        let base = path.base();
        to.z.iter_mut().zip(x).zip(u).for_each(|((z, x), u)| *z = x + base * u);
        to.d.copy_from_slice(u);
        self.chart(x, u, to.end);
        finite(to.end)
    }

    fn path_jet(
        &self,
        path: Path,
        x: &[f64],
        u: &[f64],
        (to, slopes): (&mut PathAt<'_>, &mut PathSlopes<'_>),
    ) -> Result<(), MetricError> {
        scaled_identity(self.0, path.base(), slopes.dz);
        scaled_identity(self.0, 1.0, slopes.dd);
        scaled_identity(self.0, 1.0, slopes.dend);
        self.path(path, x, u, to)
    }

    fn curve(
        &self,
        _: Path,
        (x, u, t): (&[f64], &[f64], f64),
        y: &mut [f64],
        [v, a]: [&mut [f64]; 2],
    ) -> Result<(), MetricError> {
        y.iter_mut().zip(x).zip(u).for_each(|((y, x), u)| *y = x + t * u);
        v.copy_from_slice(u);
        a.fill(0.0);
        finite(y)
    }

    fn lost_digits(&self, _: Path, x: &[f64], u: &[f64], end: &[f64], lost: &mut [f64]) {
        (0..lost.len()).for_each(|i| lost[i] = u[i] - (end[i] - x[i]));
    }

    fn accuracy(&self, _: Path) -> f64 {
        0.0
    }

    fn velocity_at(&self, _: &[f64], _: &[f64], _: &[f64], v: &[f64], to: &mut [f64]) {
        to.copy_from_slice(v);
    }

    fn pairing_size(&self, w: &[f64], v: &[f64]) -> f64 {
        w.iter().zip(v).map(|(w, v)| (w * v).abs()).sum()
    }
}

/// A space of the library with its canonical metric.
#[derive(Debug)]
pub(super) struct Typed<M: Manifold> {
    space: M,
    paths: PathsInNumbers<'static, M, Canonical>,
}

impl<M: Manifold> Typed<M> {
    /// Makes a factor of a space.
    pub(super) const fn new(space: M) -> Self {
        Self { space, paths: PathsInNumbers::new(&Canonical) }
    }
}

/// Calls a function with a column of the library that is read from a slice.
fn read<M: Manifold>(q: &[Real]) -> Vector<M, Real> {
    Vector::<M, Real>::from_index(|i| q[i])
}

impl<M: PointEntries> Factor for Typed<M>
where
    Canonical: Riemannian<M>,
{
    fn entries(&self) -> usize {
        M::COUNT
    }

    fn directions(&self) -> usize {
        M::Dim::LEN
    }

    fn velocities(&self) -> usize {
        M::Velocity::LEN
    }

    fn check(&self, x: &[f64]) -> Result<(), PointError> {
        self.space.check(&point::<M>(x))
    }

    fn defect(&self, x: &[f64]) -> f64 {
        self.space.defect(&point::<M>(x))
    }

    fn scales(&self, x: &[f64], sizes: &mut [f64]) {
        put(&M::scales(&point::<M>(x)), sizes);
    }

    fn chart(&self, x: &[f64], q: &[f64], y: &mut [f64]) {
        write::<M>(&M::chart(&point::<M>(x), &column(q)), y);
    }

    fn coordinates(&self, x: &[f64], y: &[f64], to: &mut [f64]) -> bool {
        let q: Vector<M> = M::coordinates(&point::<M>(x), &point::<M>(y));
        put(&q, to);
        q.is_finite() && M::is_near(&q)
    }

    fn stage_state(&self, x: &[f64], q: &[f64], y: &mut [f64]) -> bool {
        let q = column(q);
        if !M::is_stage(&q) {
            return false;
        }
        let state = M::stage(&point::<M>(x), &q);
        write::<M>(&state, y);
        self.space.is_inside(&state) && y.iter().all(|y| y.is_finite())
    }

    fn stage_coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) {
        put(&M::stage_coordinates(&point::<M>(x), &point::<M>(y)), q);
    }

    fn stage_rates(&self, x: &[f64], q: &[f64], y: &[f64], v: &[f64], rates: &mut [f64]) {
        let (x, y) = (point::<M>(x), point::<M>(y));
        put(&M::stage_rates(&x, (&column(q), &y), &column(v)), rates);
    }

    fn moved(&self, x: &[f64], q: &[Real], y: &mut [Real]) {
        let mut to = y.iter_mut();
        M::list(&M::chart(&point::<M>(x), &read::<M>(q)), &mut |entry| {
            if let Some(to) = to.next() {
                *to = entry;
            }
        });
    }

    fn pull_back(&self, x: &[f64], w: &[f64], df: &mut [f64]) {
        put(&M::pull_back(&point::<M>(x), w), df);
    }

    fn bend(&self, x: &[f64], w: &[f64], hf: &mut [f64]) {
        put_matrix(&M::bend(&point::<M>(x), w), hf);
    }

    fn coframe(&self, x: &[f64], q: &[Real], to: &mut [Real]) -> bool {
        let (n, columns) = (M::Dim::LEN, M::Velocity::LEN);
        let at = ChartPoint::<M, Real> { base: point::<M>(x), q: read::<M>(q) };
        let theta = M::Dim::array(|k| M::embed(&at, &Vector::<M, Real>::basis(k)));
        let gram = Matrix::<M, Real>::from_entries(|i, j| theta[i].dot(&theta[j]));
        let Some(factors) = gram.factor() else { return false };
        for k in 0..n {
            // The matrix θᵀθ is symmetric: the row k of its inverse is a column.
            let Some(weights) = factors.solve(&Vector::<M, Real>::basis(k)) else { return false };
            let mut sum = Velocity::<M, Real>::zero();
            (0..n).for_each(|j| sum += theta[j] * weights[j]);
            (0..columns).for_each(|e| to[k * columns + e] = sum[e]);
        }
        true
    }

    fn paths(&self) -> &dyn Paths {
        &self.paths
    }
}

/// Computes the derivative of `φ_x⁻¹ ∘ φ_y` at zero, one column after another: the frame at `y` seen from the chart at `x`.
pub(super) fn frame_seen_from(factor: &dyn Factor, x: &[f64], y: &[f64], columns: &mut [f64]) {
    let n = factor.directions();
    if factor.is_flat() {
        return scaled_identity(n, 1.0, columns);
    }
    with_numbers(n, |still| factor.paths().turn_all(x, y, still, columns));
}
