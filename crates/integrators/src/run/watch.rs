//! States at given times between the steps of a run, and events.

use crate::run::event::Request;
use metriplectic_fields::Real;

use crate::run::jump::{JumpRequest, SmoothEvent};
use crate::run::schedule::Schedule;

/// Asks a run for states at given times and for events, whatever its steps are: the steps stay the same, to the
/// last bit. Each schedule has these methods: [`Span`](crate::Span), [`Until`](crate::Until), [`Schedule`], and a
/// step size alone.
///
/// Such a state lies between two steps, on the dense output of the method
/// ([`Stepper::between`](crate::Stepper::between)), or on the [path](crate::Stepper::on_path) of a run with noise. It keeps the laws as the steps do: `H` and the further invariants
/// have the values of the run, and `S` does not fall from one output to a later one.
pub trait Watch: Into<Schedule> {
    /// Records the states at these times, in place of those after each step. The trajectory holds the start, the
    /// states at these times, and the last state. The iterator over [`Steps`](crate::Steps) yields the same states
    /// after the start. Without any time these are the start and the last state.
    ///
    /// ```
    /// # use metriplectic_dynamics::System;
    /// # use metriplectic_fields::Real;
    /// # use metriplectic_integrators::{Run, Span, Watch};
    /// # use metriplectic_manifolds::{LieDual, WeylMidpoint};
    /// # use nalgebra::Vector3;
    /// # fn main() -> Result<(), metriplectic_integrators::Error> {
    /// # let body = System::on(LieDual::so3())
    /// #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
    /// #     .build()?;
    /// let span = Span::until(10.0).output_at([0.5, 1.0, 2.0, 5.0]);
    /// let run = WeylMidpoint.run(&body, Vector3::new(0.4, 0.5, 0.3), span)?;
    /// let times: Vec<f64> = run.iter().map(|state| state.time).collect();
    /// assert_eq!(times, [0.0, 0.5, 1.0, 2.0, 5.0, 10.0]);
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    fn output_at(self, times: impl IntoIterator<Item = f64>) -> Schedule {
        let mut schedule = self.into();
        let list = schedule.watch.times.get_or_insert_default();
        list.extend(times);
        list.sort_by(f64::total_cmp);
        list.dedup();
        schedule
    }

    /// Records the states at the times `t₀ + k Δt`, like [`output_at`](Self::output_at). An interval that changes no
    /// time of the run is [refused](crate::SpanError::OutputStandstill).
    ///
    /// ```
    /// # use metriplectic_dynamics::System;
    /// # use metriplectic_fields::Real;
    /// # use metriplectic_integrators::{Run, Span, Watch};
    /// # use metriplectic_manifolds::{LieDual, WeylMidpoint};
    /// # use nalgebra::Vector3;
    /// # fn main() -> Result<(), metriplectic_integrators::Error> {
    /// # let body = System::on(LieDual::so3())
    /// #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
    /// #     .build()?;
    /// let span = Span::until(10.0).tolerance(1e-5).output_every(0.25);
    /// let run = WeylMidpoint.run(&body, Vector3::new(0.4, 0.5, 0.3), span)?;
    /// assert_eq!(run.states().len(), 41);
    /// assert_eq!(run.states()[7].time, 1.75);
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    fn output_every(self, interval: f64) -> Schedule {
        let mut schedule = self.into();
        schedule.watch.interval = Some(interval);
        schedule
    }

    /// Names times at which the law of motion of an open system jumps or has a kink. No step goes across them: each ends at
    /// a corner on the old law, and the next one begins there with the new law. What the energy changes by at the corner
    /// is work of the time at a frozen state. Times that differ by a few roundings are one corner. Corners outside of the run
    /// are left out. [Tangents](crate::Tangents) and [adjoints](crate::Adjoints) cross corners.
    ///
    /// ```
    /// use metriplectic_dynamics::{Symplectic, System};
    /// use metriplectic_fields::Real;
    /// use metriplectic_integrators::{DormandPrince8, Method, OpenBuilder, Span, Watch};
    /// use metriplectic_manifolds::Euclidean;
    /// use nalgebra::{Vector2, vector};
    /// # fn main() -> Result<(), metriplectic_integrators::Error> {
    /// // A spring that becomes four times as stiff at t = 0.5.
    /// let spring = System::on(Euclidean::<2>)
    ///     .bracket(Symplectic)
    ///     .energy_in_time(|t: Real, x: &Vector2<Real>| {
    ///         let stiffness = if t.re < 0.5 { 1.0 } else { 4.0 };
    ///         (x.y * x.y + x.x * x.x * stiffness) * 0.5
    ///     })
    ///     .build()?;
    /// let span = Span::until(1.0).tolerance(1e-10).corners([0.5]);
    /// let run = DormandPrince8.run(&spring, spring.start(vector![1.0, 0.0]), span)?;
    /// let [q, p] = [0.5_f64.cos(), -0.5_f64.sin()];
    /// assert!((run.last().point.x.x - (q * 1.0_f64.cos() + p * 0.5 * 1.0_f64.sin())).abs() < 1e-9);
    /// assert!((run.last().point.ledger.parameter_work() - 1.5 * q * q).abs() < 1e-9);
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    fn corners(self, times: impl IntoIterator<Item = f64>) -> Schedule {
        let mut schedule = self.into();
        let list = &mut schedule.corners.times;
        list.extend(times);
        list.sort_by(f64::total_cmp);
        list.dedup();
        schedule
    }

    /// Makes [corners](Self::corners) of the times `t₀ + k Δt`: for a control that is constant between its samples.
    #[must_use]
    fn sampled(self, interval: f64) -> Schedule {
        let mut schedule = self.into();
        schedule.corners.interval = Some(interval);
        schedule
    }

    /// The time at which the run starts, 0 without another one, as [`Span::starting_at`](crate::Span::starting_at) and
    /// [`Until::starting_at`](crate::Until::starting_at) say it before outputs and events.
    ///
    /// ```
    /// use metriplectic_integrators::{Span, Watch};
    /// let span = Span::until(3.0).starting_at(2.0).output_every(0.25);
    /// assert_eq!(span, Span::until(3.0).output_every(0.25).starting_at(2.0));
    /// ```
    #[must_use]
    fn starting_at(self, start: f64) -> Schedule {
        Schedule { start, ..self.into() }
    }

    /// Goes back in time: `x' = Π dH` is followed from the start `t₀` to earlier times, so that times fall along the run. In the time
    /// `s = t₀ − t` it is `x' = Π d(−H)`, and a step of the size `h` is one of `−h` by the equation of the method. The energy of states and
    /// certificate is `H`.
    ///
    /// A symmetric method, as the midpoint rule and [`Gauss`](crate::Gauss) in steps of one size, goes back through the states it
    /// came by, to the tolerance of its solver. Another one is off by its error.
    ///
    /// - Sizes, intervals and tolerances are positive as ever. The end and the outputs are times before the start.
    /// - The direction of an [event](Self::event) is that along the run: one that rises forward [falls](Watched::falling) on the way
    ///   back.
    /// - An energy that depends on the time is evaluated at the times that fall.
    ///
    /// A run is [refused](crate::SpanError) with an entropy, with noise, with ports or baths, with jumps and with corners, and derivatives of
    /// it too.
    ///
    /// ```
    /// use metriplectic_dynamics::{Symplectic, System};
    /// use metriplectic_fields::Real;
    /// use metriplectic_integrators::{DormandPrince8, Method, Span, Watch};
    /// use metriplectic_manifolds::Euclidean;
    /// use nalgebra::{Vector2, vector};
    /// use num_dual::DualNum;
    /// # fn main() -> Result<(), metriplectic_integrators::Error> {
    /// let pendulum = System::on(Euclidean::<2>)
    ///     .bracket(Symplectic)
    ///     .energy(|x: &Vector2<Real>| x.y * x.y * 0.5 - x.x.cos())
    ///     .build()?;
    /// let there = DormandPrince8.run(&pendulum, vector![1.0, 0.0], Span::until(5.0).tolerance(1e-10))?;
    /// let span = Span::until(0.0).starting_at(5.0).backward().tolerance(1e-10);
    /// let back = DormandPrince8.run(&pendulum, there.last().point, span)?;
    /// assert!(back.last().time == 0.0 && (back.last().point - vector![1.0, 0.0]).norm() < 1e-8);
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    fn backward(self) -> Schedule {
        Schedule { backward: true, ..self.into() }
    }

    /// Records the start and every `every`-th state after it, and always the last.
    #[must_use]
    fn every(self, every: usize) -> Schedule {
        Schedule { every, ..self.into() }
    }

    /// Records at most `states` states, as [`Span::at_most`](crate::Span::at_most) and
    /// [`Until::at_most`](crate::Until::at_most) do.
    #[must_use]
    fn at_most(self, states: usize) -> Schedule {
        let schedule = self.into();
        match schedule.count {
            Some(count) => {
                let every = count.div_ceil(states.max(2) - 1);
                Schedule { every, ..schedule }
            }
            None => Schedule { most: Some(states.max(2)), ..schedule },
        }
    }

    /// Ends the run as soon as the state is at rest, see [`Ending::Rest`](crate::Ending::Rest).
    #[must_use]
    fn until_rest(self, tolerance: f64) -> Schedule {
        Schedule { rest: Some(tolerance), ..self.into() }
    }

    /// Finds where a function of the point changes its sign, to the last digits of the time, and records the
    /// [events](crate::Trajectory::events) by their name. Say the type of the point in the closure.
    ///
    /// Both directions count unless you go on with [`rising`](Watched::rising) or [`falling`](Watched::falling),
    /// and the run goes on after it unless you say [`stop`](Watched::stop).
    ///
    /// Inside a step the function is looked at as often as it asks for. Four looks and the end are compared with cubics through
    /// one another. Where they differ by more than 1/64 of the range of the values, gaps are parted until they do not; and where
    /// a parabola through three values turns near zero, its turn is looked at. So a function that is smooth on a step costs five
    /// evaluations, and one that oscillates some ten in a period. What is of one sign but for a short time is not seen: say
    /// its [`resolution`](Watched::resolution). Where 4096 further looks in a step are not enough, or the values are noise,
    /// the certificate says so ([`Certificate::unsure_events`](crate::Certificate::unsure_events)).
    ///
    /// - A function that touches zero and goes back does not change its sign: no event. One that stays zero has one where it
    ///   has come to zero.
    /// - A function that is zero at the start has no event there: the start is the state after all that happens at its time.
    ///   The certificate names such events with a [jump](Watched::jump)
    ///   ([`Certificate::events_at_start`](crate::Certificate::events_at_start)); apply the map to the start for a jump there.
    /// - A point where it is NaN is left out, inside a step and at its end: a change of sign across such points is an event at
    ///   the first time after them.
    ///
    /// ```
    /// # use metriplectic_dynamics::System;
    /// # use metriplectic_fields::Real;
    /// # use metriplectic_integrators::{Run, Span, Watch};
    /// # use metriplectic_manifolds::{LieDual, WeylMidpoint};
    /// # use nalgebra::Vector3;
    /// # fn main() -> Result<(), metriplectic_integrators::Error> {
    /// # let body = System::on(LieDual::so3())
    /// #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
    /// #     .build()?;
    /// let span = Span::until(20.0)
    ///     .event("node", |p: &Vector3<f64>| p.y)
    ///     .event("apex", |p: &Vector3<f64>| p.z - 0.3).falling();
    /// let run = WeylMidpoint.run(&body, Vector3::new(0.4, 0.5, 0.3), span)?;
    /// let nodes = run.events().iter().filter(|event| &*event.name == "node");
    /// assert!(nodes.count() > 1);
    /// # Ok(())
    /// # }
    /// ```
    fn event<P: 'static>(
        self,
        name: impl Into<String>,
        function: impl Fn(&P) -> f64 + Send + Sync + 'static,
    ) -> Watched {
        self.into().watched(Request::new(name.into(), false, move |_, x: &P| function(x)))
    }

    /// Asks for the sign changes of a function of the time and the point.
    ///
    /// A function of the time alone needs no state, so it is looked at 16 times in a step, and at rest too. It is taken for one
    /// if its values with the state at the start of the step are those with the states on its way, to the last bit.
    ///
    /// ```
    /// # use metriplectic_dynamics::System;
    /// # use metriplectic_fields::Real;
    /// # use metriplectic_integrators::{Run, Span, Watch};
    /// # use metriplectic_manifolds::{LieDual, WeylMidpoint};
    /// # use nalgebra::Vector3;
    /// # fn main() -> Result<(), metriplectic_integrators::Error> {
    /// # let body = System::on(LieDual::so3())
    /// #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
    /// #     .build()?;
    /// let span = Span::steps(0.1, 50).event_in_time("line", |t, p: &Vector3<f64>| p.x - 0.1 * t);
    /// let run = WeylMidpoint.run(&body, Vector3::new(0.4, 0.5, 0.3), span)?;
    /// let state = &run.events()[0].state;
    /// assert!((state.point.x - 0.1 * state.time).abs() < 1e-15);
    /// # Ok(())
    /// # }
    /// ```
    fn event_in_time<P: 'static>(
        self,
        name: impl Into<String>,
        function: impl Fn(f64, &P) -> f64 + Send + Sync + 'static,
    ) -> Watched {
        self.into().watched(Request::new(name.into(), true, function))
    }
}

impl<S: Into<Schedule>> Watch for S {}

impl Schedule {
    fn watched(mut self, request: Request) -> Watched {
        self.watch.events.push(request);
        Watched(self)
    }
}

/// A schedule with an event, whose direction and consequence can be said; made by [`Watch::event`].
#[derive(Clone, Debug, PartialEq)]
#[must_use]
pub struct Watched(Schedule);

impl Watched {
    fn with(mut self, change: impl FnOnce(&mut Request)) -> Self {
        if let Some(request) = self.0.watch.events.last_mut() {
            change(request);
        }
        self
    }

    /// The function has to rise through zero.
    ///
    /// ```
    /// use metriplectic_integrators::{Span, Watch};
    /// use nalgebra::Vector1;
    /// let span = Span::until(20.0).event("start", |x: &Vector1<f64>| x.x - 1.0).rising();
    /// ```
    pub fn rising(self) -> Self {
        self.with(|request| (request.rising, request.falling) = (true, false))
    }

    /// The function has to fall through zero.
    ///
    /// ```
    /// use metriplectic_integrators::{Span, Watch};
    /// use nalgebra::Vector1;
    /// let span = Span::until(20.0).event("ground", |height: &Vector1<f64>| height.x).falling();
    /// ```
    pub fn falling(self) -> Self {
        self.with(|request| (request.rising, request.falling) = (false, true))
    }

    /// Looks at the function at least once in each interval `dt` of the time, however long the steps are. Say it where the function
    /// is of one sign but for a short time, as that of a thin detector: no look can tell where to look for it.
    ///
    /// A ray crosses a slit of the width 0.1 between `t = 2.95` and `t = 3.05`, in one step from 0 to 10:
    ///
    /// ```
    /// # use metriplectic_dynamics::{Symplectic, System};
    /// # use metriplectic_fields::Real;
    /// use metriplectic_integrators::{DormandPrince8, Method, Span, Watch};
    /// # use metriplectic_manifolds::Euclidean;
    /// use nalgebra::{Vector2, vector};
    /// # fn main() -> Result<(), metriplectic_integrators::Error> {
    /// # let ray = System::on(Euclidean::<2>)
    /// #     .bracket(Symplectic)
    /// #     .energy(|x: &Vector2<Real>| x.y)
    /// #     .build()?;
    /// let inside = |x: &Vector2<f64>| if (x.x - 3.0).abs() < 0.05 { 1.0 } else { -1.0 };
    /// let span = Span::until(10.0).event("slit", inside).resolution(0.05);
    /// let run = DormandPrince8.run(&ray, vector![0.0, 0.0], span)?;
    /// let times: Vec<f64> = run.events().iter().map(|event| event.state.time).collect();
    /// assert!((times[0] - 2.95).abs() < 1e-12 && (times[1] - 3.05).abs() < 1e-12);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// On a path with noise the state is looked at where steps end and at the ends of such intervals in them: a step is divided evenly.
    ///
    /// A run with an interval that is not positive and finite, or that its time does not see, is
    /// [refused](crate::SpanError::EventResolution).
    pub fn resolution(self, dt: f64) -> Self {
        self.with(|request| request.resolution = Some(dt))
    }

    /// Counts changes of sign between two looks at a path with [noise](crate::NoiseBuilder::noise) that come in pairs: the function has the
    /// same sign at both looks, and was beyond zero in between. This happens with the probability of the Brownian bridge,
    /// `exp(−2 g₀ g₁/v)` with the variance `v` that the noise gives to the function in that time (Baldi 1995; Gobet 2000), and is drawn by
    /// a number of its own, so the path stays as it is. Both changes are at the later look, in the directions that were asked for.
    ///
    /// The mean of a first passage time is off by the order 1/2 in `h` without it where noise moves the function, and 1 with it. Where
    /// noise reaches the function by other entries alone, as the position of a particle by its momentum, `v` is zero and nothing
    /// changes; nor does it in a run without noise. A look takes two flows of each noise field, so the cost is that of as many steps as
    /// there are terms. Numbers of three points are refused ([`NoiseError::HasNoBetween`](crate::NoiseError::HasNoBetween)).
    ///
    /// ```
    /// use metriplectic_integrators::{Span, Watch};
    /// use nalgebra::Vector1;
    /// let span = Span::steps(0.01, 10_000).event("out", |x: &Vector1<f64>| x.x - 1.0).bridged().stop();
    /// ```
    pub fn bridged(self) -> Self {
        self.with(|request| request.bridged = true)
    }

    /// Ends the run at the event, with [`Ending::Event`](crate::Ending::Event): the last state of the trajectory is
    /// the state there. The [checkpoint](crate::Checkpoint) of such a run is the end of the step in which the event
    /// lies: a run that is resumed from it has no outputs and events between the two.
    ///
    /// ```
    /// # use metriplectic_dynamics::System;
    /// # use metriplectic_fields::Real;
    /// # use metriplectic_integrators::{Ending, Run, Span, Watch};
    /// # use metriplectic_manifolds::{LieDual, WeylMidpoint};
    /// # use nalgebra::Vector3;
    /// # fn main() -> Result<(), metriplectic_integrators::Error> {
    /// # let body = System::on(LieDual::so3())
    /// #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
    /// #     .build()?;
    /// let span = Span::until(20.0).event("node", |p: &Vector3<f64>| p.y).stop();
    /// let run = WeylMidpoint.run(&body, Vector3::new(0.4, 0.5, 0.3), span)?;
    /// assert_eq!(run.ending(), Ending::Event { index: 0 });
    /// assert_eq!(run.last(), &run.events()[0].state);
    /// assert!(run.last().time < 20.0 && run.last().point.y.abs() < 1e-15);
    /// # Ok(())
    /// # }
    /// ```
    pub fn stop(self) -> Self {
        self.stop_after(1)
    }

    /// Ends the run at the `n`-th time that the event happens, as [`stop`](Self::stop) does at the first. The certificate
    /// [counts](crate::Certificate::event_counts) each event.
    ///
    /// A run that is [resumed](crate::Method::resume) from a checkpoint goes on counting, if the event is the one of its number and
    /// its name: it ends where the count is a multiple of `n`. At an event with a [jump](Self::jump) the state jumps the first
    /// `n − 1` times, and the run ends in the state before the `n`-th jump.
    ///
    /// ```
    /// # use metriplectic_dynamics::System;
    /// # use metriplectic_fields::Real;
    /// # use metriplectic_integrators::{Ending, Run, Span, Watch};
    /// # use metriplectic_manifolds::{LieDual, WeylMidpoint};
    /// # use nalgebra::Vector3;
    /// # fn main() -> Result<(), metriplectic_integrators::Error> {
    /// # let body = System::on(LieDual::so3())
    /// #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
    /// #     .build()?;
    /// let span = Span::until(100.0).event("turn", |p: &Vector3<f64>| p.y).rising().stop_after(3);
    /// let run = WeylMidpoint.run(&body, Vector3::new(0.4, 0.5, 0.3), span)?;
    /// assert_eq!(run.ending(), Ending::Event { index: 0 });
    /// assert_eq!(run.count("turn"), Some(3));
    /// assert_eq!(run.last(), &run.events()[2].state);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// A run that is to stop after 0 times is [refused](crate::SpanError::StopAfterNone).
    pub fn stop_after(self, n: usize) -> Self {
        self.with(|request| request.stops_after = Some(n))
    }

    /// Gives the function of the event at numbers that carry derivatives, for [gradients](crate::Adjoints) of runs that
    /// [end](Self::stop) there: with the function `g`, the end `x(t*)` depends on the start by its time too,
    /// `δt* = −dg δx/(dg v + ∂_t g)`. Say the type of the point in the closure. The point of a family is the pair of the state and the
    /// parameters. For an event with a jump see [`Jumping::differentiable`].
    ///
    /// A stone falls, and hits the ground after `t* = √(2q/g)`:
    ///
    /// ```
    /// use metriplectic_dynamics::{Family, Symplectic};
    /// use metriplectic_fields::Real;
    /// use metriplectic_integrators::{Adjoints, DormandPrince8, Span, Watch};
    /// use metriplectic_manifolds::Euclidean;
    /// use nalgebra::{Vector1, Vector2, vector};
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let stone = Family::on(Euclidean::<2>)
    ///     .parameters(["gravity"])
    ///     .bracket(Symplectic)
    ///     .energy(|x: &Vector2<Real>, g: &Vector1<Real>| x.y * x.y * 0.5 + x.x * g.x)
    ///     .build()?;
    /// type Wide = (Vector2<Real>, Vector1<Real>);
    /// let span = Span::until(5.0)
    ///     .tolerance(1e-10)
    ///     .event("ground", |x: &Vector2<f64>| x.x)
    ///     .stop()
    ///     .differentiable(|_, (x, _): &Wide| x.x);
    /// let system = stone.at(vector![2.0]);
    /// let run = DormandPrince8.adjoint(&system, vector![4.0, 0.0], span)?;
    /// let end = run.gradient_of_end()?;
    /// assert!((end.value - 2.0).abs() < 1e-9); // ∂t*/∂q = t*/2q, ∂t*/∂g = −t*/2g
    /// assert!((end.along_start()[0] - 0.25).abs() < 1e-9);
    /// assert!((end.along("gravity").unwrap() + 0.5).abs() < 1e-9);
    /// # Ok(())
    /// # }
    /// ```
    pub fn differentiable<P: 'static>(
        self,
        event: impl Fn(Real, &P) -> Real + Send + Sync + 'static,
    ) -> Self {
        let smooth = SmoothEvent { function: Box::new(event), map: None };
        self.with(|request| request.differentiate(smooth))
    }
}

impl Watched {
    /// Changes the state at the event: `x'` from the time and the state at which it was found. The time of the event is the end
    /// of a step, and the next one starts from `x'`.
    ///
    /// The change of the energy is work of the event, and the certificate lists it
    /// ([`Certificate::jumps`](crate::Certificate::jumps)). So the first law of the run is `ΔH = W`. It is heat if you
    /// name a temperature with [`heat_at`](Jumping::heat_at). The states of an open system have both in their
    /// ledger. A map that lowers the entropy of the system and its surroundings ends the run in
    /// [`JumpError::LowersEntropy`](crate::JumpError::LowersEntropy), and so does one that changes a listed Casimir or
    /// momentum.
    ///
    /// A ball falls, and an elastic wall turns its momentum round. No energy is exchanged, to the last bit:
    ///
    /// ```
    /// use metriplectic_dynamics::{Symplectic, System};
    /// use metriplectic_fields::Real;
    /// use metriplectic_integrators::{DormandPrince8, Method, Span, Watch};
    /// use metriplectic_manifolds::Euclidean;
    /// use nalgebra::{Vector2, vector};
    /// # fn main() -> Result<(), metriplectic_integrators::Error> {
    /// let ball = System::on(Euclidean::<2>)
    ///     .bracket(Symplectic)
    ///     .energy(|x: &Vector2<Real>| x.y * x.y * 0.5 + x.x)
    ///     .build()?;
    /// let span = Span::until(10.0)
    ///     .tolerance(1e-10)
    ///     .event("wall", |x: &Vector2<f64>| x.x)
    ///     .falling()
    ///     .jump(|_, x: &Vector2<f64>| vector![x.x, -x.y]);
    /// let run = DormandPrince8.run(&ball, vector![0.5, 0.0], span)?;
    /// // It falls for one unit of time, and is back at the wall after two more.
    /// let times: Vec<f64> = run.events().iter().map(|event| event.state.time).collect();
    /// assert_eq!(times.len(), 5);
    /// assert!(times.iter().zip([1.0, 3.0, 5.0, 7.0, 9.0]).all(|(t, exact)| (t - exact).abs() < 1e-8));
    /// let certificate = run.certificate();
    /// assert!(certificate.keeps_energy() && certificate.jumps[0].work == 0.0);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// Make it [`falling`](Self::falling) or [`rising`](Self::rising) for a wall. The model has to go on behind it by up
    /// to one step, because an event is looked for in a step that was taken. The jump of one event is no event of another one.
    /// In steps of one size the rest of the step is taken from `x'`, so that the steps end at the same times.
    ///
    /// At the time of a jump:
    ///
    /// - An output, and so a datum, is the state before it. A step that ends there is recorded with the state after it.
    /// - At the time of the start the state does not jump; see [`Watch::event`].
    /// - Another event that jumps does so next, in the order in which they were asked for.
    /// - Another event that [stops](Self::stop) comes first: the run ends in the state before the jump, which does not happen.
    pub fn jump<P: 'static>(self, map: impl Fn(f64, &P) -> P + Send + Sync + 'static) -> Jumping {
        Jumping(self.with(|request| request.jump = Some(JumpRequest::new(map))))
    }
}

/// A schedule with an event that changes the state; made by [`Watched::jump`].
#[derive(Clone, Debug, PartialEq)]
#[must_use]
pub struct Jumping(Watched);

impl Jumping {
    fn with(self, change: impl FnOnce(&mut JumpRequest)) -> Self {
        Self(self.0.with(|request| {
            if let Some(jump) = &mut request.jump {
                change(jump);
            }
        }))
    }

    /// Takes what the energy changes by for heat from surroundings of this temperature, in the unit of `H/S`: they gain
    /// the entropy `−ΔH/T`. A wall that is hit without a bounce is warmed.
    ///
    /// ```
    /// use metriplectic_integrators::{Span, Watch};
    /// use nalgebra::{Vector2, vector};
    /// let span = Span::until(20.0)
    ///     .event("wall", |x: &Vector2<f64>| x.x)
    ///     .falling()
    ///     .jump(|_, x: &Vector2<f64>| vector![x.x, -0.9 * x.y])
    ///     .heat_at(300.0);
    /// ```
    pub fn heat_at(self, temperature: f64) -> Self {
        self.with(|jump| jump.temperature = Some(temperature))
    }

    /// Gives the function of the event and the map of the jump at numbers that carry derivatives, for runs with a
    /// [tangent](crate::Tangents). Say the type of the point in the closures. The point of a family is the pair of the state and the
    /// parameters, which the map returns as they are.
    ///
    /// A ball that bounces with the restitution `e`, and the derivative of its state along `e`:
    ///
    /// ```
    /// use metriplectic_dynamics::{Family, Symplectic};
    /// use metriplectic_fields::Real;
    /// use metriplectic_integrators::{DormandPrince8, Span, Tangents, Watch};
    /// use metriplectic_manifolds::Euclidean;
    /// use nalgebra::{Vector1, Vector2, vector};
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let ball = Family::on(Euclidean::<2>)
    ///     .parameters(["restitution"])
    ///     .bracket(Symplectic)
    ///     .energy(|x: &Vector2<Real>, _: &Vector1<Real>| x.y * x.y * 0.5 + x.x)
    ///     .build()?;
    /// let e = 0.9;
    /// type Wide = (Vector2<Real>, Vector1<Real>);
    /// let span = Span::until(2.0)
    ///     .tolerance(1e-10)
    ///     .event("wall", |x: &Vector2<f64>| x.x)
    ///     .falling()
    ///     .jump(move |_, x: &Vector2<f64>| vector![x.x, -e * x.y])
    ///     .differentiable(
    ///         |_, (x, _): &Wide| x.x,
    ///         |_, (x, e): &Wide| (vector![x.x, -e.x * x.y], *e),
    ///     );
    /// let run = DormandPrince8.tangent(&ball.at(vector![e]), vector![0.5, 0.0], span)?;
    /// // It hits the wall at t = 1 with the speed 1, so one unit of time later p = e − 1 and x = e − 1/2.
    /// let along = run.last().along("restitution").unwrap();
    /// assert!((along[0] - 1.0).abs() < 1e-8 && (along[1] - 1.0).abs() < 1e-8);
    /// # Ok(())
    /// # }
    /// ```
    pub fn differentiable<P: 'static>(
        self,
        event: impl Fn(Real, &P) -> Real + Send + Sync + 'static,
        map: impl Fn(Real, &P) -> P + Send + Sync + 'static,
    ) -> Self {
        let smooth = SmoothEvent { function: Box::new(event), map: Some(Box::new(map)) };
        Self(self.0.with(|request| request.differentiate(smooth)))
    }

    /// Counts changes of sign that come in pairs between two looks at a path with noise, see [`Watched::bridged`].
    pub fn bridged(self) -> Self {
        Self(self.0.bridged())
    }

    /// Looks at the function at least once in each interval `dt` of the time, see [`Watched::resolution`].
    pub fn resolution(self, dt: f64) -> Self {
        Self(self.0.resolution(dt))
    }

    /// Ends the run before the `n`-th jump, see [`Watched::stop_after`].
    pub fn stop_after(self, n: usize) -> Self {
        Self(self.0.stop_after(n))
    }

    /// The function has to rise through zero, see [`Watched::rising`].
    pub fn rising(self) -> Self {
        Self(self.0.rising())
    }

    /// The function has to fall through zero, see [`Watched::falling`].
    pub fn falling(self) -> Self {
        Self(self.0.falling())
    }

    /// Accepts a jump that lowers the entropy of the system and its surroundings: of a model without the part of the
    /// surroundings that gains it. The certificate lists the least change.
    pub fn may_lower_entropy(self) -> Self {
        self.with(|jump| jump.lowers = true)
    }
}

impl From<Jumping> for Schedule {
    fn from(Jumping(watched): Jumping) -> Self {
        watched.into()
    }
}

impl From<Watched> for Schedule {
    fn from(Watched(schedule): Watched) -> Self {
        schedule
    }
}
