//! Functions of a site and of a bond.

use std::ops::Range;

use metriplectic_fields::{Column, Evaluation, Jet1, Real, ScalarField, Space, Vector};

/// A smooth function of a point of `M` and of data `D`: the energy or the entropy of a site, or the energy of a bond
/// as a function on `M × M`.
///
/// [`Lattice::on`](crate::Lattice::on) makes them from closures and from every [`ScalarField`].
pub trait LocalField<M: Space, D>: Sync {
    /// True if there is one; a function that is not there is zero.
    const PRESENT: bool = true;

    /// Evaluates the function.
    fn value(&self, x: &M::Point<f64>, data: &D) -> f64;

    /// Computes the value and the differential.
    fn jet(&self, x: &M::Point<f64>, data: &D) -> Jet1<M>;

    /// Passes on what the derivatives of each summand come from, as found at a point.
    fn evaluations(&self, x: &M::Point<f64>, put: &mut dyn FnMut(Evaluation)) {
        let _ = x;
        if Self::PRESENT {
            put(Evaluation::Function);
        }
    }
}

/// A function that is not there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Absent;

impl<M: Space, D> LocalField<M, D> for Absent {
    const PRESENT: bool = false;

    #[inline]
    fn value(&self, _: &M::Point<f64>, _: &D) -> f64 {
        0.0
    }

    #[inline]
    fn jet(&self, _: &M::Point<f64>, _: &D) -> Jet1<M> {
        Jet1 { value: 0.0, df: Vector::<M>::zero() }
    }
}

/// The sum of two functions.
impl<M, D, F, G> LocalField<M, D> for (F, G)
where
    M: Space,
    F: LocalField<M, D>,
    G: LocalField<M, D>,
{
    const PRESENT: bool = F::PRESENT || G::PRESENT;

    #[inline]
    fn value(&self, x: &M::Point<f64>, data: &D) -> f64 {
        self.0.value(x, data) + self.1.value(x, data)
    }

    #[inline]
    fn jet(&self, x: &M::Point<f64>, data: &D) -> Jet1<M> {
        let [f, g] = [self.0.jet(x, data), self.1.jet(x, data)];
        Jet1 { value: f.value + g.value, df: f.df + g.df }
    }

    fn evaluations(&self, x: &M::Point<f64>, put: &mut dyn FnMut(Evaluation)) {
        self.0.evaluations(x, put);
        self.1.evaluations(x, put);
    }
}

/// A [`ScalarField`], the same at every site or bond.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Uniform<F>(pub(crate) F);

impl<M: Space, D, F: ScalarField<M> + Sync> LocalField<M, D> for Uniform<F> {
    #[inline]
    fn value(&self, x: &M::Point<f64>, _: &D) -> f64 {
        self.0.at(x)
    }

    #[inline]
    fn jet(&self, x: &M::Point<f64>, _: &D) -> Jet1<M> {
        self.0.jet1(x)
    }

    fn evaluations(&self, x: &M::Point<f64>, put: &mut dyn FnMut(Evaluation)) {
        put(self.0.evaluation(x));
    }
}

/// A closure of a point and of the data of its site or bond.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WithData<F>(pub(crate) F);

impl<M, D, F> LocalField<M, D> for WithData<F>
where
    M: Space,
    F: Fn(&M::Point<Real>, &D) -> Real + Sync,
{
    #[inline]
    fn value(&self, x: &M::Point<f64>, data: &D) -> f64 {
        ScalarField::<M>::at(&|x: &M::Point<Real>| (self.0)(x, data), x)
    }

    #[inline]
    fn jet(&self, x: &M::Point<f64>, data: &D) -> Jet1<M> {
        ScalarField::<M>::jet1(&|x: &M::Point<Real>| (self.0)(x, data), x)
    }
}

/// Functions whose sums over the sites are conserved: `()`, or a shorter list and a function.
pub trait ConservedSums<M: Space, D>: Sync {
    /// How many there are.
    const COUNT: usize;

    /// Evaluates the function with this number.
    fn value(&self, index: usize, x: &M::Point<f64>, data: &D) -> f64;

    /// Computes its value and its differential.
    fn jet(&self, index: usize, x: &M::Point<f64>, data: &D) -> Jet1<M>;
}

impl<M: Space, D> ConservedSums<M, D> for () {
    const COUNT: usize = 0;

    fn value(&self, _: usize, _: &M::Point<f64>, _: &D) -> f64 {
        0.0
    }

    fn jet(&self, _: usize, _: &M::Point<f64>, _: &D) -> Jet1<M> {
        Jet1 { value: 0.0, df: Vector::<M>::zero() }
    }
}

impl<M, D, L, F> ConservedSums<M, D> for (L, F)
where
    M: Space,
    L: ConservedSums<M, D>,
    F: LocalField<M, D>,
{
    const COUNT: usize = L::COUNT + 1;

    #[inline]
    fn value(&self, index: usize, x: &M::Point<f64>, data: &D) -> f64 {
        if index == L::COUNT { self.1.value(x, data) } else { self.0.value(index, x, data) }
    }

    #[inline]
    fn jet(&self, index: usize, x: &M::Point<f64>, data: &D) -> Jet1<M> {
        if index == L::COUNT { self.1.jet(x, data) } else { self.0.jet(index, x, data) }
    }
}

/// Data of the sites or of the bonds: `()`, or a list.
pub trait LocalData: Sync {
    /// The data of one of them.
    type Item;

    /// How many there are; `None` if there is no list.
    fn count(&self) -> Option<usize>;

    /// Returns the data of one of them.
    fn of(&self, index: usize) -> &Self::Item;

    /// Gives up all but those with these indices.
    fn keep(&mut self, range: Range<usize>);
}

impl LocalData for () {
    type Item = ();

    fn count(&self) -> Option<usize> {
        None
    }

    #[inline]
    fn of(&self, _: usize) -> &() {
        &()
    }

    fn keep(&mut self, _: Range<usize>) {}
}

impl<T: Sync> LocalData for Vec<T> {
    type Item = T;

    fn count(&self) -> Option<usize> {
        Some(self.len())
    }

    #[inline]
    fn of(&self, index: usize) -> &T {
        &self[index]
    }

    fn keep(&mut self, range: Range<usize>) {
        self.truncate(range.end);
        self.drain(..range.start);
    }
}

/// Data that can be brought into the order in which bonds are evaluated.
pub trait InOrder: LocalData {
    /// Puts the item with the number `order[k]` at the place `k`.
    fn arrange(&mut self, order: &[u32]);
}

impl InOrder for () {
    fn arrange(&mut self, _: &[u32]) {}
}

impl<T: Sync + Clone> InOrder for Vec<T> {
    fn arrange(&mut self, order: &[u32]) {
        *self = order.iter().map(|&number| self[number as usize].clone()).collect();
    }
}
