//! The functions of a lattice: energies, entropies, and what they gather.

use metriplectic_fields::{Real, ScalarField};
use metriplectic_manifolds::{Manifold, Product, Times};

use super::LatticeBuilder;
use crate::fields::{LocalData, Uniform, WithData};
use crate::gather::{Gathered, Gathers};
use crate::model::{Data, Fields, Friction};

#[allow(
    clippy::type_complexity,
    reason = "the type of a builder lists the parts of the lattice, and a name for it would hide them"
)]
impl<M, B, H, V, S, G, KB, KS, L, D, E>
    LatticeBuilder<M, B, Fields<H, V, S, G>, Friction<KB, KS>, L, Data<D, E>>
where
    M: Manifold + Times<M>,
    D: LocalData,
    E: LocalData,
{
    /// Sets the energy `h(x_i)` of a site: a closure `|x| -> Real` or any other [`ScalarField`].
    pub fn energy<T: ScalarField<M> + Sync>(
        self,
        energy: T,
    ) -> LatticeBuilder<M, B, Fields<Uniform<T>, V, S, G>, Friction<KB, KS>, L, Data<D, E>> {
        self.with_fields(|Fields { bond_energy, entropy, gathers, .. }| Fields {
            energy: Uniform(energy),
            bond_energy,
            entropy,
            gathers,
        })
    }

    /// Sets the energy of a site from its point and its data.
    pub fn energy_with<T: Fn(&M::Point<Real>, &D::Item) -> Real + Sync>(
        self,
        energy: T,
    ) -> LatticeBuilder<M, B, Fields<WithData<T>, V, S, G>, Friction<KB, KS>, L, Data<D, E>> {
        self.with_fields(|Fields { bond_energy, entropy, gathers, .. }| Fields {
            energy: WithData(energy),
            bond_energy,
            entropy,
            gathers,
        })
    }

    /// Adds an energy of a site to the one that it has.
    ///
    /// ```
    /// use metriplectic_dynamics::Symplectic;
    /// use metriplectic_fields::Real;
    /// use metriplectic_integrators::Flow;
    /// use metriplectic_lattices::{Graph, Lattice, LatticeError};
    /// use metriplectic_manifolds::Euclidean;
    /// use nalgebra::{Vector2, vector};
    ///
    /// let pinned = Lattice::on(Graph::chain(2), Euclidean::<2>)
    ///     .site_data(vec![1.0, 4.0])
    ///     .bracket(Symplectic)
    ///     .energy(|x: &Vector2<Real>| x.y * x.y * 0.5)
    ///     .and_energy_with(|x: &Vector2<Real>, stiffness: &f64| x.x * x.x * (0.5 * stiffness))
    ///     .build()?;
    /// let start = pinned.points(|_| vector![1.0, 2.0]);
    /// assert_eq!(pinned.laws(&start).energy, 2.0 + 2.0 + 0.5 + 2.0);
    /// # Ok::<(), LatticeError>(())
    /// ```
    pub fn and_energy<T: ScalarField<M> + Sync>(
        self,
        more: T,
    ) -> LatticeBuilder<M, B, Fields<(H, Uniform<T>), V, S, G>, Friction<KB, KS>, L, Data<D, E>>
    {
        self.with_fields(|Fields { energy, bond_energy, entropy, gathers }| Fields {
            energy: (energy, Uniform(more)),
            bond_energy,
            entropy,
            gathers,
        })
    }

    /// Adds an energy of a site, from its point and its data, to the one that it has.
    pub fn and_energy_with<T: Fn(&M::Point<Real>, &D::Item) -> Real + Sync>(
        self,
        more: T,
    ) -> LatticeBuilder<M, B, Fields<(H, WithData<T>), V, S, G>, Friction<KB, KS>, L, Data<D, E>>
    {
        self.with_fields(|Fields { energy, bond_energy, entropy, gathers }| Fields {
            energy: (energy, WithData(more)),
            bond_energy,
            entropy,
            gathers,
        })
    }

    /// Adds an energy of a bond to the one that it has.
    pub fn and_bond_energy<T: ScalarField<Product<M, M>> + Sync>(
        self,
        more: T,
    ) -> LatticeBuilder<M, B, Fields<H, (V, Uniform<T>), S, G>, Friction<KB, KS>, L, Data<D, E>>
    {
        self.with_fields(|Fields { energy, bond_energy, entropy, gathers }| Fields {
            energy,
            bond_energy: (bond_energy, Uniform(more)),
            entropy,
            gathers,
        })
    }

    /// Sets the energy `h₂(x_i, x_j)` of a bond, given its first and its second site as a pair: a closure
    /// `|(x, y)| -> Real` or any other [`ScalarField`] on the product.
    pub fn bond_energy<T: ScalarField<Product<M, M>> + Sync>(
        self,
        bond_energy: T,
    ) -> LatticeBuilder<M, B, Fields<H, Uniform<T>, S, G>, Friction<KB, KS>, L, Data<D, E>> {
        self.with_fields(|Fields { energy, entropy, gathers, .. }| Fields {
            energy,
            bond_energy: Uniform(bond_energy),
            entropy,
            gathers,
        })
    }

    /// Sets the energy of a bond from its points and its data.
    pub fn bond_energy_with<T>(
        self,
        bond_energy: T,
    ) -> LatticeBuilder<M, B, Fields<H, WithData<T>, S, G>, Friction<KB, KS>, L, Data<D, E>>
    where
        T: Fn(&(M::Point<Real>, M::Point<Real>), &E::Item) -> Real + Sync,
    {
        self.with_fields(|Fields { energy, entropy, gathers, .. }| Fields {
            energy,
            bond_energy: WithData(bond_energy),
            entropy,
            gathers,
        })
    }

    /// Sets the entropy `s(x_i)` of a site: a closure `|x| -> Real` or any other [`ScalarField`]. The bracket must
    /// annihilate its differential.
    pub fn entropy<T: ScalarField<M> + Sync>(
        self,
        entropy: T,
    ) -> LatticeBuilder<M, B, Fields<H, V, Uniform<T>, G>, Friction<KB, KS>, L, Data<D, E>> {
        self.with_fields(|Fields { energy, bond_energy, gathers, .. }| Fields {
            energy,
            bond_energy,
            entropy: Uniform(entropy),
            gathers,
        })
    }

    /// Sets the entropy of a site from its point and its data.
    pub fn entropy_with<T: Fn(&M::Point<Real>, &D::Item) -> Real + Sync>(
        self,
        entropy: T,
    ) -> LatticeBuilder<M, B, Fields<H, V, WithData<T>, G>, Friction<KB, KS>, L, Data<D, E>> {
        self.with_fields(|Fields { energy, bond_energy, gathers, .. }| Fields {
            energy,
            bond_energy,
            entropy: WithData(entropy),
            gathers,
        })
    }

    /// Says that bonds have an entropy. [`build`](Self::build) refuses it, and says what to do instead: `Π dS = 0`
    /// holds site by site only for a sum over sites.
    pub fn bond_entropy<T: ScalarField<Product<M, M>>>(self, _entropy: T) -> Self {
        Self { has_bond_entropy: true, ..self }
    }
}

#[allow(
    clippy::type_complexity,
    reason = "the type of a builder lists the parts of the lattice, and a name for it would hide them"
)]
impl<M, B, H, V, S, GE, GS, K, L, D> LatticeBuilder<M, B, Fields<H, V, S, Gathers<GE, GS>>, K, L, D>
where
    M: Manifold + Times<M>,
{
    /// Sets an energy `g(x_i, ρ_i)` of each site that depends on a sum over its bonds, `ρ_i = Σ φ`: a density. `φ` is
    /// a function of the first and the second site of a bond, and counts for both. It is added to the other energies.
    ///
    /// An embedded atom (Daw, Baskes 1984) has `g = −√ρ`:
    ///
    /// ```
    /// use metriplectic_dynamics::Symplectic;
    /// use metriplectic_fields::Real;
    /// use metriplectic_lattices::{Graph, Lattice, LatticeError};
    /// use metriplectic_manifolds::Euclidean;
    /// use nalgebra::{Vector2, vector};
    /// use num_dual::DualNum;
    ///
    /// let atoms = Lattice::on(Graph::ring(100), Euclidean::<2>)
    ///     .bracket(Symplectic)
    ///     .energy(|x: &Vector2<Real>| x.y * x.y * 0.5)
    ///     .gather(
    ///         |(x, y): &(Vector2<Real>, Vector2<Real>)| ((x.x - y.x) * 2.0).exp(),
    ///         |_, density| -density.sqrt(),
    ///     )
    ///     .build()?;
    /// atoms.verify(&atoms.points(|i| vector![0.1 * (i as f64).sin(), 0.0]))?;
    /// # Ok::<(), LatticeError>(())
    /// ```
    pub fn gather<P, T>(
        self,
        phi: P,
        embed: T,
    ) -> LatticeBuilder<M, B, Fields<H, V, S, Gathers<Gathered<P, T>, GS>>, K, L, D>
    where
        P: ScalarField<Product<M, M>> + Sync,
        T: Fn(&M::Point<Real>, Real) -> Real + Sync,
    {
        self.with_fields(|Fields { energy, bond_energy, entropy, gathers }| {
            let gathers = Gathers { energy: Gathered { phi, embed }, entropy: gathers.entropy };
            Fields { energy, bond_energy, entropy, gathers }
        })
    }

    /// Sets an entropy `g(x_i, ρ_i)` of each site that depends on a sum over its bonds, `ρ_i = Σ φ`, as
    /// [`gather`](Self::gather) does for an energy. It is added to the [`entropy`](Self::entropy) of the sites.
    ///
    /// The bracket must annihilate the differential of the whole entropy at each site, so that `φ` and `g` may depend only
    /// on what the bracket leaves alone: internal energies, masses, Casimirs. A density of positions that it moves
    /// belongs into the energy, with the entropy of each site as one of its variables. A start at which `Π dS = 0` is broken is
    /// refused with its site.
    ///
    /// Cells with internal energies, whose heat capacity is larger where their neighbours are warm. Friction knows the
    /// temperatures by the differential `s` of the entropy, which is their reciprocal:
    ///
    /// ```
    /// use metriplectic_fields::Real;
    /// use metriplectic_integrators::{DormandPrince5, Method, Span};
    /// use metriplectic_lattices::{Graph, Lattice, Onsager};
    /// use metriplectic_manifolds::Euclidean;
    /// use nalgebra::{Vector1, vector};
    /// use num_dual::DualNum;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let cells = Lattice::on(Graph::ring(40), Euclidean::<1>)
    ///     .energy(|e: &Vector1<Real>| e.x)
    ///     .entropy(|e: &Vector1<Real>| e.x.ln())
    ///     .gather_entropy(
    ///         |(e, f): &(Vector1<Real>, Vector1<Real>)| (e.x + f.x) * 0.5,
    ///         |e, warmth| e.x.ln() * warmth * 0.1,
    ///     )
    ///     .bond_onsager(|bond| {
    ///         let [s, t] = bond.s.map(|s| s.x);
    ///         [Onsager { rate: 0.3 / (s * t), b: [vector![1.0], vector![-1.0]] }]
    ///     })
    ///     .build()?;
    /// let start = cells.points(|i| vector![1.0 + 0.3 * (i as f64).sin()]);
    /// let run = DormandPrince5.run(&cells, start, Span::until(2.0).tolerance(1e-6).at_most(2))?;
    /// assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
    /// # Ok(())
    /// # }
    /// ```
    pub fn gather_entropy<P, T>(
        self,
        phi: P,
        embed: T,
    ) -> LatticeBuilder<M, B, Fields<H, V, S, Gathers<GE, Gathered<P, T>>>, K, L, D>
    where
        P: ScalarField<Product<M, M>> + Sync,
        T: Fn(&M::Point<Real>, Real) -> Real + Sync,
    {
        self.with_fields(|Fields { energy, bond_energy, entropy, gathers }| {
            let gathers = Gathers { energy: gathers.energy, entropy: Gathered { phi, embed } };
            Fields { energy, bond_energy, entropy, gathers }
        })
    }
}
