//! The sum of two brackets, on a product.

use metriplectic_fields::{Matrix, Scalar, Vector};
use metriplectic_manifolds::{Manifold, MetricError, Product, Split, Times};

use super::{
    Bracket, BracketArgs, BracketJet, NaturalBracket, Zero, by_dual_numbers, force_by_dual_numbers,
};

/// `Π_A ⊕ Π_B` on `A × B`: `{f, g} = {f, g}_A + {f, g}_B`. The Casimirs are functions of the Casimirs
/// of both; with `(AreaForm, Zero)` on `S² × R` every function of the second factor is one.
///
/// The metric must be a metric of the factors (a pair, or [`Canonical`](metriplectic_manifolds::Canonical); see [`Split`]),
/// because the brackets may use the volume forms of the factors.
impl<A, B, G, P, Q> Bracket<Product<A, B>, G> for (P, Q)
where
    A: Manifold + Times<B>,
    B: Manifold,
    G: Split<A, B>,
    P: Bracket<A, G::Left>,
    Q: Bracket<B, G::Right>,
{
    fn apply<D: Scalar>(
        &self,
        at: &BracketArgs<'_, Product<A, B>, G, D>,
        alpha: &Vector<Product<A, B>, D>,
    ) -> Result<Vector<Product<A, B>, D>, MetricError> {
        let ((x, y), (sx, sy)) = (Product::parts(at.g.x), Product::<A, B>::split(at.s));
        let left = at.g.metric.left(&y.base);
        let ((left, right), (a, b)) =
            (at.g.halves(&left, (&x, &y))?, Product::<A, B>::split(alpha));
        let (m, n) = (&at.space.0, &at.space.1);
        let a = self.0.apply(&BracketArgs { space: m, g: &left, s: &sx }, &a)?;
        let b = self.1.apply(&BracketArgs { space: n, g: &right, s: &sy }, &b)?;
        Ok(Product::<A, B>::join(&a, &b))
    }

    fn linearise(
        &self,
        at: &BracketArgs<'_, Product<A, B>, G>,
        alpha: &Vector<Product<A, B>>,
    ) -> Result<BracketJet<Product<A, B>>, MetricError> {
        if !at.g.metric.is_sum() {
            return by_dual_numbers(self, at, alpha);
        }
        let ((x, y), (sx, sy)) = (Product::parts(at.g.x), Product::<A, B>::split(at.s));
        let left = at.g.metric.left(&y.base);
        let ((left, right), (a, b)) =
            (at.g.halves(&left, (&x, &y))?, Product::<A, B>::split(alpha));
        let (m, n) = (&at.space.0, &at.space.1);
        let a = self.0.linearise(&BracketArgs { space: m, g: &left, s: &sx }, &a)?;
        let b = self.1.linearise(&BracketArgs { space: n, g: &right, s: &sy }, &b)?;
        Ok(joined(&a, &b))
    }

    fn is_poisson(&self) -> bool {
        Bracket::<A, G::Left>::is_poisson(&self.0) && Bracket::<B, G::Right>::is_poisson(&self.1)
    }

    fn is_forced(&self) -> bool {
        Bracket::<A, G::Left>::is_forced(&self.0) || Bracket::<B, G::Right>::is_forced(&self.1)
    }

    fn force<D: Scalar>(
        &self,
        at: &BracketArgs<'_, Product<A, B>, G, D>,
        w: &Vector<Product<A, B>, D>,
    ) -> Result<Vector<Product<A, B>, D>, MetricError> {
        let ((x, y), (sx, sy)) = (Product::parts(at.g.x), Product::<A, B>::split(at.s));
        let left = at.g.metric.left(&y.base);
        let ((left, right), (a, b)) = (at.g.halves(&left, (&x, &y))?, Product::<A, B>::split(w));
        let (m, n) = (&at.space.0, &at.space.1);
        let a = self.0.force(&BracketArgs { space: m, g: &left, s: &sx }, &a)?;
        let b = self.1.force(&BracketArgs { space: n, g: &right, s: &sy }, &b)?;
        Ok(Product::<A, B>::join(&a, &b))
    }

    fn linearise_force(
        &self,
        at: &BracketArgs<'_, Product<A, B>, G>,
        w: &Vector<Product<A, B>>,
    ) -> Result<BracketJet<Product<A, B>>, MetricError> {
        if !at.g.metric.is_sum() {
            return force_by_dual_numbers(self, at, w);
        }
        let ((x, y), (sx, sy)) = (Product::parts(at.g.x), Product::<A, B>::split(at.s));
        let left = at.g.metric.left(&y.base);
        let ((left, right), (a, b)) = (at.g.halves(&left, (&x, &y))?, Product::<A, B>::split(w));
        let (m, n) = (&at.space.0, &at.space.1);
        let a = self.0.linearise_force(&BracketArgs { space: m, g: &left, s: &sx }, &a)?;
        let b = self.1.linearise_force(&BracketArgs { space: n, g: &right, s: &sy }, &b)?;
        Ok(joined(&a, &b))
    }

    fn is_zero(&self) -> bool {
        Bracket::<A, G::Left>::is_zero(&self.0) && Bracket::<B, G::Right>::is_zero(&self.1)
    }

    fn annihilates_entropy(&self) -> bool {
        Bracket::<A, G::Left>::annihilates_entropy(&self.0)
            && Bracket::<B, G::Right>::annihilates_entropy(&self.1)
    }
}

/// The jet of a pair, block by block.
fn joined<A: Manifold + Times<B>, B: Manifold>(
    a: &BracketJet<A>,
    b: &BracketJet<B>,
) -> BracketJet<Product<A, B>> {
    let block = |a: &Matrix<A>, b: &Matrix<B>| Product::<A, B>::block(a, b);
    BracketJet {
        value: Product::<A, B>::join(&a.value, &b.value),
        along_z: block(&a.along_z, &b.along_z),
        along_s: block(&a.along_s, &b.along_s),
        tensor: block(&a.tensor, &b.tensor),
    }
}

impl<A: Manifold + Times<B>, B: Manifold> NaturalBracket for Product<A, B> {
    type Bracket = Zero;

    fn natural_bracket(&self) -> Zero {
        Zero
    }
}
