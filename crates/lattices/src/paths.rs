//! The paths of steps of a lattice in plain numbers: straight lines of the charts at its sites.

use metriplectic_equations::{MetricError, Path, PathAt, PathSlopes, Paths};
use metriplectic_manifolds::in_numbers::LinesInNumbers;

use crate::dense::Dense;
use crate::lattice::dimension;
use crate::model::Model;

impl<P: Model> Dense<'_, P> {
    fn on_site(&self) -> LinesInNumbers<P::Manifold> {
        LinesInNumbers::default()
    }

    /// Calls `f` with the entries and the directions of each site, as ranges.
    fn try_sites<E>(
        &self,
        entries: usize,
        mut f: impl FnMut([std::ops::Range<usize>; 2]) -> Result<(), E>,
    ) -> Result<(), E> {
        let (sites, n) = (self.0.sites(), dimension::<P>());
        let length = entries / sites.max(1);
        (0..sites).try_for_each(|site| {
            let range = |length: usize| site * length..(site + 1) * length;
            f([range(length), range(n)])
        })
    }

    fn each_site(&self, entries: usize, mut f: impl FnMut([std::ops::Range<usize>; 2])) {
        let _ = self.try_sites::<()>(entries, |ranges| {
            f(ranges);
            Ok(())
        });
    }
}

impl<P: Model> Paths for Dense<'_, P> {
    fn follows(&self, path: Path) -> bool {
        self.on_site().follows(path)
    }

    fn path(
        &self,
        path: Path,
        x: &[f64],
        u: &[f64],
        to: &mut PathAt<'_>,
    ) -> Result<(), MetricError> {
        self.try_sites(x.len(), |[e, q]| {
            let PathAt { z, d, end } = to;
            let to = &mut PathAt {
                z: &mut z[e.clone()],
                d: &mut d[q.clone()],
                end: &mut end[e.clone()],
            };
            self.on_site().path(path, &x[e], &u[q], to)
        })
    }

    fn path_jet(
        &self,
        path: Path,
        x: &[f64],
        u: &[f64],
        (to, slopes): (&mut PathAt<'_>, &mut PathSlopes<'_>),
    ) -> Result<(), MetricError> {
        let (n, all) = (dimension::<P>(), u.len());
        let mut blocks = vec![0.0; 3 * n * n];
        [&mut *slopes.dz, &mut *slopes.dd, &mut *slopes.dend].into_iter().for_each(|a| a.fill(0.0));
        self.try_sites(x.len(), |[e, q]| {
            let (dz, rest) = blocks.split_at_mut(n * n);
            let (dd, dend) = rest.split_at_mut(n * n);
            let PathAt { z, d, end } = to;
            let to = &mut PathAt {
                z: &mut z[e.clone()],
                d: &mut d[q.clone()],
                end: &mut end[e.clone()],
            };
            let own = &mut PathSlopes { dz, dd, dend };
            self.on_site().path_jet(path, &x[e], &u[q.clone()], (to, own))?;
            let matrices = [&mut *slopes.dz, &mut *slopes.dd, &mut *slopes.dend];
            for (matrix, block) in matrices.into_iter().zip(blocks.chunks_exact(n * n)) {
                for (i, row) in block.chunks_exact(n).enumerate() {
                    let first = (q.start + i) * all + q.start;
                    matrix[first..first + n].copy_from_slice(row);
                }
            }
            Ok(())
        })
    }

    fn curve(
        &self,
        path: Path,
        (x, u, t): (&[f64], &[f64], f64),
        y: &mut [f64],
        [v, a]: [&mut [f64]; 2],
    ) -> Result<(), MetricError> {
        self.try_sites(x.len(), |[e, q]| {
            let start = (&x[e.clone()], &u[q.clone()], t);
            self.on_site().curve(path, start, &mut y[e], [&mut v[q.clone()], &mut a[q]])
        })
    }

    fn lost_digits(&self, path: Path, x: &[f64], u: &[f64], end: &[f64], lost: &mut [f64]) {
        self.each_site(x.len(), |[e, q]| {
            let ends = [&x[e.clone()], &end[e]];
            self.on_site().lost_digits(path, ends[0], &u[q.clone()], ends[1], &mut lost[q]);
        });
    }

    fn velocity_at(&self, y: &[f64], x: &[f64], at: &[f64], v: &[f64], to: &mut [f64]) {
        self.each_site(x.len(), |[e, q]| {
            let (y, x) = (&y[e.clone()], &x[e]);
            self.on_site().velocity_at(y, x, &at[q.clone()], &v[q.clone()], &mut to[q]);
        });
    }

    fn turn_all(&self, y: &[f64], x: &[f64], at: &[f64], columns: &mut [f64]) {
        let (n, all) = (dimension::<P>(), at.len());
        let mut block = vec![0.0; n * n];
        columns.fill(0.0);
        self.each_site(x.len(), |[e, q]| {
            self.on_site().turn_all(&y[e.clone()], &x[e], &at[q.clone()], &mut block);
            for (k, column) in block.chunks_exact(n).enumerate() {
                let first = (q.start + k) * all + q.start;
                columns[first..first + n].copy_from_slice(column);
            }
        });
    }

    fn transport(&self, x: &[f64], y: &[f64], vectors: &mut [f64]) {
        let n = self.0.sites() * dimension::<P>();
        self.each_site(x.len(), |[e, q]| {
            for v in vectors.chunks_exact_mut(n) {
                self.on_site().transport(&x[e.clone()], &y[e.clone()], &mut v[q.clone()]);
            }
        });
    }

    fn pairing_size(&self, w: &[f64], v: &[f64]) -> f64 {
        let n = dimension::<P>();
        let pairs = w.chunks_exact(n).zip(v.chunks_exact(n));
        pairs.map(|(w, v)| self.on_site().pairing_size(w, v)).sum()
    }
}
