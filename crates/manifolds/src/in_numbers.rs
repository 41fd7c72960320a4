//! Points, vectors and the paths of steps in plain numbers.

use std::marker::PhantomData;

use metriplectic_equations::room::with_numbers;
use metriplectic_equations::{MetricError, Path, PathAt, PathSlopes, Paths};
use metriplectic_fields::stack::with_room;
use metriplectic_fields::{Column, Dimension, Matrix, Real, Square, Vector};
use num_dual::Dual64;
use smallvec::SmallVec;

use crate::chart_midpoint::reached;
use crate::{
    ChartMidpoint, Exponential, Manifold, Retraction, Riemannian, StepPath, StepPathJet,
    WeylMidpoint,
};

/// Reads a point from its entries.
#[inline]
pub fn point<M: Manifold>(x: &[f64]) -> M::Point<f64> {
    let mut entries = x.iter();
    M::assemble(&mut || *entries.next().expect("a state has all of its entries"))
}

/// Writes the entries of a point.
#[inline]
pub fn write<M: Manifold>(x: &M::Point<f64>, to: &mut [f64]) {
    let mut to = to.iter_mut();
    M::write(x, &mut |entry| *to.next().expect("a slice has the entries of a state") = entry);
}

/// Calls `f` with the entries of a point, without an allocation where they are few.
pub fn with_entries<M: Manifold, T>(x: &M::Point<f64>, f: impl FnOnce(&[f64]) -> T) -> T {
    let mut entries = 0;
    M::write(x, &mut |_| entries += 1);
    with_numbers(entries, |to| {
        write::<M>(x, to);
        f(to)
    })
}

/// Reads a column.
#[inline]
pub fn column<V: Column<f64>>(numbers: &[f64]) -> V {
    let numbers = &numbers[..V::LEN];
    V::from_index(|i| numbers[i])
}

/// Writes a column.
#[inline]
pub fn put<V: Column<f64>>(v: &V, to: &mut [f64]) {
    let to = &mut to[..V::LEN];
    (0..V::LEN).for_each(|i| to[i] = v[i]);
}

/// Writes a matrix row by row.
pub fn put_matrix<A: Square<f64>>(a: &A, to: &mut [f64]) {
    let n = A::Column::LEN;
    for (i, row) in to.chunks_exact_mut(n).enumerate() {
        (0..n).for_each(|j| row[j] = a[(i, j)]);
    }
}

/// Writes a path.
fn put_path<M: Manifold>(
    z: &M::Point<f64>,
    d: &Vector<M>,
    end: &M::Point<f64>,
    to: &mut PathAt<'_>,
) {
    write::<M>(z, to.z);
    put(d, to.d);
    write::<M>(end, to.end);
}

/// Writes a path with its derivatives.
fn put_jet<M: Manifold>(
    jet: &StepPathJet<M>,
    (to, slopes): (&mut PathAt<'_>, &mut PathSlopes<'_>),
) {
    let StepPathJet { z, dz, d, dd, end, dend } = jet;
    put_path::<M>(z, d, end, to);
    put_matrix(dz, slopes.dz);
    put_matrix(dd, slopes.dd);
    put_matrix(dend, slopes.dend);
}

/// Writes a point of a curve with its velocity and its acceleration.
fn put_curve<M: Manifold>(at: &M::Point<Real>, y: &mut [f64], [v, a]: [&mut [f64]; 2]) {
    let here = M::real(at);
    let q = M::coordinates(&here, at);
    write::<M>(&here, y);
    put(&Vector::<M>::from_index(|i| q[i].eps1), v);
    put(&Vector::<M>::from_index(|i| q[i].eps1eps2), a);
}

/// Refuses a line whose end is not finite.
fn ends<M: Manifold>(end: &M::Point<f64>) -> Result<(), MetricError> {
    let mut value = 0.0;
    M::write(end, &mut |entry| value += 0.0 * entry);
    let quantity = "a coordinate of the end";
    if value == 0.0 { Ok(()) } else { Err(MetricError::NotFinite { quantity, value }) }
}

/// The straight lines of the charts of a manifold without a metric, of which a path may have its base at the start.
#[derive(Debug)]
pub struct LinesInNumbers<M>(PhantomData<M>);

impl<M> Default for LinesInNumbers<M> {
    fn default() -> Self {
        Self(PhantomData)
    }
}

impl<M: Manifold> Paths for LinesInNumbers<M> {
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
        let (x, u) = (point::<M>(x), column(u));
        reached::<M>(&u)?;
        let StepPath { z, d, end } = M::line(&x, &u);
        ends::<M>(&end)?;
        match path {
            Path::Exponential => put_path::<M>(&x, &u, &end, to),
            Path::Weyl | Path::Chart => put_path::<M>(&z.base, &d, &end, to),
        }
        Ok(())
    }

    fn path_jet(
        &self,
        path: Path,
        x: &[f64],
        u: &[f64],
        to: (&mut PathAt<'_>, &mut PathSlopes<'_>),
    ) -> Result<(), MetricError> {
        let (x, u) = (point::<M>(x), column(u));
        reached::<M>(&u)?;
        let mut jet = M::line_jet(&x, &u);
        ends::<M>(&jet.end)?;
        if path == Path::Exponential {
            (jet.z, jet.d) = (x, u);
            (jet.dz, jet.dd) = (Matrix::<M>::zeros(), Matrix::<M>::one());
        }
        put_jet::<M>(&jet, to);
        Ok(())
    }

    fn curve(
        &self,
        _: Path,
        (x, u, t): (&[f64], &[f64], f64),
        y: &mut [f64],
        to: [&mut [f64]; 2],
    ) -> Result<(), MetricError> {
        let u = column(u);
        reached::<M>(&u)?;
        let at = M::line_at(&point::<M>(x), &u, t);
        ends::<M>(&M::real(&at))?;
        put_curve::<M>(&at, y, to);
        Ok(())
    }

    fn lost_digits(&self, _: Path, x: &[f64], u: &[f64], end: &[f64], lost: &mut [f64]) {
        put(&M::lost_digits(&point::<M>(x), &column(u), &point::<M>(end)), lost);
    }

    fn velocity_at(&self, y: &[f64], x: &[f64], q: &[f64], v: &[f64], to: &mut [f64]) {
        let (q, v) = (column::<Vector<M>>(q), column::<Vector<M>>(v));
        let moved = Vector::<M, Dual64>::from_index(|i| Dual64::new(q[i], v[i]));
        let there = M::coordinates(&point::<M>(y), &M::chart(&point::<M>(x), &moved));
        put(&Vector::<M>::from_index(|i| there[i].eps), to);
    }

    fn transport(&self, x: &[f64], y: &[f64], vectors: &mut [f64]) {
        let n = <M::Dim as Dimension>::LEN;
        let mut all: SmallVec<[Vector<M>; 8]> = vectors.chunks_exact(n).map(column).collect();
        M::transport_all(&point::<M>(x), &point::<M>(y), &mut all);
        vectors.chunks_exact_mut(n).zip(&all).for_each(|(to, v)| put(v, to));
    }

    fn pairing_size(&self, w: &[f64], v: &[f64]) -> f64 {
        M::pairing_size(&column(w), &column(v))
    }
}

/// The paths of the steps on a manifold with a metric, by the retractions of this library.
#[derive(Debug)]
pub struct PathsInNumbers<'a, M, G> {
    metric: &'a G,
    manifold: PhantomData<M>,
}

impl<'a, M, G> PathsInNumbers<'a, M, G> {
    /// Makes those of a metric.
    pub const fn new(metric: &'a G) -> Self {
        Self { metric, manifold: PhantomData }
    }

    /// Follows the curve of a path for a fraction of its way, with its first and second derivative.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if it cannot be followed.
    pub fn at_time(
        &self,
        path: Path,
        (x, u, t): (&[f64], &[f64], f64),
    ) -> Result<M::Point<Real>, MetricError>
    where
        M: Manifold,
        G: Riemannian<M>,
    {
        let (x, u) = (point::<M>(x), column(u));
        match path {
            Path::Chart => Ok(M::line_at(&x, &u, t)),
            Path::Exponential | Path::Weyl => self.metric.along(&x, &u, t),
        }
    }
}

/// Calls a function with a retraction.
macro_rules! by_retraction {
    ($path:expr, $retraction:ident => $of:expr) => {
        match $path {
            Path::Exponential => {
                let $retraction = &Exponential;
                $of
            }
            Path::Weyl => {
                let $retraction = &WeylMidpoint;
                $of
            }
            Path::Chart => {
                let $retraction = &ChartMidpoint;
                $of
            }
        }
    };
}

impl<M: Manifold, G: Riemannian<M>> Paths for PathsInNumbers<'_, M, G> {
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
        let (metric, x, u) = (self.metric, &point::<M>(x), &column(u));
        let StepPath { z, d, end } = by_retraction!(path, by => by.real_step_path(metric, x, u))?;
        put_path::<M>(&z.base, &d, &end, to);
        Ok(())
    }

    fn end(&self, path: Path, x: &[f64], u: &[f64], end: &mut [f64]) -> Result<(), MetricError> {
        let (metric, x, u) = (self.metric, &point::<M>(x), &column(u));
        write::<M>(&by_retraction!(path, by => by.end(metric, x, u))?, end);
        Ok(())
    }

    fn path_jet(
        &self,
        path: Path,
        x: &[f64],
        u: &[f64],
        to: (&mut PathAt<'_>, &mut PathSlopes<'_>),
    ) -> Result<(), MetricError> {
        with_room::<M::Dim, _>(|| {
            let (metric, x, u) = (self.metric, &point::<M>(x), &column(u));
            let jet = by_retraction!(path, by => by.step_path_jet(metric, x, u))?;
            put_jet::<M>(&jet, to);
            Ok(())
        })
    }

    fn curve(
        &self,
        path: Path,
        start: (&[f64], &[f64], f64),
        y: &mut [f64],
        to: [&mut [f64]; 2],
    ) -> Result<(), MetricError> {
        let at = self.at_time(path, start)?;
        put_curve::<M>(&at, y, to);
        Ok(())
    }

    fn lost_digits(&self, path: Path, x: &[f64], u: &[f64], end: &[f64], lost: &mut [f64]) {
        let (metric, [x, end]) = (self.metric, [x, end].map(point::<M>));
        let u = &column(u);
        put(&by_retraction!(path, by => by.lost_digits(metric, &x, u, &end)), lost);
    }

    fn accuracy(&self, path: Path) -> f64 {
        by_retraction!(path, by => by.accuracy(self.metric))
    }

    fn velocity_at(&self, y: &[f64], x: &[f64], q: &[f64], v: &[f64], to: &mut [f64]) {
        LinesInNumbers::<M>::default().velocity_at(y, x, q, v, to);
    }

    fn transport(&self, x: &[f64], y: &[f64], vectors: &mut [f64]) {
        LinesInNumbers::<M>::default().transport(x, y, vectors);
    }

    fn pairing_size(&self, w: &[f64], v: &[f64]) -> f64 {
        LinesInNumbers::<M>::default().pairing_size(w, v)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Euclidean, HalfLine};

    /// The chart of a half line is an exponential, which overflows; on a vector space a sum does.
    #[test]
    fn a_line_whose_end_is_not_finite_is_refused() {
        fn refuses<M: Manifold>(name: &str, x: f64, u: f64, is_refused: bool) {
            let lines = LinesInNumbers::<M>::default();
            let [mut z, mut d, mut end, mut dz, mut dd, mut dend] = [[0.0]; 6];
            let to = &mut PathAt { z: &mut z, d: &mut d, end: &mut end };
            let alone = lines.path(Path::Chart, &[x], &[u], to).is_err();
            let slopes = &mut PathSlopes { dz: &mut dz, dd: &mut dd, dend: &mut dend };
            let jet = lines.path_jet(Path::Chart, &[x], &[u], (to, slopes)).is_err();
            let ended = lines.end(Path::Chart, &[x], &[u], &mut [0.0]).is_err();
            let start = (&[x][..], &[u][..], 1.0);
            let curve = lines.curve(Path::Chart, start, &mut [0.0], [&mut [0.0], &mut [0.0]]);
            assert_eq!([alone, jet, ended, curve.is_err()], [is_refused; 4], "{name}: {u}");
        }
        refuses::<HalfLine>("a half line", 1.0, 300.0, false);
        refuses::<HalfLine>("a half line", 1.0, 1e3, true);
        refuses::<Euclidean<1>>("a line", 1e308, 1e307, false);
        refuses::<Euclidean<1>>("a line", 1e308, 1e308, true);
        refuses::<Euclidean<1>>("a line", 1.0, f64::NAN, true);
    }
}
