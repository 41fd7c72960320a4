//! The noise of a metriplectic system.
//!
//! The terms are projected off the further invariants, as the dissipation is: with the projection `Q` off the parts of
//! their differentials that are orthogonal to `dH`, `Q K Qᵀ = Σ_r ρ_r (Q b_r)(Q b_r)ᵀ`.

use std::ops::Range;

use metriplectic_fields::{
    ChartPoint, Column, Dimension as _, Jet2, Matrix, Real, ScalarField, Vector,
};
use metriplectic_manifolds::{Canonical, Manifold, MetricError, Riemannian};

use super::drift::{Place, TermVisitor, centre, kinetic_drift, ln_density, seeded};
use super::examination::{Around, place_at};
use super::terms::{NoiseTerm, NoiseTerms};
use crate::bracket::Bracket as _;
use crate::dissipation::Dissipation as _;
use crate::invariants::{Invariants as _, Kind, Visitor};
use crate::metriplectic::{Dim, Metriplectic, Point};
use crate::orthogonal::Orthogonal;
use metriplectic_equations::judge::ROUNDING;

type VectorOf<Y> = Vector<<Y as Metriplectic>::Manifold>;

/// The second jets of the fields of a system at a point.
pub(super) struct Jets<M: Manifold> {
    energy: Jet2<M>,
    entropy: Jet2<M>,
    invariants: Vec<Jet2<M>>,
}

impl<M: Manifold> Jets<M> {
    pub(super) fn at<Y: Metriplectic<Manifold = M> + ?Sized>(
        system: &Y,
        x: &M::Point<f64>,
    ) -> Self {
        struct All<'a, M: Manifold>(&'a M::Point<f64>, Vec<Jet2<M>>);
        impl<M: Manifold> Visitor<M> for All<'_, M> {
            fn visit(&mut self, _: Kind, f: &impl ScalarField<M>) {
                self.1.push(f.jet2(self.0));
            }
        }
        let mut all = All(x, Vec::new());
        system.invariants().each(&mut all);
        let (energy, entropy) = (system.energy().jet2(x), system.entropy().jet2(x));
        Self { energy, entropy, invariants: all.1 }
    }

    fn place(&self, x: &M::Point<f64>, directions: [usize; 2]) -> Place<M> {
        Place {
            x: centre::<M>(x, directions),
            w: seeded(&self.energy, directions),
            s: seeded(&self.entropy, directions),
            invariants: self.invariants.iter().map(|jet| seeded(jet, directions)).collect(),
        }
    }

    /// The place at a point with the derivatives along a vector in `ε₁`.
    pub(super) fn along(&self, x: &M::Point<f64>, u: &Vector<M>) -> Place<M> {
        let dual = |value: &Vector<M>, slope: Vector<M>| {
            Vector::<M, Real>::from_index(|k| Real::new(value[k], slope[k], 0.0, 0.0))
        };
        let of = |jet: &Jet2<M>| dual(&jet.df, jet.hf * *u);
        Place {
            x: ChartPoint { base: x.clone(), q: dual(&Vector::<M>::zero(), *u) },
            w: of(&self.energy),
            s: of(&self.entropy),
            invariants: self.invariants.iter().map(of).collect(),
        }
    }
}

/// Passes terms of the dissipation, projected off the further invariants, to a visitor.
fn each<Y>(
    system: &Y,
    place: &Place<Y::Manifold>,
    terms: Range<usize>,
    visit: &mut TermVisitor<'_, Y::Manifold>,
) -> Result<(), MetricError>
where
    Y: Metriplectic<Dissipation: NoiseTerms<Y::Manifold, Y::Metric>> + ?Sized,
{
    let g = system.metric_at(&place.x);
    if place.invariants.is_empty() {
        return system.dissipation().each(&g, &place.w, terms, visit);
    }
    let mut normals = Orthogonal::<Dim<Y>, Real>::default();
    let inner = g.inner()?;
    normals.push(inner, &place.w);
    let first = normals.len();
    for l in &place.invariants {
        normals.push(inner, l);
    }
    system.dissipation().each(&g, &place.w, terms, &mut |r, NoiseTerm { rate, b }| {
        visit(r, NoiseTerm { rate, b: normals.project_vector(first, &b) });
    })
}

/// The place at a point, with the derivatives along two directions of its chart; a direction beyond the dimension has none.
pub fn seeded_place<Y: Metriplectic + ?Sized>(
    system: &Y,
    x: &Point<Y>,
    directions: [usize; 2],
) -> Place<Y::Manifold> {
    Jets::at(system, x).place(x, directions)
}

/// The place at a point without derivatives.
pub fn place<Y: Metriplectic + ?Sized>(system: &Y, x: &Point<Y>) -> Place<Y::Manifold> {
    place_at(system, &ChartPoint::centre(x))
}

/// Computes `Σ_r a_r √(κ ρ_r) b_r` over some of the terms, with the strength `κ` and the number `a_r` of each.
///
/// # Errors
///
/// [`MetricError`] if the metric or the chart cannot be used there.
pub fn noise_vector<Y>(
    system: &Y,
    x: &Point<Y>,
    terms: Range<usize>,
    (strength, numbers): (f64, &dyn Fn(usize) -> f64),
) -> Result<VectorOf<Y>, MetricError>
where
    Y: Metriplectic<Dissipation: NoiseTerms<Y::Manifold, Y::Metric>> + ?Sized,
{
    let mut sum = VectorOf::<Y>::zero();
    each(system, &place(system, x), terms, &mut |r, NoiseTerm { rate, b }| {
        sum += b.real::<VectorOf<Y>>() * ((strength * rate.re).sqrt() * numbers(r));
    })?;
    Ok(sum)
}

/// Computes the velocity of the friction, `K dS = Σ_r ρ_r b_r ⟨b_r, dS⟩`.
///
/// # Errors
///
/// [`MetricError`] if the metric or the chart cannot be used there.
pub fn friction_vector<Y>(system: &Y, x: &Point<Y>) -> Result<VectorOf<Y>, MetricError>
where
    Y: Metriplectic<Dissipation: NoiseTerms<Y::Manifold, Y::Metric>> + ?Sized,
{
    let (here, mut sum) = (place(system, x), VectorOf::<Y>::zero());
    let all = 0..system.dissipation().count();
    each(system, &here, all, &mut |_, NoiseTerm { rate, b }| {
        sum += b.real::<VectorOf<Y>>() * (rate.re * b.dot(&here.s).re);
    })?;
    Ok(sum)
}

/// Computes the kinetic drift `Σ_r c_r b_r`, without the factor `k_B`.
///
/// # Errors
///
/// [`MetricError`] if the metric or the chart cannot be used there.
pub fn noise_drift<Y>(
    system: &Y,
    x: &Point<Y>,
    measure: &impl ScalarField<Y::Manifold>,
) -> Result<VectorOf<Y>, MetricError>
where
    Y: Metriplectic<Dissipation: NoiseTerms<Y::Manifold, Y::Metric>> + ?Sized,
    Canonical: Riemannian<Y::Manifold>,
{
    let jets = Jets::at(system, x);
    let all = 0..system.dissipation().count();
    kinetic_drift(
        x,
        measure,
        |directions| jets.place(x, directions),
        |place, visit| each(system, place, all.clone(), visit),
    )
}

/// Computes `div_μ(Π dH)` at a point, and the sum of the sizes of its terms, in which the rounding of the velocity in these
/// units of the coordinates counts too. Where each term is the rounding of larger ones, the divergence is no larger.
///
/// # Errors
///
/// [`MetricError`] if the metric or the chart cannot be used there.
pub fn divergence<Y>(
    system: &Y,
    x: &Point<Y>,
    measure: &impl ScalarField<Y::Manifold>,
    units: &VectorOf<Y>,
) -> Result<[f64; 2], MetricError>
where
    Y: Metriplectic + ?Sized,
    Canonical: Riemannian<Y::Manifold>,
{
    let n = Dim::<Y>::LEN;
    let jets = Jets::at(system, x);
    let density = ln_density(x, measure)?;
    let [mut sum, mut size, mut rate] = [0.0_f64; 3];
    let mut add = |term: f64| {
        sum += term;
        size += term.abs();
    };
    for i in (0..n).step_by(2) {
        let place = jets.place(x, [i, i + 1]);
        let g = system.metric_at(&place.x);
        let v = system.bracket().apply(&system.bracket_args(&g, &place.s), &place.w)?;
        add(v[i].eps1);
        add(density[i] * v[i].re);
        if i + 1 < n {
            add(v[i + 1].eps2);
            add(density[i + 1] * v[i + 1].re);
        }
        if i == 0 {
            rate = (0..n).map(|k| (v[k].re / units[k]).abs()).sum();
        }
    }
    Ok([sum, size + ROUNDING * rate])
}

/// Computes the largest entry of `Σ ρ_r b_r b_rᵀ − K` at a point, and that of `K`, both in these units of the coordinates.
///
/// # Errors
///
/// [`MetricError`] if the metric or the chart cannot be used there.
pub fn mismatch<Y>(system: &Y, x: &Point<Y>, units: &VectorOf<Y>) -> Result<[f64; 2], MetricError>
where
    Y: Metriplectic<Dissipation: NoiseTerms<Y::Manifold, Y::Metric>> + ?Sized,
{
    let here = Place { invariants: Vec::new(), ..place(system, x) };
    let centre = ChartPoint::<Y::Manifold>::centre(x);
    let k = system.dissipation().tensor(&system.metric_at(&centre), &here.w.real())?;
    let in_units = |i: usize, j: usize, entry: f64| (entry / (units[i] * units[j])).abs();
    let n = Dim::<Y>::LEN;
    let pairs = || (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    let largest = |a: &Matrix<Y::Manifold>| {
        pairs().map(|(i, j)| in_units(i, j, a[(i, j)])).fold(0.0, f64::max)
    };
    let (size, mut rest) = (largest(&k), k);
    let all = 0..system.dissipation().count();
    each(system, &here, all, &mut |_, NoiseTerm { rate, b }| {
        for (i, j) in pairs() {
            rest[(i, j)] -= rate.re * b[i].re * b[j].re;
        }
    })?;
    Ok([largest(&rest), size])
}

/// Compares the derivatives of the terms of a dissipation with their values, as [`Around::lost_in_terms`].
pub fn lost_in_dissipation<Y>(system: &Y, around: &Around<Y::Manifold>) -> Option<[f64; 2]>
where
    Y: Metriplectic<Dissipation: NoiseTerms<Y::Manifold, Y::Metric>> + ?Sized,
{
    let all = 0..system.dissipation().count();
    around.lost_in_terms(system, |place, visit| each(system, place, all.clone(), visit))
}
