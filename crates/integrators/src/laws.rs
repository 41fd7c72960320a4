//! The laws of discrete gradients and steps, and the functions that check them.

use metriplectic_dynamics::{Metriplectic, SecondLaw, system::Point};
use metriplectic_fields::{
    BrokenLaw, ChartPoint, Column, Dimension, ScalarField, Space, Vector, differential,
};
use metriplectic_manifolds::{Manifold, Retraction, Riemannian, StepPath};

use crate::discrete_gradient::{DiscreteGradient, along as along_path};
use crate::explicit::Tableau;
use crate::explicit::conditions::{Conditions, highest};
use crate::midpoint::Scheme;
use crate::round_off::bound::{of_a_law, of_an_increment, size_of_terms};
use crate::run::method::Method;
use crate::run::schedule::Schedule;
use crate::run::span::Span;
use crate::run::state::State;
use crate::step::{Dim, Element, Flow, StateSpace as _, StepStart, Stepper};

/// Checks a discrete gradient of `f` on the path of `u` from `x`:
///
/// 1. mean value: `⟨w, d⟩ = F(x') − F(x)`; 2. consistency: `w → dF(z)` like `|d|²` on paths that
///    shrink; 3. the covector that is safe against round-off agrees with the definition as far as
///    the definition has digits.
///
/// # Errors
///
/// The first law that is broken.
pub fn discrete_gradient<M, G, R, W>(
    gradient: &W,
    f: &impl ScalarField<M>,
    metric: &G,
    retraction: &R,
    x: &M::Point<f64>,
    u: &Vector<M>,
) -> Result<(), BrokenLaw>
where
    M: Manifold,
    G: Riemannian<M>,
    R: Retraction<M, G>,
    W: DiscreteGradient,
{
    let missing = |law| move |_| BrokenLaw { law, size: f64::NAN, bound: 0.0 };
    let start: f64 = f.at(x);
    let along = |u: &Vector<M>| -> Result<_, BrokenLaw> {
        let path: StepPath<M> =
            retraction.step_path(metric, x, u).map_err(missing("the path exists"))?;
        let g = metric.at(&path.z).map_err(missing("the metric exists"))?;
        let w = gradient.covector(f, &g, (x, start), &path);
        let df: Vector<M> = differential(f, &ChartPoint::centre(&path.z.point()));
        let end: f64 = f.at(&path.end);
        let safe = along_path(gradient, f, metric, retraction, (x, u))
            .map_err(missing("the path exists"))?;
        Ok((path, w, safe, df, end))
    };
    let (path, w, safe, df, end) = along(u)?;
    let (sizes, n) = (M::scales(&path.end), M::Dim::LEN);
    let terms: f64 = (0..n).map(|i| df[i].abs() * (sizes[i] + path.d[i].abs())).sum();
    let size = start.abs() + end.abs() + terms;
    let bound = 64.0 * f64::EPSILON * size;
    let off = (w.dot(&path.d) - (end - start)).abs();
    BrokenLaw::unless("⟨w, d⟩ = F(x') − F(x)", off, bound)?;
    let off = (w - safe).magnitude();
    BrokenLaw::unless("the safe covector is the defined one", off, bound / path.d.magnitude())?;

    // On a path a hundred times shorter the deviation is 10⁴ times smaller; a first-order one
    // would be a hundred times smaller only.
    let deviation = |t: f64| along(&(*u * t)).map(|(_, _, safe, df, _)| (safe - df).magnitude());
    let long = deviation(1.0)?.max(4.0 * deviation(0.5)?).max(16.0 * deviation(0.25)?);
    let allowed = 1e-4 * (10.0 * long + df.magnitude()) + 1e2 * bound / path.d.magnitude();
    BrokenLaw::unless("w − dF(z) falls like |d|²", deviation(1e-2)?, allowed)
}

/// Checks one step of size `h` from `x`:
///
/// 1. the energy is conserved to `50 ε (|H| + Σ_i |∂_iH x_i|)`; 2. with [`SecondLaw::Exact`] and `h > 0` the
///    entropy does not fall by more than its round-off `4ε (|S| + Σ_i |∂_iS x_i|)`.
///
/// # Errors
///
/// The first law that is broken; a step that cannot be taken breaks the law that it exists.
pub fn step<Y, R, W>(
    scheme: &Scheme<R, W>,
    system: &Y,
    x: &Point<Y>,
    h: f64,
) -> Result<(), BrokenLaw>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    let end = one(scheme, system, x, h)?;
    let energy = system.energy_at(x);
    let sizes = [x, &end].map(|x| size_of_terms::<Y::Manifold>(system.energy(), x));
    let bound = of_a_law(sizes[0].max(sizes[1]));
    BrokenLaw::unless("a step keeps the energy", (system.energy_at(&end) - energy).abs(), bound)?;
    if system.second_law() == SecondLaw::Exact && h > 0.0 {
        let entropy = system.entropy_at(x);
        let bound = of_an_increment(system, [x, &end]);
        let fall = entropy - system.entropy_at(&end);
        BrokenLaw::unless("a step does not lower the entropy", fall, bound)?;
    }
    Ok(())
}

/// Checks that a scheme is symmetric in time: a step of `h` and one of `−h` lead back to `x`, as
/// with a symmetric retraction and the discrete gradient of its midpoint. `h` must be so small that
/// the step is solved whole.
///
/// # Errors
///
/// The law if it is broken, or a step that cannot be taken.
pub fn symmetric_step<Y, R, W>(
    scheme: &Scheme<R, W>,
    system: &Y,
    x: &Point<Y>,
    h: f64,
) -> Result<(), BrokenLaw>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    let end = one(scheme, system, x, h)?;
    let back = one(scheme, system, &end, -h)?;
    let (q, scales) = (Y::Manifold::coordinates(x, &back), Y::Manifold::scales(x));
    // An entry has the size that it starts with or reaches, or that of the terms which move it in the step.
    let there = Y::Manifold::scales(&end);
    let terms = system.rates_and_terms(x).map(|[_, terms]| terms.0);
    for i in 0..Dim::<Y>::LEN {
        let moved = terms.map_or(0.0, |terms| h.abs() * terms[i]);
        let bound = 1e-13 * scales[i].max(there[i]).max(moved);
        BrokenLaw::unless("steps of h and −h lead back", q[i].abs(), bound)?;
    }
    Ok(())
}

/// Checks a method from `x` in steps of size `h`: 1. its [order](Stepper::order) is the slope of its error, from
/// runs of 32 steps and of twice and four times as many; 2. what it [promises](Stepper::promises) holds on these
/// steps; 3. a run that is resumed from a checkpoint is the same run, bit for bit.
///
/// # Errors
///
/// The first law that is broken, or a run that ends in an error.
pub fn method<F: Flow, M: Method<F> + Clone>(
    method: M,
    flow: &F,
    x: &Element<F>,
    h: f64,
) -> Result<(), BrokenLaw> {
    let failed = || BrokenLaw { law: "a run ends without an error", size: 1.0, bound: 0.0 };
    let run = |refined: u32| {
        let span = Span::steps(h / f64::from(refined), 32 * refined as usize);
        method.clone().run(flow, x.clone(), span).map_err(|_| failed())
    };
    let runs = [run(1)?, run(2)?, run(4)?];
    for run in &runs {
        let (certificate, promises) = (run.certificate(), method.promises(flow));
        let broken = [
            ("the promised energy is conserved", promises.energy && !certificate.keeps_energy()),
            ("the promised entropy never falls", promises.entropy && !certificate.keeps_entropy()),
        ];
        for (law, broken) in broken {
            BrokenLaw::unless(law, f64::from(u8::from(broken)), 0.0)?;
        }
    }
    let [a, b, c] = runs.map(|run| F::Space::numbers(&run.last().point));
    let distance =
        |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    let slope = (distance(&a, &b) / distance(&b, &c)).log2();
    let off = (slope - f64::from(method.order())).abs();
    BrokenLaw::unless("the order of a method is the slope of its error", off, 0.25)?;

    let span = Span::steps(h, 16);
    let mut steps = method.clone().steps(flow, x.clone(), span).map_err(|_| failed())?;
    for _ in 0..8 {
        steps.advance().map_err(|_| failed())?;
    }
    let resumed = method.resume(flow, &steps.checkpoint()).map_err(|_| failed())?;
    let ends = [steps.run(), resumed.run()].map(|run| run.map_err(|_| failed()));
    let [Ok(whole), Ok(resumed)] = ends else { return Err(failed()) };
    let bits =
        |x: &Element<F>| F::Space::numbers(x).into_iter().map(f64::to_bits).collect::<Vec<_>>();
    let differs = bits(&whole.last().point) != bits(&resumed.last().point);
    BrokenLaw::unless("a resumed run is the same run", f64::from(u8::from(differs)), 0.0)
}

/// Checks the coefficients of an explicit Runge-Kutta method by the conditions of order, one for each rooted tree:
///
/// 1. the weights of the end have the [order](Tableau::order) of the method, which is from 1 to 10;
/// 2. an error vanishes up to its order, and not in the next one;
/// 3. a dense output has the order of the method less one.
///
/// # Errors
///
/// The first law that is broken. Its size is the largest residual of a condition, relative to its terms.
pub fn tableau(tableau: &Tableau) -> Result<(), BrokenLaw> {
    let faults = usize::from(tableau.has_a_fault());
    BrokenLaw::unless("a row names stages that are known", faults as f64, 0.0)?;
    let orders = tableau.orders_of_errors();
    let conditions = Conditions::of(tableau, highest(tableau.order(), orders));
    let round_off = 64.0 * f64::EPSILON;
    BrokenLaw::unless("the end has the order of the method", conditions.of_end(), round_off)?;
    for which in 0..orders.len() {
        let [off, own] = conditions.of_error(which);
        BrokenLaw::unless("an error vanishes up to its order", off, round_off)?;
        let missing = if own > 1e3 * round_off { 0.0 } else { 1.0 };
        BrokenLaw::unless("an error does not vanish in the next order", missing, 0.0)?;
    }
    if tableau.has_dense_output() {
        let off = conditions.inside(tableau.order() - 1);
        BrokenLaw::unless("the dense output has the order of the method less one", off, round_off)?;
    }
    Ok(())
}

/// A system in other units: the numbers of its entries, times, energies and entropies are
/// those of the original one times these factors.
#[derive(Clone, Debug, PartialEq)]
pub struct Units {
    /// For each entry of a point, in the order of [`Manifold::entries`]; 1 on a curved space, whose entries
    /// have no unit.
    pub entries: Vec<f64>,
    /// For times.
    pub time: f64,
    /// For energies.
    pub energy: f64,
    /// For entropies.
    pub entropy: f64,
}

/// Checks the scaling law: a run of `scaled` is the run of `system` in other units, `x̃ = D x`, `t̃ = T t`,
/// `H̃(x̃) = E H(x)`, `S̃(x̃) = Σ S(x)`, if its tensors are too: `Π̃ = D Π D/(ET)`, `K̃ = D K D/(ΣT)`,
/// `g̃ ∝ D⁻¹ g D⁻¹`.
///
/// Laws: 1. both take as many steps; 2. entries, energies and entropies agree up to `tolerance`, relative to
/// the largest of the run: in every state of steps of one size, at the end of adaptive ones, whose times
/// differ by round-off; with a tolerance of zero and factors that are powers of two, 3. all states have the
/// same bits, and Newton's method takes as many iterations.
///
/// # Errors
///
/// The law if it is broken, or a run that ends in an error.
pub fn scaling<Y, Z, M>(
    method: &M,
    run: &UnitRun<'_, Y>,
    scaled: &UnitRun<'_, Z>,
    units: &Units,
    tolerance: f64,
) -> Result<(), BrokenLaw>
where
    Y: Metriplectic,
    Z: Metriplectic<Manifold = Y::Manifold>,
    M: Method<Y> + Method<Z> + Clone,
{
    let failed = |_| BrokenLaw::unless("a run ends without an error", 1.0, 0.0);
    let a = Method::<Y>::run(method.clone(), run.system, run.x0.clone(), run.course.clone());
    let (x0, course) = (scaled.x0.clone(), scaled.course.clone());
    let b = Method::<Z>::run(method.clone(), scaled.system, x0, course);
    let (a, b) = match (a, b) {
        (Ok(a), Ok(b)) => (a, b),
        (Err(_), _) | (_, Err(_)) => return failed(()),
    };
    let (c, d) = (a.certificate(), b.certificate());
    let counts = [c.steps.abs_diff(d.steps), c.effort.iterations.abs_diff(d.effort.iterations)];
    let counted = if tolerance > 0.0 { counts[0] } else { counts[0] + counts[1] };
    BrokenLaw::unless("as many steps and iterations", counted as f64, 0.0)?;
    let numbers = |state: &State<Y::Manifold>| {
        let mut numbers = vec![state.time, state.energy, state.entropy];
        numbers.extend(Y::Manifold::entries(&state.point));
        numbers
    };
    let factors = [&[units.time, units.energy, units.entropy], units.entries.as_slice()].concat();
    let rows: Vec<_> = a.iter().zip(&b).map(|(a, b)| (numbers(a), numbers(b))).collect();
    let fixed = run.course.is_fixed() || tolerance == 0.0;
    let compared =
        if fixed { rows.as_slice() } else { rows.last_chunk::<1>().map_or(&[][..], |last| last) };
    for (k, factor) in factors.iter().enumerate() {
        let largest = rows.iter().fold(0.0_f64, |most, (a, _)| most.max(a[k].abs()));
        let off =
            compared.iter().fold(0.0_f64, |most, (a, b)| most.max((b[k] / factor - a[k]).abs()));
        BrokenLaw::unless("a run in other units is the same run", off, tolerance * largest)?;
    }
    Ok(())
}

/// A run of the scaling law.
#[derive(Debug)]
pub struct UnitRun<'a, Y: Metriplectic> {
    /// The system.
    pub system: &'a Y,
    /// Where it starts.
    pub x0: Point<Y>,
    /// How it runs.
    pub course: Schedule,
}

/// A single step, with nothing remembered.
fn one<Y, R, W>(
    scheme: &Scheme<R, W>,
    system: &Y,
    x: &Point<Y>,
    h: f64,
) -> Result<Point<Y>, BrokenLaw>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    let missing = |_| BrokenLaw { law: "the step exists", size: f64::NAN, bound: 0.0 };
    let (start, mut memory) = (StepStart::first(system, x), Stepper::<Y>::memory(scheme));
    scheme.step(&start, h, &mut memory).map(|taken| taken.x).map_err(missing)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Gonzalez, MeanValue, SymmetricItohAbe};
    use metriplectic_dynamics::System;
    use metriplectic_fields::Real;
    use metriplectic_manifolds::{Canonical, Exponential, LieDual, WeylMidpoint};
    use nalgebra::{Vector3, vector};
    use num_dual::DualNum;
    use proptest::prelude::*;

    fn top(p: &Vector3<Real>) -> Real {
        p.x.powi(2) + p.y.powi(3) * 0.3 + (p.z * p.x).sin() * 0.2 + 2.0
    }

    proptest! {
        #[test]
        fn the_discrete_gradient_keeps_its_laws(
            x in prop::array::uniform3(-1.0..1.0), u in prop::array::uniform3(-0.5..0.5),
        ) {
            let (x, u) = (Vector3::from(x), Vector3::from(u));
            prop_assume!(u.norm() > 0.05);
            let (g, weyl, x, u) = (&Canonical, &WeylMidpoint, &x, &u);
            discrete_gradient::<LieDual<3>, _, _, _>(&Gonzalez, &top, g, weyl, x, u)?;
            discrete_gradient::<LieDual<3>, _, _, _>(&MeanValue, &top, g, weyl, x, u)?;
            discrete_gradient::<LieDual<3>, _, _, _>(&SymmetricItohAbe, &top, g, weyl, x, u)?;
        }

        #[test]
        fn a_midpoint_step_is_symmetric_and_keeps_the_energy(
            x in prop::array::uniform3(-1.0..1.0),
        ) {
            let body = System::on(LieDual::so3())
                .energy(top)
                .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
                .build()
                .unwrap();
            let (scheme, x) = (Scheme::new(WeylMidpoint), Vector3::from(x));
            step(&scheme, &body, &x, 0.02)?;
            symmetric_step(&scheme, &body, &x, 0.02)?;
        }
    }

    #[test]
    fn a_step_based_at_its_start_is_not_symmetric() {
        let body = System::on(LieDual::so3()).energy(top).build().unwrap();
        let x = vector![0.3, -0.7, 0.5];
        let broken = symmetric_step(&Scheme::new(Exponential), &body, &x, 0.1).unwrap_err();
        assert_eq!(broken.law, "steps of h and −h lead back");
    }
}
