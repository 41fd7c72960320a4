//! A system in plain numbers is a flow, of a size that is known at run time.

mod answered;
mod kept;
mod lengths;
mod of_length;
mod projection;
mod referred_rise;
mod rows;
mod stages;

use std::fmt;
use std::sync::Arc;

use metriplectic_dynamics::invariants::Kind;
use metriplectic_dynamics::{Erase, ModelError, SecondLaw};
use metriplectic_equations::judge::{Judge, RADIUS};
use metriplectic_equations::{ENERGY, ENTROPY, Equations, Evaluated, Report, VerifiedEquations};
use metriplectic_manifolds::PointError;

pub(crate) use self::answered::{Answered, InTypes};
pub(crate) use self::kept::Kept;
pub(crate) use self::lengths::{AtRunTime, Known, Lengths, List};
pub(crate) use self::of_length::OfLength;
use self::projection::{Aim, Projection, sum};
pub use self::rows::Rows;
use self::rows::laws;
use self::stages::{displacement, entropy_round_off, scales, stage_flow};
use crate::explicit::{Projected, ProjectionError, StageFlow, Target};
use crate::step::{
    Directions, Element, Entries, Flow, FlowVisitor, Laws, Listed, PlainNumbers, Recheck, Values,
    Vector as _, Written,
};
use crate::system::{NO_CLOCK, least_dependent, recheck};

/// The flow of a system that answers [`Equations`]: one of your own, or one whose number of variables is read from a file.
///
/// Explicit methods run it, and implicit ones if its parts are known apart
/// ([`Differences`](metriplectic_equations::Differences)), with all that a run does: tolerances, outputs, events and their jumps, certificates, checkpoints,
/// observables and sweeps. `H` and the further invariants are kept to round-off, and `S` never falls. A panic in the system is an
/// error of its run ([`Panicked`](crate::Panicked)), which keeps the states before a step in which it happens. `S` may be behind a
/// pointer: `FromEquations<Box<dyn Equations>>` is a type that a struct can name, for every system.
///
/// A hundred oscillators with springs to their neighbours:
///
/// ```
/// use metriplectic_equations::{ENERGY, ENTROPY, Equations, Sizes};
/// use metriplectic_integrators::{DormandPrince8, FromEquations, Method as _, Span};
///
/// /// `H = Σ ½p² + Σ ½(q_{i+1} − q_i)²`, with both ends fixed.
/// struct Oscillators(usize);
///
/// impl Oscillators {
///     fn extension(&self, x: &[f64], i: usize) -> f64 {
///         let at = |i: usize| if i == 0 || i > self.0 { 0.0 } else { x[i - 1] };
///         at(i + 1) - at(i)
///     }
///
///     fn force(&self, x: &[f64], i: usize) -> f64 {
///         self.extension(x, i + 1) - self.extension(x, i)
///     }
/// }
///
/// impl Equations for Oscillators {
///     fn sizes(&self) -> Sizes {
///         Sizes { entries: 2 * self.0, directions: 2 * self.0, laws: 2 }
///     }
///
///     fn values(&self, _: f64, x: &[f64], values: &mut [f64]) {
///         let springs: f64 = (0..=self.0).map(|i| 0.5 * self.extension(x, i).powi(2)).sum();
///         values[ENERGY] = springs + x[self.0..].iter().map(|p| 0.5 * p * p).sum::<f64>();
///         values[ENTROPY] = 0.0;
///     }
///
///     fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
///         self.values(t, x, values);
///         w.fill(0.0);
///         (0..self.0).for_each(|i| w[i] = -self.force(x, i));
///         w[self.0..2 * self.0].copy_from_slice(&x[self.0..]);
///     }
///
///     fn velocity(&self, _: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
///         v[..self.0].copy_from_slice(&x[self.0..]);
///         (0..self.0).for_each(|i| v[self.0 + i] = self.force(x, i));
///         Some(0.0)
///     }
/// }
///
/// // The second mode.
/// let mode = |i: usize| (std::f64::consts::TAU * (i + 1) as f64 / 101.0).sin();
/// let start = (0..200).map(|i| if i < 100 { mode(i) } else { 0.0 }).collect();
/// let chain = FromEquations(Oscillators(100));
/// let run = DormandPrince8.run(&chain, start, Span::until(50.0).tolerance(1e-8))?;
/// assert!(run.certificate().max_relative_energy_error() < 1e-14);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy)]
pub struct FromEquations<S>(pub S);

// By hand, because systems have no `Debug`.
impl<S> fmt::Debug for FromEquations<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("FromEquations").finish_non_exhaustive()
    }
}

impl<S: Equations> FromEquations<S> {
    /// Checks the laws of the system around a state: the [model](Equations::model) if its parts are known, and the
    /// velocity and the differentials if they are not. A run does this first, with a radius of 0.1.
    ///
    /// # Errors
    ///
    /// [`ModelError`] that names the law, the state and the size of the violation.
    pub fn verify(&self, x0: &[f64], radius: f64) -> Result<(), ModelError> {
        Judge::of(&self.0, NO_CLOCK).verify(x0, radius)?;
        if energy_changes(&self.0, NO_CLOCK, x0) { Err(ModelError::EnergyInTime) } else { Ok(()) }
    }

    /// Lists the residual of every law around a state. Read it when a new system misbehaves.
    pub fn report(&self, x0: &[f64]) -> Report {
        Judge::of(&self.0, NO_CLOCK).report(x0)
    }

    /// Verifies the system around a state, and returns it with this certificate. A run of it, from any start, checks the laws at
    /// that start without samples around it. Use it for a study of many runs.
    ///
    /// # Errors
    ///
    /// The errors of [`verify`](Self::verify).
    pub fn verified(self, x0: &[f64]) -> Result<FromEquations<VerifiedEquations<S>>, ModelError> {
        let verified = VerifiedEquations::around(self.0, x0)?;
        if energy_changes(&verified, NO_CLOCK, x0) {
            return Err(ModelError::EnergyInTime);
        }
        Ok(FromEquations(verified))
    }
}

impl<S: Equations + Send + Sync + 'static> Erase for FromEquations<S> {
    type Erased = FromEquations<Arc<dyn Equations + Send + Sync>>;

    /// Moves the whole system behind a pointer.
    fn erased(self) -> Self::Erased {
        FromEquations(Arc::new(self.0))
    }
}

/// Returns whether the energy of a system depends on time: whether the system says so, or its values at this state change with it.
pub(crate) fn energy_changes(system: &dyn Equations, t: f64, x: &[f64]) -> bool {
    let energy = |t: f64| {
        let mut values = Entries::zeros(system.sizes().laws);
        system.values(t, x, &mut values);
        values[ENERGY]
    };
    let (here, unit) = (energy(t), if t == 0.0 { 1.0 } else { t.abs() });
    let changes = |exponent: i32| {
        let later = energy(t + unit * 2_f64.powi(exponent));
        later.to_bits() != here.to_bits() && later.is_finite()
    };
    system.energy_depends_on_time() || (-20..=20).step_by(5).any(changes)
}

impl<S> FromEquations<S> {
    /// Returns the system that it asks.
    const fn equations(&self) -> &S {
        &self.0
    }
}

impl<S: Equations> Flow for FromEquations<S> {
    type Space = PlainNumbers;
    type Numbers = Values;
    type Vector = Directions;

    fn laws(&self, x: &Entries) -> Laws<Values> {
        let mut values = Entries::zeros(self.0.sizes().laws);
        self.0.values(NO_CLOCK, x, &mut values);
        laws::<AtRunTime>(&values)
    }

    fn term_sizes(&self, x: &Entries) -> Laws<Values> {
        let (rows, scales) = (Rows::<AtRunTime>::of(&self.0, x), scales(&self.0, x));
        let size = |(law, value): (usize, &f64)| {
            value.abs() + sum(&rows.row(law), &scales, |w, scale| w.abs() * scale)
        };
        laws::<AtRunTime>(&rows.values().iter().enumerate().map(size).collect::<Entries>())
    }

    fn rates(&self, x: &Entries, d: &Directions) -> Option<Directions> {
        let y = self.stage(x, d)?;
        let (v, _) = self.motion(&y)?;
        Some(self.stage_rates(x, (d, &y), &v))
    }

    fn sizes(&self, x: &Entries) -> Directions {
        scales(&self.0, x)
    }

    fn moved(&self, x: &Entries, d: &Directions) -> Entries {
        let mut y = Entries::zeros(x.len());
        self.0.chart(x, d.numbers(), &mut y);
        y
    }

    fn displacement(&self, x: &Entries, y: &Entries) -> Option<Directions> {
        displacement(&self.0, x, y)
    }

    fn production(&self, x: &Entries) -> Option<f64> {
        self.motion(x).map(|(_, production)| production)
    }

    fn onto(&self, y: &Entries, laws: &Laws<Values>, entropy: Option<f64>) -> Option<Entries> {
        let laws = Laws { entropy: entropy.unwrap_or(laws.entropy), ..laws.clone() };
        let with_entropy = entropy.is_some();
        let target = Target { laws: &laws, with_entropy, limit: None, units: None, error: None };
        self.project(y.clone(), &target).ok().map(|end| end.x)
    }

    fn element(&self, entries: &[f64]) -> Result<Entries, PointError> {
        let (found, expected) = (entries.len(), self.0.sizes().entries);
        if found != expected {
            return Err(PointError::Length { found, expected });
        }
        self.0.check(entries)?;
        Ok(entries.into())
    }

    fn entropy_law(&self) -> SecondLaw {
        self.0.second_law()
    }

    fn evaluated(&self, x: &Entries) -> Vec<Evaluated> {
        self.0.evaluated(x)
    }

    fn kinds(&self) -> Vec<Kind> {
        (0..self.0.sizes().laws.saturating_sub(ENTROPY + 1))
            .map(|invariant| self.0.kind(invariant))
            .collect()
    }

    fn check(&self, x0: &Entries) -> Result<(), ModelError> {
        if self.0.is_verified() {
            Judge::of(&self.0, NO_CLOCK).check_start(x0)
        } else {
            self.verify(x0, RADIUS)
        }
    }

    fn is_verified(&self) -> bool {
        self.0.is_verified()
    }

    fn rechecks(&self, _: Recheck) -> bool {
        true
    }

    fn recheck(&self, x: &Entries, occasion: Recheck) -> Result<(), ModelError> {
        match occasion {
            // At states ahead the functions of the system may panic, which would hide the error of the step.
            Recheck::Failure { .. } => Judge::of(&self.0, NO_CLOCK).check_around(x, &[]),
            _ => recheck(&self.0, x, occasion),
        }
    }

    fn defect(&self, x: &Entries) -> f64 {
        self.0.defect(x)
    }

    fn dependent_invariant(&self, x: &Entries) -> Option<(usize, f64)> {
        let mut fractions = vec![0.0; self.0.sizes().laws.saturating_sub(ENTROPY + 1)];
        self.0.model()?.independence(NO_CLOCK, x, &mut fractions);
        least_dependent(fractions)
    }

    /// The estimate of the local error by the rates in the chart of a stage, as for systems in types.
    fn local_error(&self, x: &Entries, end: &Entries, h: f64) -> Option<Directions> {
        let mut q = Directions::zeros(self.0.sizes().directions);
        self.0.stage_coordinates(x, end, q.numbers_mut());
        let (start, there) = (self.rates(x, &q.map(|_| 0.0))?, self.rates(x, &q)?);
        let middle =
            Directions::zip([&q, &start, &there], |[q, a, b]| q * 0.5 - (b - a) * (h / 8.0));
        let middle = self.rates(x, &middle)?;
        let error = Directions::zip([&q, &start, &middle, &there], |[q, a, m, b]| {
            q - (a + m * 4.0 + b) * (h / 6.0)
        });
        Some(error)
    }

    fn visit<V: FlowVisitor<Self>>(&self, visitor: V) -> V::Output {
        visitor.own(self, &self.0)
    }

    fn entropy_round_off(&self, [x, y]: [&Entries; 2]) -> f64 {
        if let Some(model) = self.0.model() {
            let mut w = Directions::zeros(self.0.sizes().directions);
            let value = model.jet(ENTROPY, NO_CLOCK, y, w.numbers_mut());
            return entropy_round_off::<AtRunTime>(&self.0, [x, y], (value, &w));
        }
        let rows = Rows::<AtRunTime>::of(&self.0, y);
        entropy_round_off::<AtRunTime>(
            &self.0,
            [x, y],
            (rows.values()[ENTROPY], &rows.row(ENTROPY)),
        )
    }
}

impl<S: Equations> Listed for FromEquations<S> {
    const CATCHES_PANICS: bool = true;

    type Layout = ();

    fn layout(&self) -> &() {
        &()
    }

    fn read((): &(), entries: &[f64]) -> Entries {
        entries.into()
    }

    fn write(x: &Entries) -> Entries {
        x.clone()
    }
}

impl<S: Equations> Written for FromEquations<S> {
    fn vector(directions: &Directions) -> Directions {
        directions.clone()
    }

    fn directions(v: &Directions) -> Directions {
        v.clone()
    }

    fn numbers(values: &Values) -> Values {
        values.clone()
    }
}

stage_flow!([S: Equations] FromEquations<S>, AtRunTime);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        DormandPrince5, DormandPrince8, Method, Panicked, RunError, RungeKuttaChebyshev, Schedule,
        Span, StepError,
    };
    use metriplectic_dynamics::bracket::{AreaForm, Zero};
    use metriplectic_dynamics::{InNumbers, Metriplectic, System, Verify as _, system::Point};
    use metriplectic_equations::Sizes;
    use metriplectic_fields::Real;
    use metriplectic_manifolds::{Euclidean, LieDual, Manifold, Product, Sphere};
    use nalgebra::{Vector1, Vector3, vector};
    use num_dual::DualNum as _;

    fn body() -> impl Metriplectic<Manifold = LieDual<3>> {
        System::on(LieDual::so3())
            .energy(|p: &Vector3<Real>| p.x * p.x * 0.05 + p.y * p.y * 0.1 + p.z * p.z * 0.5)
            .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
            .build()
            .unwrap()
    }

    /// A spin on S² with its heat.
    fn spin() -> impl Metriplectic<Manifold = Product<Sphere<2>, Euclidean<1>>> {
        System::on(Product(Sphere::<2>::round(), Euclidean::<1>))
            .bracket((AreaForm, Zero))
            .energy(|(n, s): &(Vector3<Real>, Vector1<Real>)| {
                n.x * n.x * 0.5 + n.y * n.y * 0.25 - n.z * 0.4 + s.x.exp()
            })
            .entropy(|(_, s): &(Vector3<Real>, Vector1<Real>)| s.x)
            .build()
            .unwrap()
    }

    /// The bits of both ways.
    fn bits<Y, N>(system: &Y, x: &Point<Y>, method: N) -> [Vec<u64>; 2]
    where
        Y: Metriplectic,
        N: Method<Y> + for<'a> Method<FromEquations<InNumbers<'a, Y>>> + Copy,
    {
        let span = || Span::steps(0.1, 25);
        let typed = method.run(system, x.clone(), span()).unwrap();
        let numbers = FromEquations(InNumbers(system));
        let run = method.run(&numbers, Y::Manifold::entries(x).into(), span()).unwrap();
        assert!(run.certificate().max_relative_energy_error() < 1e-15);
        let bits = |x: &[f64]| x.iter().map(|x| x.to_bits()).collect();
        [bits(&Y::Manifold::entries(&typed.last().point)), bits(&run.last().point)]
    }

    #[test]
    fn a_system_in_numbers_runs_with_the_bits_of_its_types() {
        let (start, spun) = (vector![0.4, -1.0, 0.3], (vector![0.6, 0.0, 0.8], vector![0.2]));
        for [typed, numbers] in [
            bits(&body(), &start, DormandPrince8),
            bits(&body(), &start, DormandPrince5),
            bits(&body(), &start, RungeKuttaChebyshev),
            bits(&spin(), &spun, DormandPrince8),
            bits(&spin(), &spun, DormandPrince5),
        ] {
            assert_eq!(typed, numbers);
        }
    }

    #[test]
    fn a_boxed_system_follows_a_tolerance_to_the_end_of_its_types() {
        /// A field of a struct, for any system.
        struct Holder<'a> {
            system: FromEquations<Box<dyn Equations + 'a>>,
        }
        let (body, start) = (body(), vector![0.4, -1.0, 0.3]);
        let kept = body.verified(&start).unwrap();
        assert!(FromEquations(InNumbers(&kept)).is_verified());
        assert!(!FromEquations(InNumbers(&body)).is_verified());
        let holder = Holder { system: FromEquations(Box::new(InNumbers(&body))) };
        let span = || Span::until(5.0).tolerance(1e-9);
        let typed = DormandPrince8.run(&body, start, span()).unwrap();
        let run = DormandPrince8.run(&holder.system, [0.4, -1.0, 0.3].into(), span()).unwrap();
        let (a, b) = (typed.last(), run.last());
        let off = a.point.iter().zip(&b.point).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-7 && b.entropy > run.states()[0].entropy, "{off}");
        let run = run.certificate();
        assert!(run.max_relative_energy_error() < 1e-15 && run.keeps_entropy(), "{run}");
    }

    /// A damped oscillator `q' = p, p' = −q − γp, s' = γp²` at the temperature 1, with a fault.
    struct Damped(fn(&mut [f64], &mut f64));

    impl Equations for Damped {
        fn sizes(&self) -> Sizes {
            Sizes { entries: 3, directions: 3, laws: 2 }
        }

        fn values(&self, _: f64, x: &[f64], values: &mut [f64]) {
            values[ENERGY] = 0.5 * (x[0] * x[0] + x[1] * x[1]) + x[2];
            values[ENTROPY] = x[2];
        }

        fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
            self.values(t, x, values);
            w.copy_from_slice(&[x[0], x[1], 1.0, 0.0, 0.0, 1.0]);
        }

        fn velocity(&self, _: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
            let mut production = 0.1 * x[1] * x[1];
            v.copy_from_slice(&[x[1], -x[0] - 0.1 * x[1], production]);
            (self.0)(v, &mut production);
            Some(production)
        }

        fn second_law(&self) -> SecondLaw {
            SecondLaw::Exact
        }
    }

    #[test]
    fn a_panic_in_a_system_is_an_error_that_keeps_the_states_so_far() {
        // The force is about −q: it rises through 1/2 soon after t = 2.
        let weak = |v: &mut [f64], _: &mut f64| assert!(v[1] < 0.5, "it is drawn by {}", v[1]);
        let run = |fault, schedule: Schedule| {
            DormandPrince8.run(&FromEquations(Damped(fault)), [1.0, 0.0, 0.0].into(), schedule)
        };
        for schedule in [Span::until(5.0).tolerance(1e-8).into(), Span::steps(0.1, 50).into()] {
            let Err(RunError::Step { cause: StepError::Flow { time, law }, trajectory }) =
                run(weak, schedule)
            else {
                panic!("it has no error of its own")
            };
            let Panicked { message, .. } = law.downcast_ref().unwrap();
            assert!(message.starts_with("it is drawn by 0."), "{message}");
            assert_eq!(trajectory.last().time.to_bits(), time.to_bits());
            assert!((1.0..2.5).contains(&time), "{time}");
        }
        let error = run(|_, _| panic!("at once"), Span::steps(0.1, 50).into()).unwrap_err();
        let RunError::Flow(error) = error else { panic!("{error}") };
        assert_eq!(error.to_string(), "it has panicked: at once");
    }

    #[test]
    fn a_system_of_ones_own_is_judged_by_its_motion() {
        let run = |fault| {
            let system = FromEquations(Damped(fault));
            DormandPrince8.run(&system, [1.0, 0.0, 0.0].into(), Span::until(5.0).tolerance(1e-8))
        };
        let sound = run(|_, _| {}).unwrap();
        assert!(sound.certificate().keeps_entropy() && !sound.certificate().verified_before);
        let x0 = vec![1.0, 0.0, 0.0];
        let kept = FromEquations(Damped(|_, _| {})).verified(&x0).unwrap();
        let again = DormandPrince8.run(&kept, x0.into(), Span::until(5.0).tolerance(1e-8)).unwrap();
        assert!(again.certificate().verified_before && again.last() == sound.last());
        let refusal = |fault| match run(fault) {
            Err(RunError::Model(error)) => error,
            other => panic!("{other:?}"),
        };
        let energy = refusal(|v, _| v[1] += 0.1 * v[0]);
        assert!(matches!(energy, ModelError::MotionChangesEnergy { .. }), "{energy}");
        let production = refusal(|_, production| *production *= 1.01);
        assert!(matches!(production, ModelError::ProductionOff { .. }), "{production}");
        let falls = refusal(|v, production| {
            (v[1], v[2]) = (v[1] + 0.2 * v[0], v[2] - 0.2 * v[0] * v[0]);
            *production = v[2];
        });
        assert!(matches!(falls, ModelError::ProductionNegative { .. }), "{falls}");
        let short = DormandPrince8.run(
            &FromEquations(Damped(|_, _| {})),
            [1.0, 0.0].into(),
            Span::steps(0.1, 1),
        );
        let length = PointError::Length { found: 2, expected: 3 };
        assert!(matches!(short, Err(RunError::Model(ModelError::Start(found))) if found == length));
        let nan = refusal(|v, _| v[0] = f64::NAN);
        assert!(matches!(nan, ModelError::ValueNotFinite { field: "velocity", .. }), "{nan}");
    }
}
