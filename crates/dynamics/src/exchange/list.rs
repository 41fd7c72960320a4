//! Lists of ports and baths.

use std::fmt::Debug;
use std::sync::Arc;

use metriplectic_fields::{Column, Real, Vector, Velocity};
use metriplectic_manifolds::{InnerProduct, Manifold, MetricAt, MetricError, Riemannian};

use super::bath::{Bath, Friction, Temperature};
use super::port::Port;

/// The place at which an exchange is evaluated.
#[derive(Debug)]
pub struct ExchangeArgs<'a, M: Manifold, G: Riemannian<M>> {
    /// The time.
    pub t: f64,
    /// The point `g.x` with the metric there.
    pub g: &'a MetricAt<'a, M, G, Real>,
    /// The covector of the energy there: `dH`, or a discrete gradient.
    pub w: &'a Vector<M, Real>,
    /// The covector of the entropy there, zero without an entropy.
    pub s: &'a Vector<M, Real>,
}

/// A port or a bath of a list.
#[derive(Clone, Copy, Debug)]
pub struct Part<'a> {
    /// Its name.
    pub name: &'a Arc<str>,
    /// The kind of its exchange.
    pub kind: PartKind,
}

/// The kind of the exchange of a part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PartKind {
    /// Work.
    Port,
    /// Heat.
    Bath {
        /// The temperature now.
        temperature: f64,
        /// The least rate of its contacts.
        least_rate: f64,
    },
}

/// A visitor of the parts of a list.
pub trait Visitor<M: Manifold> {
    /// Visits a part and its velocity: `F` less what of it would carry entropy, or `R (T dS − dH)`. A port has its velocity
    /// as given in `given`.
    fn visit(&mut self, part: Part<'_>, velocity: &Vector<M, Real>, given: &Vector<M, Real>);
}

/// The names of the parts of a list in their order, with whether each is a bath.
pub type Names = Vec<(Arc<str>, bool)>;

/// The exchange of a system with its surroundings: `()`, or a shorter list and a named [`Port`] or [`Bath`].
pub trait Exchange<M: Manifold, G: Riemannian<M>> {
    /// The numbers of a ledger: one for each port, its work; two for each bath, its heat and its entropy.
    type Entries: Entries;
    /// How many ports there are.
    const PORTS: usize;
    /// How many baths there are.
    const BATHS: usize;

    /// Passes each part to the visitor, in the order of the list.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the metric or the chart cannot be used there.
    fn each(
        &self,
        at: &ExchangeArgs<'_, M, G>,
        visitor: &mut impl Visitor<M>,
    ) -> Result<(), MetricError>;

    /// Appends the names of the parts.
    fn names(&self, names: &mut Names);

    /// Appends the temperatures of the baths at a time.
    fn temperatures(&self, t: f64, list: &mut Vec<f64>);

    /// Returns whether a bath has the temperature zero. It takes energy and no entropy, so no entropy is promised.
    fn has_cold_bath(&self) -> bool;
}

impl<M: Manifold, G: Riemannian<M>> Exchange<M, G> for () {
    type Entries = ();
    const PORTS: usize = 0;
    const BATHS: usize = 0;

    #[inline]
    fn each(&self, _: &ExchangeArgs<'_, M, G>, _: &mut impl Visitor<M>) -> Result<(), MetricError> {
        Ok(())
    }

    fn names(&self, _: &mut Names) {}

    fn temperatures(&self, _: f64, _: &mut Vec<f64>) {}

    #[inline]
    fn has_cold_bath(&self) -> bool {
        false
    }
}

impl<M, G, L, F> Exchange<M, G> for (L, Port<F>)
where
    M: Manifold,
    G: Riemannian<M>,
    L: Exchange<M, G>,
    F: Fn(Real, &M::Point<Real>) -> Velocity<M, Real>,
{
    type Entries = (L::Entries, [f64; 1]);
    const PORTS: usize = L::PORTS + 1;
    const BATHS: usize = L::BATHS;

    fn each(
        &self,
        at: &ExchangeArgs<'_, M, G>,
        visitor: &mut impl Visitor<M>,
    ) -> Result<(), MetricError> {
        self.0.each(at, visitor)?;
        let given = self.1.at::<M>(at.t, at.g.x)?;
        // The discrete gradient of the entropy differs from its differential, which F does not move.
        let mut velocity = given;
        let carried = at.s.dot(&given);
        if carried.re != 0.0 {
            let sharp = at.g.inner()?.sharp(at.s);
            velocity -= sharp * (carried / at.s.dot(&sharp));
        }
        visitor.visit(Part { name: &self.1.name, kind: PartKind::Port }, &velocity, &given);
        Ok(())
    }

    fn names(&self, names: &mut Names) {
        self.0.names(names);
        names.push((Arc::clone(&self.1.name), false));
    }

    fn temperatures(&self, t: f64, list: &mut Vec<f64>) {
        self.0.temperatures(t, list);
    }

    fn has_cold_bath(&self) -> bool {
        self.0.has_cold_bath()
    }
}

/// A bath with its name.
#[derive(Clone, Debug)]
pub struct Named<B> {
    pub(super) name: Arc<str>,
    pub(super) part: B,
}

impl<B> Named<B> {
    /// This bath under this name.
    pub fn new(name: impl Into<Arc<str>>, part: B) -> Self {
        Self { name: name.into(), part }
    }
}

impl<M, G, L, T, R> Exchange<M, G> for (L, Named<Bath<T, R>>)
where
    M: Manifold,
    G: Riemannian<M>,
    L: Exchange<M, G>,
    T: Temperature,
    R: Friction<M, G>,
{
    type Entries = (L::Entries, [f64; 2]);
    const PORTS: usize = L::PORTS;
    const BATHS: usize = L::BATHS + 1;

    fn each(
        &self,
        at: &ExchangeArgs<'_, M, G>,
        visitor: &mut impl Visitor<M>,
    ) -> Result<(), MetricError> {
        self.0.each(at, visitor)?;
        let Bath { temperature, friction } = &self.1.part;
        let temperature = temperature.at(at.t);
        let velocity = friction.apply(at, &affinity::<M>(temperature, at.w, at.s))?;
        let least_rate = friction.least_rate(at)?;
        let kind = PartKind::Bath { temperature, least_rate };
        visitor.visit(Part { name: &self.1.name, kind }, &velocity, &velocity);
        Ok(())
    }

    fn names(&self, names: &mut Names) {
        self.0.names(names);
        names.push((Arc::clone(&self.1.name), true));
    }

    fn temperatures(&self, t: f64, list: &mut Vec<f64>) {
        self.0.temperatures(t, list);
        list.push(self.1.part.temperature.at(t));
    }

    fn has_cold_bath(&self) -> bool {
        self.1.part.temperature.is_zero() || self.0.has_cold_bath()
    }
}

/// The covector `A = T s − w` that drives a bath.
pub fn affinity<M: Manifold>(
    temperature: f64,
    w: &Vector<M, Real>,
    s: &Vector<M, Real>,
) -> Vector<M, Real> {
    *s * Real::from(temperature) - *w
}

/// The numbers of a ledger.
pub trait Entries: Copy + Debug + PartialEq + Send + Sync + 'static {
    /// How many there are.
    const LEN: usize;

    /// The list with the numbers `next()`, `next()`, ….
    fn fill(next: &mut impl FnMut() -> f64) -> Self;

    /// The number at an index.
    fn get(&self, index: usize) -> f64;

    /// The list whose number `i` is `f(i)`.
    fn from_index(mut f: impl FnMut(usize) -> f64) -> Self {
        let mut index = 0;
        Self::fill(&mut || {
            index += 1;
            f(index - 1)
        })
    }
}

impl Entries for () {
    const LEN: usize = 0;

    #[inline]
    fn fill(_: &mut impl FnMut() -> f64) -> Self {}

    fn get(&self, index: usize) -> f64 {
        let _ = index;
        0.0
    }
}

impl<L: Entries, const N: usize> Entries for (L, [f64; N]) {
    const LEN: usize = L::LEN + N;

    #[inline]
    fn fill(next: &mut impl FnMut() -> f64) -> Self {
        let before = L::fill(next);
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = next();
        }
        (before, numbers)
    }

    #[inline]
    fn get(&self, index: usize) -> f64 {
        if index < L::LEN { self.0.get(index) } else { self.1[index - L::LEN] }
    }
}
