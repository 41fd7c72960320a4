//! Vectors of a point and two covectors, at every scalar.

use metriplectic_fields::{ChartPoint, Column, Dimension, Real, Scalar, Vector};
use metriplectic_manifolds::{Manifold, MetricError};

/// The arguments of a vector: a point in a chart, and the covectors of energy and entropy there.
pub(super) struct Arguments<'a, M: Manifold, D: Scalar> {
    pub(super) x: &'a ChartPoint<M, D>,
    pub(super) w: &'a Vector<M, D>,
    pub(super) s: &'a Vector<M, D>,
}

/// The arguments at the scalar of closures.
pub(super) type Seeded<M> = (ChartPoint<M, Real>, Vector<M, Real>, Vector<M, Real>);

impl<M: Manifold, D: Scalar> Arguments<'_, M, D> {
    /// The real parts, with `ε₁` and `ε₂` in the directions `i` and `j`: those of the chart, of `w`, and of `s`. An index
    /// beyond them seeds nothing.
    pub(super) fn seeded(&self, i: usize, j: usize) -> Seeded<M> {
        let n = M::Dim::LEN;
        let seed = |value: D, k: usize| {
            let part = |direction| if k == direction { 1.0 } else { 0.0 };
            Real::new(value.re(), part(i), part(j), 0.0)
        };
        let column = |v: &Vector<M, D>, first: usize| {
            Vector::<M, Real>::from_index(|k| seed(v[k], first + k))
        };
        let q = column(&self.x.q, 0);
        let x = ChartPoint { base: self.x.base.clone(), q };
        (x, column(self.w, n), column(self.s, 2 * n))
    }

    /// The vector `f(x, w, s)` at any scalar of order ≤ 2, by its Taylor expansion about the real parts, as for the
    /// [closures](mod@metriplectic_fields::closure) of one point.
    pub(super) fn lift(
        &self,
        f: impl Fn(&Seeded<M>) -> Result<Vector<M, Real>, MetricError>,
    ) -> Result<Vector<M, D>, MetricError> {
        const {
            assert!(
                D::NDERIV <= 2,
                "a closure has derivatives up to order 2, and this scalar asks for more"
            );
        }
        let n = M::Dim::LEN;
        let d = |i: usize| {
            let value = match i / n {
                0 => self.x.q[i],
                1 => self.w[i - n],
                _ => self.s[i - 2 * n],
            };
            value - value.re()
        };
        let mut sum = Vector::<M, D>::zero();
        let mut add = |i: usize, j: usize, part: &dyn Fn(&Real) -> D| {
            let v = f(&self.seeded(i, j))?;
            sum += Vector::<M, D>::from_index(|k| part(&v[k]));
            Ok::<(), MetricError>(())
        };
        if const { D::NDERIV == 0 } {
            add(3 * n, 3 * n, &|a| D::from(a.re))?;
            return Ok(sum);
        }
        let value = |i: usize, re: f64| D::from(if i == 0 { re } else { 0.0 });
        for i in 0..3 * n {
            if const { D::NDERIV == 1 } {
                add(i, 3 * n, &|a| d(i) * a.eps1 + value(i, a.re))?;
                continue;
            }
            add(i, i, &|a| d(i) * a.eps1 + d(i) * d(i) * (a.eps1eps2 * 0.5) + value(i, a.re))?;
            for j in i + 1..3 * n {
                add(i, j, &|a| d(i) * d(j) * a.eps1eps2)?;
            }
        }
        Ok(sum)
    }
}
