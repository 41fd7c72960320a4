//! The friction of baths as terms, which their noise needs.

use metriplectic_fields::{Real, Vector, Velocity};
use metriplectic_manifolds::{Manifold, MetricError, Riemannian, out_of_chart};

use super::bath::{Bath, Contact, Contacts, Friction, Isotropic, Temperature};
use super::components;
use super::list::{Exchange, ExchangeArgs, Named};
use super::port::Port;
use crate::noise::{NoiseFrame, NoiseTerm};

/// The friction of a bath as a sum of terms, `R = Σ_r ρ_r b_r b_rᵀ`. The `b_r` need annihilate nothing.
///
/// An isotropic friction has one for each vector of a [`NoiseFrame`], and one of contacts has these.
#[diagnostic::on_unimplemented(
    message = "the friction `{Self}` of a bath has no terms, so its noise is not known (`NoiseNeedsTerms`)"
)]
pub trait FrictionTerms<M: Manifold, G: Riemannian<M>>: Friction<M, G> {
    /// Returns the number of terms.
    fn count(&self) -> usize;

    /// Passes all terms to the visitor.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the metric or the chart cannot be used there.
    fn each_term(
        &self,
        at: &ExchangeArgs<'_, M, G>,
        visit: &mut dyn FnMut(NoiseTerm<Vector<M, Real>>),
    ) -> Result<(), MetricError>;

    /// Returns whether the kinetic drift `Σ_r c_r b_r` vanishes, with the measure 1.
    fn is_closed(&self) -> bool {
        false
    }
}

impl<M: Manifold, G: NoiseFrame<M>> FrictionTerms<M, G> for Isotropic {
    fn is_closed(&self) -> bool {
        G::IS_CLOSED
    }

    fn count(&self) -> usize {
        G::legs()
    }

    fn each_term(
        &self,
        at: &ExchangeArgs<'_, M, G>,
        visit: &mut dyn FnMut(NoiseTerm<Vector<M, Real>>),
    ) -> Result<(), MetricError> {
        let rate = Real::from(self.rate());
        G::frame(at.g)?.into_iter().for_each(|b| visit(NoiseTerm { rate, b }));
        Ok(())
    }
}

impl<M, G, F, const N: usize> FrictionTerms<M, G> for Contacts<F>
where
    M: Manifold,
    G: Riemannian<M>,
    F: Fn(Real, &M::Point<Real>, &Velocity<M, Real>) -> [Contact<Velocity<M, Real>>; N],
{
    fn count(&self) -> usize {
        N
    }

    fn each_term(
        &self,
        at: &ExchangeArgs<'_, M, G>,
        visit: &mut dyn FnMut(NoiseTerm<Vector<M, Real>>),
    ) -> Result<(), MetricError> {
        let x = at.g.x;
        for Contact { rate, along } in self.at(at)? {
            let b = components(x, &along).ok_or_else(|| out_of_chart(x))?;
            visit(NoiseTerm { rate, b });
        }
        Ok(())
    }
}

/// A term of a bath of a list.
#[derive(Clone, Copy, Debug)]
pub struct BathTerm<V> {
    /// The number of the bath among the baths.
    pub bath: usize,
    /// Its temperature now.
    pub temperature: f64,
    /// The term of its friction.
    pub term: NoiseTerm<V>,
}

/// The exchange of a system whose baths have terms.
pub trait ExchangeTerms<M: Manifold, G: Riemannian<M>>: Exchange<M, G> {
    /// Appends the number of terms of each bath.
    fn counts(&self, list: &mut Vec<usize>);

    /// Returns whether the kinetic drift of a bath vanishes, with the measure 1.
    fn is_closed(&self, bath: usize) -> bool;

    /// Passes the terms of all baths to the visitor, in the order of the list.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the metric or the chart cannot be used there.
    fn each_term(
        &self,
        at: &ExchangeArgs<'_, M, G>,
        visit: &mut dyn FnMut(BathTerm<Vector<M, Real>>),
    ) -> Result<(), MetricError>;
}

impl<M: Manifold, G: Riemannian<M>> ExchangeTerms<M, G> for () {
    fn counts(&self, _: &mut Vec<usize>) {}

    fn is_closed(&self, _: usize) -> bool {
        true
    }

    fn each_term(
        &self,
        _: &ExchangeArgs<'_, M, G>,
        _: &mut dyn FnMut(BathTerm<Vector<M, Real>>),
    ) -> Result<(), MetricError> {
        Ok(())
    }
}

impl<M, G, L, F> ExchangeTerms<M, G> for (L, Port<F>)
where
    M: Manifold,
    G: Riemannian<M>,
    L: ExchangeTerms<M, G>,
    F: Fn(Real, &M::Point<Real>) -> Velocity<M, Real>,
{
    fn counts(&self, list: &mut Vec<usize>) {
        self.0.counts(list);
    }

    fn is_closed(&self, bath: usize) -> bool {
        self.0.is_closed(bath)
    }

    fn each_term(
        &self,
        at: &ExchangeArgs<'_, M, G>,
        visit: &mut dyn FnMut(BathTerm<Vector<M, Real>>),
    ) -> Result<(), MetricError> {
        self.0.each_term(at, visit)
    }
}

impl<M, G, L, T, R> ExchangeTerms<M, G> for (L, Named<Bath<T, R>>)
where
    M: Manifold,
    G: Riemannian<M>,
    L: ExchangeTerms<M, G>,
    T: Temperature,
    R: FrictionTerms<M, G>,
{
    fn counts(&self, list: &mut Vec<usize>) {
        self.0.counts(list);
        list.push(self.1.part.friction.count());
    }

    fn is_closed(&self, bath: usize) -> bool {
        if bath == L::BATHS { self.1.part.friction.is_closed() } else { self.0.is_closed(bath) }
    }

    fn each_term(
        &self,
        at: &ExchangeArgs<'_, M, G>,
        visit: &mut dyn FnMut(BathTerm<Vector<M, Real>>),
    ) -> Result<(), MetricError> {
        self.0.each_term(at, visit)?;
        let Bath { temperature, friction } = &self.1.part;
        let (bath, temperature) = (L::BATHS, temperature.at(at.t));
        friction.each_term(at, &mut |term| visit(BathTerm { bath, temperature, term }))
    }
}
