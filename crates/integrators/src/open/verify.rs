//! The laws of the surroundings of a system.

use metriplectic_dynamics::exchange::{Exchange, ExchangeArgs, Part, PartKind, Visitor};
use metriplectic_dynamics::{Metriplectic, ModelError, Report, Verify as _, system::Point};
use metriplectic_equations::judge::RADIUS;
use metriplectic_fields::{ChartPoint, Column as _, Dimension as _, Real, Vector};
use metriplectic_manifolds::{Manifold, MetricAt};

use super::clock::Clock;
use super::state::OpenState;
use super::system::{CovectorsOf, OpenSystem, StateOf};
use super::view::Closed;
use crate::round_off::bound::{NO_DIGITS, size_of_terms};
use crate::step::{CountOf, Flow as _, StepError};

/// The slope of a law along a velocity, relative to its terms, that is no round-off.
/// A factor of four fails `open/verify.rs::a_port_that_carries_a_part_of_an_entropy_is_refused`.
pub(super) const BROKEN: f64 = 1e-8;

struct Judge<'a, Y: Metriplectic, P> {
    w: &'a CovectorsOf<Y>,
    time: f64,
    point: &'a P,
    verdict: Result<(), ModelError>,
    /// The largest slope of the entropy along what a port gives, and of an invariant along what a part gives.
    slopes: [f64; 2],
}

impl<Y: Metriplectic, P: Fn() -> Vec<f64>> Judge<'_, Y, P> {
    fn of_part(
        &mut self,
        part: Part<'_>,
        velocity: &Vector<Y::Manifold>,
        given: &Vector<Y::Manifold>,
    ) -> Result<(), ModelError> {
        let (name, time) = (|| part.name.clone(), self.time);
        let point = self.point;
        if let PartKind::Bath { temperature, least_rate } = part.kind {
            if !(temperature >= 0.0 && temperature.is_finite()) {
                return Err(ModelError::BathNotPositive { bath: name(), temperature, time });
            }
            if least_rate < 0.0 || least_rate.is_nan() {
                return Err(ModelError::FrictionNotPositive {
                    bath: name(),
                    rate: least_rate,
                    time,
                });
            }
        }
        if !(velocity.is_finite() && given.is_finite()) {
            return Err(ModelError::ExchangeNotFinite { part: name(), time, point: point() });
        }
        // 0/0 = 0: a law that nothing changes is kept.
        let slope = |law: &Vector<Y::Manifold>, v: &Vector<Y::Manifold>| {
            let (slope, terms) = (law.dot(v).abs(), Y::Manifold::pairing_size(law, v));
            if slope <= NO_DIGITS { 0.0 } else { slope / terms }
        };
        let carried = slope(&self.w.entropy, given);
        if part.kind == PartKind::Port {
            self.slopes[0] = self.slopes[0].max(carried);
        }
        if part.kind == PartKind::Port && carried > BROKEN {
            let (port, size) = (name(), carried);
            return Err(ModelError::WorkCarriesEntropy { port, time, point: point(), size });
        }
        for (index, (_, law)) in self.w.invariants.as_ref().iter().flatten().enumerate() {
            let size = slope(law, given);
            self.slopes[1] = self.slopes[1].max(size);
            if size > BROKEN {
                let part = name();
                return Err(ModelError::PortBreaksInvariant {
                    part,
                    index,
                    time,
                    point: point(),
                    size,
                });
            }
        }
        Ok(())
    }
}

impl<Y: Metriplectic, P: Fn() -> Vec<f64>> Visitor<Y::Manifold> for Judge<'_, Y, P> {
    fn visit(
        &mut self,
        part: Part<'_>,
        velocity: &Vector<Y::Manifold, Real>,
        given: &Vector<Y::Manifold, Real>,
    ) {
        if self.verdict.is_ok() {
            self.verdict = self.of_part(part, &velocity.real(), &given.real());
        }
    }
}

/// Differences in a row whose quotients show a derivative.
const AGREEING: usize = 4;
/// The relative difference of quotients that agree.
/// A factor of four fails `open/verify.rs::a_derivative_in_time_that_is_off_by_a_hundredth_is_lost`.
const SAME: f64 = 1e-4;
/// The change of the energy in units of its round-off that shows a quotient.
const CLEAR: f64 = 1e6;

/// The difference of the frozen work of a step and its quadrature, relative to the energies at both ends, that no smooth
/// protocol makes in a step that resolves it.
/// A factor of four fails `open/verify.rs::a_protocol_that_jumps_by_a_thousandth_of_the_energy_is_found`.
const JUMP: f64 = 1e-3;
/// The nodes and weights of the Gauss rule of three points on `[−1, 1]`.
const GAUSS: [(f64, f64); 3] = [
    (-0.774_596_669_241_483_4, 5.0 / 18.0),
    (0.0, 4.0 / 9.0),
    (0.774_596_669_241_483_4, 5.0 / 18.0),
];

impl<Y, C, X> OpenSystem<Y, C, X>
where
    Y: Metriplectic,
    C: Clock<Y::Manifold, Y::Energy>,
    X: Exchange<Y::Manifold, Y::Metric>,
{
    /// Checks the laws of the system around a state, at its time, with the clock, the ports and the baths there. A run does
    /// this first, with a radius of 0.1; see [`Verify::verify`](metriplectic_dynamics::Verify::verify).
    ///
    /// # Errors
    ///
    /// [`ModelError`] that names the law, the state and the size of the violation.
    pub fn verify(&self, x0: &OpenState<Point<Y>>, radius: f64) -> Result<(), ModelError> {
        self.judged(x0, |model, x| model.verify(x, radius))
    }

    /// Lists the residual of every law of the model around a state, at its time, and of its surroundings there. Read it
    /// when a new model misbehaves.
    pub fn report(&self, x0: &OpenState<Point<Y>>) -> Report {
        let mut report = self.without_exchange(x0.time).report(&x0.x);
        if report.verdict.is_ok() {
            match self.slopes_of_exchange(x0) {
                Ok(slopes) => {
                    let laws = [("⟨dS, F⟩ = 0", X::PORTS), ("⟨dL, F⟩ = 0", X::PORTS + X::BATHS)];
                    let asked = [1, CountOf::<Y>::LEN];
                    for (((law, parts), asked), size) in laws.into_iter().zip(asked).zip(slopes) {
                        if parts * asked > 0 {
                            report.note(law, size, BROKEN, Y::Manifold::entries(&x0.x));
                        }
                    }
                    report.verdict = self.check_clock(x0);
                }
                Err(broken) => report.verdict = Err(broken),
            }
        }
        report
    }

    /// Verifies the model around a state, and returns the system with this certificate. A run of it, from any start, checks the
    /// laws at that start without samples around it. Use it for a study of many runs.
    ///
    /// # Errors
    ///
    /// The errors of [`verify`](Self::verify).
    pub fn verified(self, x0: &OpenState<Point<Y>>) -> Result<Self, ModelError> {
        self.verify(x0, RADIUS)?;
        Ok(self.with_certificate())
    }

    /// Judges the model without its surroundings, and then these.
    pub(super) fn judged(
        &self,
        x0: &StateOf<Y>,
        judge: impl Fn(&Closed<'_, Y, C>, &Point<Y>) -> Result<(), ModelError>,
    ) -> Result<(), ModelError> {
        let model = self.without_exchange(x0.time);
        match judge(&model, &x0.x) {
            // What flows in gives the energy its size: entries whose squares have no digits are zeros.
            Err(ModelError::Underflow { .. }) => judge(&model, &self.without_tiny(&x0.x)?)?,
            verdict => verdict?,
        }
        self.check_clock(x0)?;
        self.check_exchange(x0)
    }

    /// Checks at a state that ports carry no entropy and keep the further invariants, that no temperature is negative, and that no
    /// friction has a negative rate.
    pub(super) fn check_exchange(&self, state: &StateOf<Y>) -> Result<(), ModelError> {
        self.slopes_of_exchange(state).map(|_| ())
    }

    /// The slopes of the entropy along ports and of the further invariants along all parts, which must be round-off.
    fn slopes_of_exchange(&self, state: &StateOf<Y>) -> Result<[f64; 2], ModelError> {
        if X::PORTS + X::BATHS == 0 {
            return Ok([0.0; 2]);
        }
        let point = || Y::Manifold::entries(&state.x);
        let w = self.covectors(state.time, &state.x);
        let centre = ChartPoint::<Y::Manifold, Real>::centre(&state.x);
        let g = MetricAt::new(self.closed().metric(), &centre);
        let [energy, entropy] = [&w.energy, &w.entropy].map(Vector::<Y::Manifold, Real>::embed);
        let at = ExchangeArgs { t: state.time, g: &g, w: &energy, s: &entropy };
        let (time, verdict) = (state.time, Ok(()));
        let mut judge = Judge::<Y, _> { w: &w, time, point: &point, verdict, slopes: [0.0; 2] };
        let looked_at = self.exchange().each(&at, &mut judge);
        looked_at.map_err(|source| ModelError::Metric { source, point: point() })?;
        judge.verdict.map(|()| judge.slopes)
    }

    /// [Compares](compare_with_values) the derivative of the energy along time with its values.
    pub(super) fn check_clock(&self, state: &StateOf<Y>) -> Result<(), ModelError> {
        if !C::RUNS {
            return Ok(());
        }
        let (t, x) = (state.time, &state.x);
        let terms = |t| size_of_terms::<Y::Manifold>(self.frozen(t).energy(), x);
        let values = |t| self.energy(t, x);
        compare_with_values(t, self.power(t, x), values, terms, || Y::Manifold::entries(x))
    }

    /// Looks for a jump of the energy in time inside a step of a fixed size. Steps that follow a tolerance become small there.
    pub(super) fn check_protocol(&self, [x, end]: [&StateOf<Y>; 2]) -> Result<(), StepError> {
        if !C::RUNS {
            return Ok(());
        }
        let (ends, point, times) = ([x, end], &end.x, [x.time, end.time]);
        let frozen = self.frozen_work(times, point);
        protocol(times, frozen, |t| self.power(t, point), || self.energy_sizes(ends)[0])
    }
}

/// Compares the derivative of an energy along time at the time `t` with its values. Nothing is known of the times of a model, so the
/// differences are taken over intervals of all powers of two; where quotients in a row agree, they are the derivative.
///
/// `terms` is the size of the terms of the energy, and `point` the state, for messages.
///
/// # Errors
///
/// [`ModelError::DerivativeNotFinite`] and [`ModelError::LostTimeDerivative`].
pub fn compare_with_values(
    t: f64,
    derivative: f64,
    energy: impl Fn(f64) -> f64,
    terms: impl Fn(f64) -> f64,
    point: impl Fn() -> Vec<f64>,
) -> Result<(), ModelError> {
    if !derivative.is_finite() {
        return Err(ModelError::DerivativeNotFinite { field: "energy along time", point: point() });
    }
    let (mut agreeing, mut before) = (0, f64::NAN);
    let (here, size_here) = (energy(t), terms(t));
    for exponent in -200..200 {
        // Forward, because the law of motion may have changed at this time.
        let later = t + 2_f64.powi(exponent);
        if later.to_bits() == t.to_bits() {
            continue;
        }
        let change = energy(later) - here;
        let quotient = change / (later - t);
        // A sum of large terms that cancel, as in the bottom of a stiff well, has the round-off of its terms.
        let size = f64::EPSILON * (size_here + terms(later));
        // Behind a pulse all quotients are zero.
        let clear = change.abs() > CLEAR * (size + NO_DIGITS) && quotient.abs() > NO_DIGITS;
        let agrees = clear && (quotient - before).abs() <= SAME * quotient.abs();
        agreeing = if agrees { agreeing + 1 } else { 0 };
        before = if clear { quotient } else { f64::NAN };
        if agreeing == AGREEING {
            if (derivative - quotient).abs() > 1e2 * SAME * quotient.abs() {
                let (time, point) = (t, point());
                return Err(ModelError::LostTimeDerivative { time, point, derivative, quotient });
            }
            return Ok(());
        }
    }
    Ok(())
}

/// Compares the frozen work of a step with the quadrature of its rate, beside the terms of the energy at both ends.
///
/// # Errors
///
/// [`StepError::ProtocolJumps`].
pub(super) fn protocol(
    [t, end]: [f64; 2],
    frozen: f64,
    power: impl Fn(f64) -> f64,
    terms: impl FnOnce() -> f64,
) -> Result<(), StepError> {
    let half = 0.5 * (end - t);
    let quadrature: f64 = GAUSS
        .iter()
        .map(|(node, weight)| 2.0 * half * weight * power(t + half * (1.0 + node)))
        .sum();
    if (frozen - quadrature).abs() > JUMP * (terms() + frozen.abs()) + NO_DIGITS {
        return Err(StepError::ProtocolJumps { time: t, h: end - t, frozen, quadrature });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::open::{OpenBuilder as _, OpenState};
    use crate::{DormandPrince5, Method as _, Span};
    use metriplectic_dynamics::{Bath, Symplectic, System, Zero};
    use metriplectic_manifolds::{Euclidean, Product};
    use nalgebra::{Vector1, Vector2, Vector3, Vector4, vector};
    use num_dual::DualNum as _;

    type Pair<T> = (Vector2<T>, Vector2<T>);

    #[test]
    fn a_port_that_carries_a_part_of_an_entropy_is_refused() {
        let carries = |part: f64| {
            // Entropy goes in and nearly all of it out again.
            let system = System::on(Product(Euclidean::<2>, Euclidean::<2>))
                .bracket((Symplectic, Zero))
                .energy(|(x, s): &Pair<Real>| x.norm_squared() * 0.5 + s.x + s.y)
                .entropy(|(_, s): &Pair<Real>| s.x + s.y)
                .work("push", move |_: Real, _: &Pair<Real>| {
                    Vector4::new(0.0, 0.1, 1.0, 2.0 * part - 1.0).map(Real::from)
                })
                .build()
                .unwrap();
            let start = system.start((vector![1.0, 0.0], vector![0.5, 0.5]));
            system.check_exchange(&start).is_err()
        };
        assert!(carries(2e-8) && !carries(5e-9));
    }

    #[test]
    fn an_open_system_is_verified_once_and_its_report_lists_its_surroundings() {
        let system = |carried: f64| {
            System::on(Product(Euclidean::<2>, Euclidean::<1>))
                .bracket((Symplectic, Zero))
                .energy_in_time(|t: Real, (x, s): &(Vector2<Real>, Vector1<Real>)| {
                    x.norm_squared() * 0.5 + x.x * t.sin() + s.x
                })
                .entropy(|(_, s): &(Vector2<Real>, Vector1<Real>)| s.x)
                .work("push", move |t: Real, _: &(Vector2<Real>, Vector1<Real>)| {
                    Vector3::new(Real::from(0.0), t.cos(), Real::from(carried))
                })
                .bath("air", Bath::at(1.0).isotropic(0.1))
                .build()
                .unwrap()
        };
        let start = |system: &OpenSystem<_, _, _>| system.start((vector![1.0, 0.0], vector![0.5]));
        let sound = system(0.0);
        let x0 = start(&sound);
        assert_eq!(sound.verify(&x0, 0.1), Ok(()));
        let report = sound.report(&x0);
        assert!(report.verdict.is_ok() && report.laws.iter().any(|law| law.law == "⟨dS, F⟩ = 0"));
        let wrong = system(0.1);
        assert!(matches!(wrong.verify(&x0, 0.1), Err(ModelError::WorkCarriesEntropy { .. })));
        assert!(wrong.report(&x0).verdict.is_err() && wrong.verified(&x0).is_err());
        let run = |system: &_| {
            let span = Span::steps(0.1, 3);
            DormandPrince5.run(system, x0.clone(), span).unwrap().certificate().verified_before
        };
        assert!(!run(&sound) && run(&sound.verified(&x0).unwrap()));
    }

    #[test]
    fn a_derivative_in_time_that_is_off_by_a_hundredth_is_lost() {
        let is_lost = |factor: f64| {
            let system = System::on(Euclidean::<2>)
                .bracket(Symplectic)
                .energy_in_time(move |t: Real, x: &Vector2<Real>| {
                    x.norm_squared() * 0.5 + (t - t.re) * factor + t.re
                })
                .build()
                .unwrap();
            system.check_clock(&system.start(vector![1.0, 0.0])).is_err()
        };
        assert!(is_lost(1.02) && !is_lost(1.005));
    }

    #[test]
    fn a_protocol_that_jumps_by_a_thousandth_of_the_energy_is_found() {
        let jumps = |by: f64| {
            let system = System::on(Euclidean::<2>)
                .bracket(Symplectic)
                .energy_in_time(move |t: Real, x: &Vector2<Real>| {
                    x.norm_squared() * 0.5 + if t.re < 0.5 { 0.0 } else { by }
                })
                .build()
                .unwrap();
            let start = system.start(vector![1.0, 1.0]);
            let end = OpenState { time: 1.0, ..start.clone() };
            system.check_protocol([&start, &end]).is_err()
        };
        // The terms of the energy are H = 1 and ∂H x = 2.
        assert!(jumps(2e-3 * 3.0) && !jumps(5e-4 * 3.0));
    }
}
