//! Implicit methods of models in plain numbers: the scheme of the paper, and methods with stages.
//!
//! The equation of a step is that of [`crate::midpoint`] and of [`crate::collocation`]. It asks a [`Model`] for its laws and its
//! parts, on a space that is not flat for its [paths](metriplectic_equations::Paths) and its metric, and knows neither its closures nor
//! its types. Lists of numbers have a length that is known at run time, or when this
//! library is compiled.

mod algebra;
mod collocation;
mod drift;
mod driven;
mod metric;
mod midpoint;
mod motion;
mod orthogonal;
mod parts;
mod refusal;
mod start;
mod velocity;

use metriplectic_dynamics::SecondLaw;
use metriplectic_equations::{Equations, Model, Path};
use metriplectic_manifolds::{Canonical, Euclidean, Retraction};

pub(crate) use self::algebra::Matrix;
pub(crate) use self::collocation::{Collocation, StageNumbers, StageRoot, TimeOfStep, WorkOfTime};
pub(crate) use self::driven::{DrivenMethod, DrivenStage, DrivenStart, DrivenStep};
pub(crate) use self::midpoint::Midpoint;
pub(crate) use self::midpoint::{FromEnd, MidpointNumbers, along_parameters, from_end};
pub(crate) use self::motion::{LawAt, Motion, law_along_parameters, laws_at};
pub(crate) use self::orthogonal::OrthogonalJet;
pub(crate) use self::parts::{OfLaws, Parts, Second, WithJacobian, is_flat};
pub use self::refusal::NoImplicitSteps;
pub(crate) use self::refusal::refuse;
pub(crate) use self::start::accumulated;
use self::start::{Around, Start, Step};
pub(crate) use self::velocity::{Columns, VelocityJet, reversible_jet, whole_velocity_jet};
use crate::collocation::dense::Within;
use crate::collocation::tableau::{GAUSS, RADAU};
use crate::collocation::{Gauss, Radau, Tableau, control};
use crate::discrete_gradient::DiscreteGradient;
use crate::midpoint::Scheme;
use crate::midpoint::step::scheme_name;
use crate::numbers::{AtRunTime, FromEquations, Known, Lengths, OfLength};
use crate::step::failure::{Cause, Fallbacks};
use crate::step::passed_on::passed_on;
use crate::step::{
    Compiled, Control, Effort, Element, Flow, Laws, MethodError, PathOfStep, Promises, Refusal,
    StateSpace, StepEnds, StepError, StepStart, Stepper, Taken, dense,
};

/// A flow in lists of numbers whose parts may be known apart.
pub(crate) trait InLists:
    Flow<
        Space: StateSpace<Element = <Self::Lengths as Lengths>::State>,
        Vector = <Self::Lengths as Lengths>::Vector,
        Numbers = <Self::Lengths as Lengths>::Invariants,
    >
{
    /// The lists.
    type Lengths: Lengths;

    /// The system.
    fn system(&self) -> &dyn Equations;
}

impl<S: Equations> InLists for FromEquations<S> {
    type Lengths = AtRunTime;

    fn system(&self) -> &dyn Equations {
        &self.0
    }
}

impl<const N: usize, const E: usize> InLists for OfLength<'_, N, E> {
    type Lengths = Known<N, E>;

    fn system(&self) -> &dyn Equations {
        self.equations()
    }
}

/// The model of a flow. A run has asked before it whether there is one.
fn model<F: InLists>(flow: &F) -> &dyn Model {
    flow.system().model().expect("a run refuses a system without a model")
}

/// A flow, as far as a step asks it beside its model.
struct OfFlow<'a, F>(&'a F);

impl<F: InLists> Around<F::Lengths> for OfFlow<'_, F> {
    fn onto(
        &self,
        y: &Element<F>,
        laws: &Laws<F::Numbers>,
        entropy: Option<f64>,
    ) -> Option<Element<F>> {
        self.0.onto(y, laws, entropy)
    }

    fn is_outside(&self, x: &Element<F>) -> bool {
        self.0.defect(x).is_infinite()
    }

    fn dependent_invariant(&self, x: &Element<F>) -> Option<(usize, f64)> {
        self.0.dependent_invariant(x)
    }
}

/// Calls `f` with the start of a step.
fn with_start<F: InLists, T>(
    StepStart { flow, x, time, values, reference, .. }: &StepStart<'_, F>,
    h: f64,
    f: impl FnOnce(&Start<'_, F::Lengths>) -> T,
) -> T {
    let parts = &Parts::of(model(*flow));
    let accumulated_error = accumulated::<F::Lengths>([values, reference]);
    f(&Start { parts, x, time: *time, h, values: values.clone(), accumulated_error })
}

/// A step of a flow.
fn taken<F: InLists>(step: Step<F::Lengths>) -> Taken<F> {
    let Step { x, values, evidence, effort } = step;
    Taken { x, values, evidence, effort }
}

/// The refusal of a step that failed.
fn refusal(effort: Effort, cause: Cause, time: f64, h: f64) -> Refusal {
    Refusal { effort, error: cause.first_law(time, h), second_law: false }
}

/// The laws that an implicit method keeps.
fn promises(flow: &impl Flow) -> Promises {
    Promises::all_laws(flow.entropy_law() == SecondLaw::Exact)
}

impl<F: InLists> Stepper<F> for Midpoint {
    type Memory = MidpointNumbers<F::Lengths>;

    const HAS_DEFAULT_BETWEEN: bool = true;

    fn name(&self) -> String {
        (self.name)()
    }

    fn order(&self) -> u32 {
        2
    }

    fn promises(&self, flow: &F) -> Promises {
        promises(flow)
    }

    fn serves(&self, flow: &F) -> Result<(), MethodError> {
        let known = self.line.ok_or(NoImplicitSteps::Scheme);
        known.and_then(|line| refuse(flow.system(), line.path)).map_err(MethodError::new)
    }

    fn step(
        &self,
        start: &StepStart<'_, F>,
        h: f64,
        memory: &mut Self::Memory,
    ) -> Result<Taken<F>, StepError> {
        let around = &OfFlow(start.flow);
        with_start(start, h, |start| self.take(start, memory, around)).map(taken)
    }

    fn attempt(
        &self,
        start: &StepStart<'_, F>,
        h: f64,
        memory: &mut Self::Memory,
    ) -> Result<Taken<F>, Refusal> {
        let (time, around) = (start.time, &OfFlow(start.flow));
        let tried = with_start(start, h, |start| {
            self.try_step(start, memory, around, Fallbacks::FirstTries)
        });
        tried.map(taken).map_err(|failed| refusal(failed.effort, failed.cause, time, h))
    }
}

impl<F: InLists> Stepper<F> for Collocation {
    type Memory = StageNumbers<F::Lengths>;

    fn name(&self) -> String {
        let Tableau { stages, one_sided, .. } = self.tableau;
        let family = if *one_sided { "Radau" } else { "Gauss" };
        format!("{family}::<{stages}>")
    }

    fn order(&self) -> u32 {
        self.tableau.order
    }

    fn control(&self) -> Control {
        control(self.tableau)
    }

    fn damps(&self) -> bool {
        self.tableau.one_sided
    }

    fn promises(&self, flow: &F) -> Promises {
        promises(flow)
    }

    fn serves(&self, flow: &F) -> Result<(), MethodError> {
        refuse(flow.system(), Path::Chart).map_err(MethodError::new)
    }

    fn step(
        &self,
        start: &StepStart<'_, F>,
        h: f64,
        memory: &mut Self::Memory,
    ) -> Result<Taken<F>, StepError> {
        let around = &OfFlow(start.flow);
        with_start(start, h, |start| self.take(start, memory, around)).map(taken)
    }

    fn attempt(
        &self,
        start: &StepStart<'_, F>,
        h: f64,
        memory: &mut Self::Memory,
    ) -> Result<Taken<F>, Refusal> {
        let (time, around) = (start.time, &OfFlow(start.flow));
        let tried = with_start(start, h, |start| {
            self.try_step(start, memory, around, Fallbacks::FirstTries)
        });
        tried.map(taken).map_err(|failed| refusal(failed.effort, failed.cause, time, h))
    }

    fn error(
        &self,
        &StepEnds { flow, x, end, h, .. }: &StepEnds<'_, F>,
        memory: &Self::Memory,
        norm: impl Fn(&F::Vector) -> f64,
    ) -> Option<f64> {
        self.error_of_step(&Parts::of(model(flow)), [x, end], h, memory, norm)
    }

    /// The end of a step of size `θh`, guessed by the polynomial of the whole one, and moved onto the laws of the run.
    fn between(
        &self,
        step: &StepEnds<'_, F>,
        memory: &mut Self::Memory,
        theta: f64,
    ) -> Option<Element<F>> {
        let &StepEnds { flow, x, end, h, values, reference } = step;
        if theta <= 0.0 || x == end {
            return Some(x.clone());
        }
        if theta >= 1.0 {
            return Some(end.clone());
        }
        let parts = &Parts::of(model(flow));
        let nothing = drift::nothing::<F::Lengths>(reference);
        let values = values[0].clone();
        let start = Start { parts, x, time: 0.0, h, values, accumulated_error: nothing };
        let y = self.part_of_step(&start, memory, theta)?;
        let q = parts.between(x, end);
        let line = || parts.moved(x, &parts.vector(|i| q[i] * theta));
        let promises = promises(flow);
        let within = Within { tableau: self.tableau, step, theta };
        let entropy = promises.entropy.then(|| within.entropy(parts.laws(&y).entropy));
        let target = dense::Target::new(step, promises, theta, entropy);
        Some(target.reached_from(&y, line))
    }
}

/// A scheme in plain numbers.
pub(crate) fn midpoint<R, W>(&Scheme { newton, splits, .. }: &Scheme<R, W>) -> Midpoint
where
    R: Retraction<Euclidean<1>, Canonical>,
    W: DiscreteGradient,
{
    let line = R::PATH.zip(W::KIND);
    let line = line.map(|(path, gradient)| PathOfStep { path, gradient });
    Midpoint { name: scheme_name::<R, W>, line, newton, splits }
}

/// The scheme of a system of one's own. A step asks its [model](Equations::model).
impl<S: Equations, R, W> Stepper<FromEquations<S>> for Scheme<R, W>
where
    R: Retraction<Euclidean<1>, Canonical>,
    W: DiscreteGradient,
{
    type Memory = MidpointNumbers<AtRunTime>;

    const HAS_DEFAULT_BETWEEN: bool = true;

    const IS_IMPLICIT: bool = true;

    fn compiled(&self) -> Option<Compiled> {
        let Midpoint { name, line, newton, splits } = midpoint(self);
        Some(Compiled::Midpoint { name, line: line?, newton, splits })
    }

    passed_on!(FromEquations<S>, this => midpoint(this));
}

impl Collocation {
    /// The Gauss method of so many stages.
    pub(crate) fn gauss(stages: usize) -> Option<Self> {
        let tableau = GAUSS.get(stages.checked_sub(1)?)?;
        Some(Self { tableau, splits: Gauss::<1>::SPLITS })
    }

    /// The Radau method of so many stages.
    pub(crate) fn radau(stages: usize) -> Option<Self> {
        let tableau = RADAU.get(stages.checked_sub(2)?)?;
        Some(Self { tableau, splits: Radau::<2>::SPLITS })
    }
}

macro_rules! of_stages {
    ($($name:ident),*) => {$(
        impl<const S: usize> $name<S> {
            /// The method in plain numbers.
            pub(crate) fn in_numbers() -> Collocation {
                Collocation { tableau: Self::tableau(), splits: Self::SPLITS }
            }
        }

        /// The method for a system of one's own. A step asks its [model](Equations::model).
        impl<S: Equations, const STAGES: usize> Stepper<FromEquations<S>> for $name<STAGES> {
            type Memory = StageNumbers<AtRunTime>;

            const IS_IMPLICIT: bool = true;

            fn compiled(&self) -> Option<Compiled> {
                Some(Compiled::$name { stages: STAGES })
            }

            passed_on!(FromEquations<S>, _this => Self::in_numbers());
        }
    )*};
}
of_stages!(Gauss, Radau);

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use metriplectic_dynamics::system::Point;
    use metriplectic_dynamics::{InNumbers, Metriplectic, Symplectic, System};
    use metriplectic_equations::{Apart, Covectors, Differences, ENERGY, ENTROPY, Part, Sizes};
    use metriplectic_fields::Real;
    use metriplectic_manifolds::{
        ChartMidpoint, Euclidean, Exponential, LieDual, Manifold, Product, WeylMidpoint,
    };
    use nalgebra::{SVector, Vector1, Vector3, vector};
    use num_dual::DualNum as _;

    use super::*;
    use crate::step::Inlined;
    use crate::{
        ItohAbe, MeanValue, Method, RunError, Schedule, Span, SymmetricItohAbe, Watch as _,
    };

    /// Asserts that a system in numbers takes the steps of its types, up to roundings of its states, which are of order 1. Projections
    /// off further invariants are rounded in another order.
    fn agree<Y, N>(system: &Y, x: &Point<Y>, schedule: Schedule, method: N)
    where
        Y: Metriplectic,
        N: Method<Y> + for<'a> Method<FromEquations<InNumbers<'a, Y>>> + Copy,
    {
        let typed = Inlined(method).run(system, x.clone(), schedule.clone()).unwrap();
        let numbers = FromEquations(InNumbers(system));
        let run = method.run(&numbers, Y::Manifold::entries(x).into(), schedule).unwrap();
        let name = Stepper::<Y>::name(&method);
        let [typed_one, here] = [typed.certificate(), run.certificate()];
        assert_eq!(here.steps, typed_one.steps, "{name}");
        assert!(here.keeps_energy() && here.keeps_entropy() == typed_one.keeps_entropy(), "{here}");
        assert_eq!(run.states().len(), typed.states().len());
        for (typed, run) in typed.states().iter().zip(run.states()) {
            let typed = Y::Manifold::entries(&typed.point);
            let off = typed.iter().zip(&run.point).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 1e-13, "{off} by {name} after {} steps", run.step);
        }
    }

    fn both_agree<Y, N>(system: &Y, x: &Point<Y>, h: f64, method: N)
    where
        Y: Metriplectic,
        N: Method<Y> + for<'a> Method<FromEquations<InNumbers<'a, Y>>> + Copy,
    {
        agree(system, x, Span::steps(h, 40).into(), method);
        agree(system, x, Span::until(20.0 * h).tolerance(1e-4).output_every(3.0 * h), method);
    }

    fn all_agree<Y: Metriplectic>(system: &Y, x: &Point<Y>, h: f64) {
        both_agree(system, x, h, WeylMidpoint);
        both_agree(system, x, h, Scheme::new(Exponential).gradient(MeanValue));
        both_agree(system, x, h, Scheme::new(ChartMidpoint).gradient(ItohAbe));
        both_agree(system, x, h, Scheme::new(WeylMidpoint).gradient(SymmetricItohAbe));
        both_agree(system, x, h, Gauss::<3>);
        both_agree(system, x, h, Radau::<2>);
    }

    /// Oscillators in a row with springs that harden, whose vectors of the bracket are counted.
    struct Row {
        count: usize,
        asked: AtomicUsize,
        /// The state of the first one beyond which it panics.
        most: f64,
    }

    impl Row {
        fn of(count: usize, most: f64) -> Differences<Self> {
            Differences(Self { count, asked: AtomicUsize::new(0), most })
        }

        fn at(&self, x: &[f64], i: usize) -> f64 {
            if i == 0 || i > self.count { 0.0 } else { x[i - 1] }
        }
    }

    impl Equations for Row {
        fn sizes(&self) -> Sizes {
            Sizes { entries: 2 * self.count, directions: 2 * self.count, laws: 2 }
        }

        fn values(&self, _: f64, x: &[f64], values: &mut [f64]) {
            let spring = |i| self.at(x, i + 1) - self.at(x, i);
            let springs =
                (0..=self.count).map(|i| 0.5 * spring(i).powi(2) + 0.25 * spring(i).powi(4));
            let motion = x[self.count..].iter().map(|p| 0.5 * p * p);
            values[ENERGY] = springs.chain(motion).sum();
            values[ENTROPY] = 0.0;
        }

        fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
            self.values(t, x, values);
            w.fill(0.0);
            let force = |i: usize| {
                let d = self.at(x, i + 1) - self.at(x, i);
                d + d.powi(3)
            };
            for i in 0..self.count {
                w[i] = force(i) - force(i + 1);
                w[self.count + i] = x[self.count + i];
            }
        }

        fn velocity(&self, t: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
            let (mut values, mut w) = ([0.0; 2], vec![0.0; 2 * x.len()]);
            self.differentials(t, x, &mut values, &mut w);
            let (energy, entropy) = w.split_at(x.len());
            self.apply(Part::Reversible, t, x, Covectors { energy, entropy }, energy, v);
            Some(0.0)
        }
    }

    impl Apart for Row {
        fn is_zero(&self, part: Part) -> bool {
            part != Part::Reversible
        }

        fn apply(
            &self,
            _: Part,
            _: f64,
            x: &[f64],
            _: Covectors<'_>,
            alpha: &[f64],
            v: &mut [f64],
        ) {
            assert!(x[0] <= self.most, "it is torn");
            self.asked.fetch_add(1, Ordering::Relaxed);
            let (q, p) = v.split_at_mut(self.count);
            q.copy_from_slice(&alpha[self.count..]);
            p.iter_mut().zip(alpha).for_each(|(p, alpha)| *p = -alpha);
        }
    }

    fn bent(i: usize, count: usize) -> f64 {
        if i < count { 0.3 * (i as f64 * 0.7).sin() } else { 0.1 * (i as f64).cos() }
    }

    #[test]
    fn derivatives_of_many_variables_serve_many_steps() {
        let row = FromEquations(Row::of(12, f64::INFINITY));
        let asked = || row.0.0.asked.load(Ordering::Relaxed);
        let start = || (0..24).map(|i| bent(i, 12)).collect();
        let run = |steps| {
            let before = asked();
            let run = Gauss::<2>.run(&row, start(), Span::steps(0.05, steps)).unwrap();
            assert!(run.certificate().keeps_energy(), "{}", run.certificate());
            asked() - before
        };
        // Derivatives ask for 24 vectors of the tensor, and for 48 each along the state and a covector.
        let of_a_step = (run(60) - run(20)) / 40;
        println!("{of_a_step} vectors in a step");
        assert!(of_a_step < 60, "{of_a_step}");
    }

    #[test]
    fn a_panic_on_the_way_keeps_the_states_before_it() {
        let mut torn = 0;
        for k in 10..35 {
            // The first oscillator moves to about 0.28.
            let most = 0.01 * f64::from(k);
            let row = FromEquations(Row::of(2, most));
            let start = || vec![0.0, 0.1, 0.3, 0.1].into();
            let schedules: [Schedule; 2] =
                [Span::steps(0.1, 20).into(), Span::until(2.0).tolerance(1e-6).into()];
            for schedule in schedules {
                let runs = [
                    Gauss::<2>.run(&row, start(), schedule.clone()),
                    WeylMidpoint.run(&row, start(), schedule),
                ];
                for run in runs {
                    match run {
                        Err(RunError::Step { trajectory, .. }) => {
                            assert!(!trajectory.states().is_empty());
                            torn += 1;
                        }
                        // Its start is judged around it, by a tenth of the size of the motion.
                        Err(RunError::Flow(_)) if most < 0.12 => {}
                        Ok(run) => assert!(run.states().iter().all(|s| s.point[0] <= most)),
                        Err(error) => panic!("{most}: {error:?}"),
                    }
                }
            }
        }
        println!("{torn} runs were torn");
        assert!(torn > 10, "{torn}");
    }

    #[test]
    fn a_system_in_numbers_takes_the_steps_of_its_types() {
        // A rotor with its heat, and with a momentum that friction keeps.
        let rotor = System::on(Product(LieDual::so3(), Euclidean::<1>))
            .bracket((
                metriplectic_dynamics::bracket::LiePoisson,
                metriplectic_dynamics::bracket::Zero,
            ))
            .energy(|(p, s): &(Vector3<Real>, Vector1<Real>)| {
                p.x * p.x * 0.5 + p.y.powi(4) * 0.3 + p.z * p.z * 1.5 + s.x.exp()
            })
            .entropy(|(_, s): &(Vector3<Real>, Vector1<Real>)| s.x)
            .casimir(|(p, _): &(Vector3<Real>, Vector1<Real>)| p.norm_squared())
            .build()
            .unwrap();
        all_agree(&rotor, &(vector![0.4, -1.0, 0.3], vector![0.2]), 0.1);
        let planar = System::on(Euclidean::<4>)
            .bracket(Symplectic)
            .energy(|x: &SVector<Real, 4>| {
                (x[2] * x[2] + x[3] * x[3]) * 0.5 + (x[0] * x[0] + x[1] * x[1]).powi(2) * 0.25
            })
            .momentum(|x: &SVector<Real, 4>| x[0] * x[3] - x[1] * x[2])
            .build()
            .unwrap();
        all_agree(&planar, &vector![1.0, 0.2, -0.3, 0.7], 0.1);
        // Twelve masses in a row.
        let chain = System::on(Euclidean::<24>)
            .bracket(Symplectic)
            .energy(|x: &SVector<Real, 24>| {
                let springs = (0..13).map(|i| {
                    let at = |i: usize| if i == 0 || i > 12 { 0.0.into() } else { x[i - 1] };
                    let d = at(i + 1) - at(i);
                    d * d * 0.5 + d.powi(4) * 0.25
                });
                let moving = (12..24).map(|i| x[i] * x[i] * 0.5);
                springs.chain(moving).fold(Real::from(0.0), |sum, term| sum + term)
            })
            .build()
            .unwrap();
        let x = SVector::<f64, 24>::from_fn(|i, _| 0.5 * (i as f64 * 1.7).sin());
        agree(&chain, &x, Span::steps(0.1, 20).into(), WeylMidpoint);
        agree(&chain, &x, Span::steps(0.1, 10).into(), Gauss::<2>);
        // Derivatives that serve many steps go on in a run that is taken up again.
        let numbers = FromEquations(InNumbers(&chain));
        let (start, span) = (x.as_slice().into(), Span::steps(0.1, 30));
        let whole = Gauss::<2>.run(&numbers, start, span).unwrap();
        let mut steps = Gauss::<2>.steps(&numbers, x.as_slice().into(), span).unwrap();
        for _ in 0..13 {
            steps.advance().unwrap();
        }
        let checkpoint = steps.checkpoint();
        let resumed = Gauss::<2>.resume(&numbers, &checkpoint).unwrap().run().unwrap();
        assert_eq!(resumed.last(), whole.last());
        assert_eq!(resumed.certificate(), whole.certificate());
    }
}
