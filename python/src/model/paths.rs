//! The paths of steps: those of the factors, side by side.

use metriplectic_equations::room::with_numbers;
use metriplectic_equations::{MetricError, Path, PathAt, PathSlopes, Paths};

use super::friction::Around;
use super::layout::put_block;
use super::space::Placed;

/// The geodesics of the canonical metric and the lines of the charts; with a recorded metric the lines alone.
impl Paths for Around {
    fn follows(&self, path: Path) -> bool {
        self.metric.is_none() || path == Path::Chart
    }

    fn path(
        &self,
        path: Path,
        x: &[f64],
        u: &[f64],
        to: &mut PathAt<'_>,
    ) -> Result<(), MetricError> {
        for Placed { factor, entries, directions, .. } in &self.layout.factors {
            let to = &mut PathAt {
                z: &mut to.z[entries.clone()],
                d: &mut to.d[directions.clone()],
                end: &mut to.end[entries.clone()],
            };
            factor.paths().path(path, &x[entries.clone()], &u[directions.clone()], to)?;
        }
        Ok(())
    }

    fn end(&self, path: Path, x: &[f64], u: &[f64], end: &mut [f64]) -> Result<(), MetricError> {
        for Placed { factor, entries, directions, .. } in &self.layout.factors {
            let end = &mut end[entries.clone()];
            factor.paths().end(path, &x[entries.clone()], &u[directions.clone()], end)?;
        }
        Ok(())
    }

    fn path_jet(
        &self,
        path: Path,
        x: &[f64],
        u: &[f64],
        (to, slopes): (&mut PathAt<'_>, &mut PathSlopes<'_>),
    ) -> Result<(), MetricError> {
        let n = self.layout.directions;
        [&mut *slopes.dz, &mut *slopes.dd, &mut *slopes.dend]
            .into_iter()
            .for_each(|matrix| matrix.fill(0.0));
        for Placed { factor, entries, directions, .. } in &self.layout.factors {
            let m = directions.len();
            with_numbers(3 * m * m, |room| {
                let (dz, room) = room.split_at_mut(m * m);
                let (dd, dend) = room.split_at_mut(m * m);
                let to = &mut PathAt {
                    z: &mut to.z[entries.clone()],
                    d: &mut to.d[directions.clone()],
                    end: &mut to.end[entries.clone()],
                };
                let of_factor = &mut PathSlopes { dz, dd, dend };
                let (x, u) = (&x[entries.clone()], &u[directions.clone()]);
                factor.paths().path_jet(path, x, u, (to, of_factor))?;
                put_block(n, directions, of_factor.dz, slopes.dz);
                put_block(n, directions, of_factor.dd, slopes.dd);
                put_block(n, directions, of_factor.dend, slopes.dend);
                Ok::<(), MetricError>(())
            })?;
        }
        Ok(())
    }

    fn curve(
        &self,
        path: Path,
        (x, u, t): (&[f64], &[f64], f64),
        y: &mut [f64],
        [v, a]: [&mut [f64]; 2],
    ) -> Result<(), MetricError> {
        for Placed { factor, entries, directions, .. } in &self.layout.factors {
            let start = (&x[entries.clone()], &u[directions.clone()], t);
            let to = [&mut v[directions.clone()], &mut a[directions.clone()]];
            factor.paths().curve(path, start, &mut y[entries.clone()], to)?;
        }
        Ok(())
    }

    fn lost_digits(&self, path: Path, x: &[f64], u: &[f64], end: &[f64], lost: &mut [f64]) {
        for Placed { factor, entries, directions, .. } in &self.layout.factors {
            let [x, end] = [x, end].map(|x| &x[entries.clone()]);
            let (u, lost) = (&u[directions.clone()], &mut lost[directions.clone()]);
            factor.paths().lost_digits(path, x, u, end, lost);
        }
    }

    fn accuracy(&self, path: Path) -> f64 {
        let of = |placed: &Placed| placed.factor.paths().accuracy(path);
        self.layout.factors.iter().map(of).fold(0.0, f64::max)
    }

    fn velocity_at(&self, y: &[f64], x: &[f64], q: &[f64], v: &[f64], to: &mut [f64]) {
        for Placed { factor, entries, directions, .. } in &self.layout.factors {
            let [y, x] = [y, x].map(|x| &x[entries.clone()]);
            let [q, v] = [q, v].map(|q| &q[directions.clone()]);
            factor.paths().velocity_at(y, x, q, v, &mut to[directions.clone()]);
        }
    }

    fn turn_all(&self, y: &[f64], x: &[f64], q: &[f64], columns: &mut [f64]) {
        let n = self.layout.directions;
        columns.fill(0.0);
        for Placed { factor, entries, directions, .. } in &self.layout.factors {
            if factor.is_flat() {
                directions.clone().for_each(|i| columns[i * n + i] = 1.0);
                continue;
            }
            let m = directions.len();
            with_numbers(m * m, |block| {
                let [y, x] = [y, x].map(|x| &x[entries.clone()]);
                factor.paths().turn_all(y, x, &q[directions.clone()], block);
                put_block(n, directions, block, columns);
            });
        }
    }

    fn transport(&self, x: &[f64], y: &[f64], vectors: &mut [f64]) {
        let n = self.layout.directions;
        for Placed { factor, entries, directions, .. } in &self.layout.factors {
            if factor.is_flat() {
                continue;
            }
            let [x, y] = [x, y].map(|x| &x[entries.clone()]);
            for vector in vectors.chunks_exact_mut(n) {
                factor.paths().transport(x, y, &mut vector[directions.clone()]);
            }
        }
    }

    fn pairing_size(&self, w: &[f64], v: &[f64]) -> f64 {
        let of = |Placed { factor, directions, .. }: &Placed| {
            factor.paths().pairing_size(&w[directions.clone()], &v[directions.clone()])
        };
        self.layout.factors.iter().map(of).sum()
    }
}
