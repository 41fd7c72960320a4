//! The terms that are written down: those of a dissipation, and those of baths.

use std::ops::Range;

use metriplectic_fields::{Real, Vector, Velocity};
use metriplectic_manifolds::{Manifold, MetricAt, MetricError, Riemannian, out_of_chart};

use super::terms::{NoiseTerm, NoiseTerms};
use crate::dissipation::{OnsagerDissipation, along_velocities};
use crate::exchange::{Contact, components, vanishes};

impl<M, G, F, const R: usize> NoiseTerms<M, G> for OnsagerDissipation<F>
where
    M: Manifold,
    G: Riemannian<M>,
    F: Fn(&M::Point<Real>, &Velocity<M, Real>) -> [Contact<Velocity<M, Real>>; R],
{
    fn count(&self) -> usize {
        R
    }

    fn each(
        &self,
        g: &MetricAt<'_, M, G, Real>,
        w: &Vector<M, Real>,
        terms: Range<usize>,
        visit: &mut dyn FnMut(usize, NoiseTerm<Vector<M, Real>>),
    ) -> Result<(), MetricError> {
        let outside = || out_of_chart(g.x);
        let w = along_velocities(g.x, w, vanishes).ok_or_else(outside)?;
        let all = (self.0)(&g.x.point(), &w).into_iter().enumerate();
        for (r, Contact { rate, along }) in all.skip(terms.start).take(terms.len()) {
            visit(r, NoiseTerm { rate, b: components(g.x, &along).ok_or_else(outside)? });
        }
        Ok(())
    }
}
