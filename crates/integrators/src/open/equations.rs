//! Ports, baths and a clock around a system of your own, in plain numbers.

mod noise;

use std::fmt;
use std::sync::Arc;

use metriplectic_dynamics::ModelError;
use metriplectic_dynamics::exchange::Temperature;
use metriplectic_equations::judge::{Judge, RADIUS};
use metriplectic_equations::{
    Apart, Covectors, ENERGY, ENTROPY, Equations, Part, Path, Paths, Report, Sizes, Terms,
};

use super::state::{Ledger, OpenState};
use super::surrounded::{Exchanged, OpenFlow, per_energy};
use super::verify::{BROKEN, compare_with_values};
use crate::implicit::{NoImplicitSteps, refuse};
use crate::numbers::{FromEquations, Kept, Rows, energy_changes};
use crate::round_off::bound::NO_DIGITS;
use crate::step::{
    Directions, Entries, Flow as _, FlowError, PlainNumbers, Values, Vector as _, Written,
};

/// A state as the friction of a bath sees it.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct EntriesAt<'a> {
    /// The time.
    pub t: f64,
    /// The entries.
    pub x: &'a [f64],
    /// The covector `w = dH`, a number for each direction. In an implicit step it is that of the step.
    pub w: &'a [f64],
    /// The covector `s = dS`.
    pub s: &'a [f64],
}

type Velocity = dyn Fn(f64, &[f64], &mut [f64]) + Send + Sync;
type Friction = dyn Fn(&EntriesAt<'_>, &mut Terms<'_>) + Send + Sync;

/// A port or a bath.
struct Surrounding {
    name: Arc<str>,
    kind: PartKind,
}

enum PartKind {
    Port(Box<Velocity>),
    Bath { temperature: Box<dyn Temperature + Send + Sync>, friction: Box<Friction> },
}

/// The effect of a part at a state, in a unit of time.
struct Effect {
    v: Vec<f64>,
    /// The entropy `⟨A, R A⟩` that is produced, times the temperature.
    dissipated: f64,
    /// The least rate of the friction.
    least_rate: f64,
    /// A direction of a contact that does not exist.
    outside: Option<usize>,
}

/// A system of your own in surroundings; made by [`FromEquations::opened`].
///
/// ```math
/// x' = f(t, x) + \sum_a F_a(t, x) + \sum_b R_b(t, x) (T_b\, dS - dH), \qquad H - W_t - \sum_a W_a - \sum_b Q_b = H_0
/// ```
///
/// with the motion `f` of the system. The laws are those of [open systems](crate::open), on every step of every method. Implicit
/// methods ask for the [parts](metriplectic_equations::Differences) of the system. Where the energy depends
/// on time the system says so ([`Equations::energy_depends_on_time`]) and answers [`Equations::power`], and the work `W_t` of the time is
/// booked. Runs have [tangents](crate::Tangents), of the ledger too, and [`with_noise`](Self::with_noise) gives the system and its baths
/// thermal noise.
///
/// ```
/// use metriplectic_equations::{ENERGY, ENTROPY, Equations, Sizes};
/// use metriplectic_integrators::{DormandPrince8, FromEquations, Method as _, Span};
///
/// /// So many oscillators whose springs a magnet stiffens, `H = Σ ½p² + ½(1 + ½ sin t) q²`.
/// struct Oscillators(usize);
///
/// impl Equations for Oscillators {
///     fn sizes(&self) -> Sizes {
///         Sizes { entries: 2 * self.0, directions: 2 * self.0, laws: 2 }
///     }
///
///     fn values(&self, t: f64, x: &[f64], values: &mut [f64]) {
///         let (q, p) = x.split_at(self.0);
///         let squares = |x: &[f64]| 0.5 * x.iter().map(|x| x * x).sum::<f64>();
///         values[ENERGY] = squares(p) + (1.0 + 0.5 * t.sin()) * squares(q);
///         values[ENTROPY] = 0.0;
///     }
///
///     fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
///         self.values(t, x, values);
///         w.fill(0.0);
///         (0..self.0).for_each(|i| w[i] = (1.0 + 0.5 * t.sin()) * x[i]);
///         w[self.0..2 * self.0].copy_from_slice(&x[self.0..]);
///     }
///
///     fn velocity(&self, t: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
///         v[..self.0].copy_from_slice(&x[self.0..]);
///         (0..self.0).for_each(|i| v[self.0 + i] = -(1.0 + 0.5 * t.sin()) * x[i]);
///         Some(0.0)
///     }
///
///     fn energy_depends_on_time(&self) -> bool {
///         true
///     }
///
///     fn power(&self, t: f64, x: &[f64]) -> f64 {
///         0.25 * t.cos() * x[..self.0].iter().map(|q| q * q).sum::<f64>()
///     }
/// }
///
/// let n: usize = "5".parse()?;
/// let open = FromEquations(Oscillators(n))
///     .opened()
///     .work("motor", move |t, _, v| v[n] = (1.3 * t).sin())
///     .bath("air", 0.7, move |_, contact| (n..2 * n).for_each(|p| contact(0.1, &[(p, 1.0)])));
/// let start = open.start(vec![0.3; 2 * n]);
/// let before = open.energy_at(&start);
/// let run = DormandPrince8.run(&open, start, Span::until(20.0).tolerance(1e-8))?;
/// let (end, ledger) = (&run.last().point, &run.last().point.ledger);
/// let work = ledger.parameter_work() + ledger.work("motor").unwrap();
/// let gained = open.energy_at(end) - before;
/// assert!((gained - work - ledger.heat("air").unwrap()).abs() < 1e-12);
/// assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct OpenEquations<S> {
    system: S,
    parts: Vec<Surrounding>,
    /// True once its laws were verified, with those of its parts.
    verified: bool,
    /// A ledger without entries.
    empty: Ledger,
    /// How many contacts each bath has, if it has noise.
    contacts: Vec<usize>,
}

// By hand, because systems and closures have no `Debug`.
impl<S> fmt::Debug for OpenEquations<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<&str> = self.parts.iter().map(|part| &*part.name).collect();
        f.debug_struct("OpenEquations").field("parts", &names).finish_non_exhaustive()
    }
}

impl<S: Equations> FromEquations<S> {
    /// The system with surroundings, which have no part yet. The time of a run is that at which it is asked then, so its energy may
    /// depend on time ([`Equations::energy_depends_on_time`]), and so may its motion.
    pub fn opened(self) -> OpenEquations<S> {
        let empty = Ledger::of([]);
        OpenEquations {
            system: self.0,
            parts: Vec::new(),
            verified: false,
            empty,
            contacts: Vec::new(),
        }
    }
}

impl<S: Equations> OpenEquations<S> {
    /// The system.
    pub const fn system(&self) -> &S {
        &self.system
    }

    /// The state in which a run starts at these entries: its time is that of the run, and nothing is booked yet.
    pub fn start(&self, x: impl Into<Entries>) -> OpenState<Entries> {
        OpenState { x: x.into(), time: 0.0, ledger: self.empty.clone() }
    }

    /// Appends a port: a closure of the time and the entries that fills a velocity `F(t, x)`, a number for each direction in the frame
    /// of the chart at `x`, in the unit of an entry over that of time. The numbers that it is given are zeros. A port does the work
    /// `⟨dH, F⟩` and carries no entropy, `⟨dS, F⟩ = 0`.
    #[must_use]
    pub fn work(
        self,
        name: impl Into<Arc<str>>,
        velocity: impl Fn(f64, &[f64], &mut [f64]) + Send + Sync + 'static,
    ) -> Self {
        self.with(name.into(), PartKind::Port(Box::new(velocity)))
    }

    /// Appends a bath of a temperature `T`, a number or a closure of the time. Its friction `R = Σ ρ b bᵀ` is a list of contacts from a
    /// closure of a state, which calls the second argument with the rate `ρ` of each and with the entries of `b` that are not zero, as
    /// pairs of a direction and a number. Its heat `⟨dH, R (T dS − dH)⟩` flows into the system.
    #[must_use]
    pub fn bath(
        self,
        name: impl Into<Arc<str>>,
        temperature: impl Temperature + Send + Sync + 'static,
        friction: impl Fn(&EntriesAt<'_>, &mut Terms<'_>) + Send + Sync + 'static,
    ) -> Self {
        let (temperature, friction) = (Box::new(temperature), Box::new(friction));
        self.with(name.into(), PartKind::Bath { temperature, friction })
    }

    fn with(mut self, name: Arc<str>, kind: PartKind) -> Self {
        self.parts.push(Surrounding { name, kind });
        let names = self.parts.iter().map(|part| (Arc::clone(&part.name), part.is_bath()));
        self.empty = Ledger::of(names);
        self.verified = false;
        self
    }

    /// The energy `H(t, x)` of the system at a state. The energy of a [state of a run](crate::State) is the balance `H − W − Q` instead,
    /// which stays what it was at the start.
    pub fn energy_at(&self, state: &OpenState<Entries>) -> f64 {
        self.at(state.time).laws(&state.x).energy
    }

    /// The entropy of the system at a state, without that of the baths.
    pub fn entropy_at(&self, state: &OpenState<Entries>) -> f64 {
        self.at(state.time).laws(&state.x).entropy
    }

    /// Checks the laws of the system around a state, at its time, with the clock, the ports and the baths there. A run does this first,
    /// with a radius of 0.1.
    ///
    /// # Errors
    ///
    /// [`ModelError`] that names the law, the state and the size of the violation.
    pub fn verify(&self, x0: &OpenState<Entries>, radius: f64) -> Result<(), ModelError> {
        Judge::of(&self.system, x0.time).verify(&x0.x, radius)?;
        self.check_clock(x0)?;
        self.check_exchange(x0)
    }

    /// Lists the residual of every law of the system around a state, at its time. The verdict is that of
    /// [`verify`](Self::verify).
    pub fn report(&self, x0: &OpenState<Entries>) -> Report {
        let mut report = Judge::of(&self.system, x0.time).report(&x0.x);
        if report.verdict.is_ok() {
            report.verdict = self.check_clock(x0).and_then(|()| self.check_exchange(x0));
        }
        report
    }

    /// Verifies the system with its ports and baths around a state, and returns it with this certificate, which a further port or bath
    /// takes away. A run of it, from any start, checks the laws at that start without samples around it.
    ///
    /// # Errors
    ///
    /// The errors of [`verify`](Self::verify).
    pub fn verified(self, x0: &OpenState<Entries>) -> Result<Self, ModelError> {
        self.verify(x0, RADIUS)?;
        Ok(Self { verified: true, ..self })
    }

    /// The differentials of all laws, one after another.
    fn covectors(&self, t: f64, x: &[f64]) -> Vec<f64> {
        let Sizes { laws, directions, .. } = self.system.sizes();
        let [mut values, mut w] = [laws, laws * directions].map(|count| vec![0.0; count]);
        self.system.differentials(t, x, &mut values, &mut w);
        w
    }
}

impl Surrounding {
    const fn is_bath(&self) -> bool {
        matches!(self.kind, PartKind::Bath { .. })
    }

    /// The temperature of a bath.
    fn temperature(&self, t: f64) -> Option<f64> {
        match &self.kind {
            PartKind::Port(_) => None,
            PartKind::Bath { temperature, .. } => Some(temperature.at(t)),
        }
    }

    /// The effect at a state, of a part of this temperature.
    fn effect(&self, temperature: f64, at: &EntriesAt<'_>) -> Effect {
        let (mut v, mut dissipated, mut least_rate) = (vec![0.0; at.w.len()], 0.0, f64::INFINITY);
        let mut outside = None;
        match &self.kind {
            PartKind::Port(velocity) => velocity(at.t, at.x, &mut v),
            PartKind::Bath { friction, .. } => friction(at, &mut |rate, b| {
                if let Some(&(index, _)) = b.iter().find(|(index, _)| *index >= at.w.len()) {
                    outside = Some(index);
                    return;
                }
                let force = |&(i, b): &(usize, f64)| b * (temperature * at.s[i] - at.w[i]);
                let force: f64 = b.iter().map(force).sum();
                b.iter().for_each(|&(i, b)| v[i] += b * (rate * force));
                dissipated += rate * force * force;
                least_rate = if rate < least_rate || rate.is_nan() { rate } else { least_rate };
            }),
        }
        Effect { v, dissipated, least_rate, outside }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The parts of a model.
struct OfModel<'a>(&'a dyn Equations);

metriplectic_equations::answered_by! {
    ['a] OfModel<'a>: this => this.0, |of: &dyn Equations| of.is_verified();
}

impl Apart for OfModel<'_> {
    fn has_charts(&self) -> bool {
        !self.0.is_vector_space()
    }

    fn paths(&self) -> Option<&dyn Paths> {
        self.0.model()?.paths()
    }

    fn is_zero(&self, part: Part) -> bool {
        self.0.model().is_none_or(|model| model.is_zero(part))
    }

    fn is_poisson(&self) -> bool {
        self.0.model().is_none_or(metriplectic_equations::Model::is_poisson)
    }

    fn apply(&self, part: Part, t: f64, x: &[f64], w: Covectors<'_>, alpha: &[f64], v: &mut [f64]) {
        let place = (x, &vec![0.0; v.len()][..]);
        let applied = self.0.model().map(|model| model.apply(part, t, place, w, alpha, v));
        if !matches!(applied, Some(Ok(()))) {
            v.fill(f64::NAN);
        }
    }
}

impl<S: Equations> OpenFlow for OpenEquations<S> {
    type Points = PlainNumbers;
    type Velocity = Directions;
    type Gradients = Rows;
    type Closed<'a>
        = FromEquations<Kept<'a>>
    where
        Self: 'a;

    fn at(&self, t: f64) -> FromEquations<Kept<'_>> {
        FromEquations(Kept::at(&self.system, t))
    }

    fn with_parts<T>(&self, _: f64, f: impl FnOnce(&dyn Apart) -> T) -> Option<T> {
        self.system.model()?;
        Some(f(&OfModel(&self.system)))
    }

    fn serve_points(&self, path: Path) -> Result<(), NoImplicitSteps> {
        refuse(&self.system, path)
    }

    fn empty(&self) -> &Ledger {
        &self.empty
    }

    fn has_clock(&self) -> bool {
        self.system.energy_depends_on_time()
    }

    fn power(&self, t: f64, x: &Entries) -> f64 {
        self.system.power(t, x)
    }

    fn velocity_of(
        &self,
        t: f64,
        x: &Entries,
        gradients: Option<&Rows>,
    ) -> Option<(Directions, Exchanged)> {
        let n = self.system.sizes().directions;
        let mut v = Directions::of(&vec![0.0; n]);
        let to = v.numbers_mut();
        if self.parts.is_empty() {
            let production = match gradients {
                Some(rows) => self.system.velocity_with(t, x, rows.all(), to)?,
                None => self.system.velocity(t, x, to)?,
            };
            return Some((v, Exchanged { entries: Vec::new(), production }));
        }
        let formed = gradients.is_none().then(|| self.covectors(t, x));
        let all = gradients.map_or(formed.as_deref(), |rows| Some(rows.all()))?;
        let internal = self.system.velocity_with(t, x, all, to)?;
        let w = [&all[ENERGY * n..][..n], &all[ENTROPY * n..][..n]];
        let mut exchanged = self.exchange(t, x, w, false, Some(to))?;
        exchanged.production += internal;
        to.iter().all(|v| v.is_finite()).then_some((v, exchanged))
    }

    fn exchanged(
        &self,
        t: f64,
        x: &[f64],
        w: [&[f64]; 2],
        force: Option<&mut [f64]>,
    ) -> Option<Exchanged> {
        self.exchange(t, x, w, true, force)
    }

    fn temperatures(&self, t: f64) -> Vec<f64> {
        self.parts.iter().filter_map(|part| part.temperature(t)).collect()
    }

    fn has_cold_bath(&self) -> bool {
        let is_cold = |part: &Surrounding| match &part.kind {
            PartKind::Bath { temperature, .. } => temperature.is_zero(),
            PartKind::Port(_) => false,
        };
        self.parts.iter().any(is_cold)
    }

    fn was_verified(&self) -> bool {
        self.verified || self.system.is_verified()
    }

    fn check_points(&self, x0: &OpenState<Entries>) -> Result<(), ModelError> {
        let judge = Judge::of(&self.system, x0.time);
        if self.was_verified() { judge.check_start(&x0.x) } else { judge.verify(&x0.x, RADIUS) }
    }

    fn examine_points(&self, _: &OpenState<Entries>) -> Result<(), FlowError> {
        Ok(())
    }

    fn check_exchange(&self, state: &OpenState<Entries>) -> Result<(), ModelError> {
        if self.parts.is_empty() {
            return Ok(());
        }
        let (time, all) = (state.time, self.covectors(state.time, &state.x));
        let directions = self.system.sizes().directions;
        let row = |law: usize| &all[law * directions..][..directions];
        let at = EntriesAt { t: time, x: &state.x, w: row(ENERGY), s: row(ENTROPY) };
        let point = || state.x.to_vec();
        // 0/0 = 0: a law that nothing changes is kept.
        let slope = |law: &[f64], v: &[f64]| {
            let terms: f64 = law.iter().zip(v).map(|(a, b)| (a * b).abs()).sum();
            let slope = dot(law, v).abs();
            if slope <= NO_DIGITS { 0.0 } else { slope / terms }
        };
        for part in &self.parts {
            let name = || Arc::clone(&part.name);
            let temperature = part.temperature(time);
            if let Some(temperature) = temperature
                && !(temperature >= 0.0 && temperature.is_finite())
            {
                return Err(ModelError::BathNotPositive { bath: name(), temperature, time });
            }
            let Effect { v, least_rate, outside, .. } =
                part.effect(temperature.unwrap_or(0.0), &at);
            if let Some(direction) = outside {
                return Err(ModelError::ContactOutside { bath: name(), direction, directions });
            }
            if temperature.is_some() && (least_rate < 0.0 || least_rate.is_nan()) {
                let (bath, rate) = (name(), least_rate);
                return Err(ModelError::FrictionNotPositive { bath, rate, time });
            }
            if v.iter().any(|v| !v.is_finite()) {
                return Err(ModelError::ExchangeNotFinite { part: name(), time, point: point() });
            }
            let size = slope(at.s, &v);
            if temperature.is_none() && size > BROKEN {
                let (port, point) = (name(), point());
                return Err(ModelError::WorkCarriesEntropy { port, time, point, size });
            }
            for index in 0..all.len() / directions - ENTROPY - 1 {
                let size = slope(row(ENTROPY + 1 + index), &v);
                if size > BROKEN {
                    let (part, point) = (name(), point());
                    return Err(ModelError::PortBreaksInvariant { part, index, time, point, size });
                }
            }
        }
        Ok(())
    }

    fn check_clock(&self, state: &OpenState<Entries>) -> Result<(), ModelError> {
        let (t, x) = (state.time, &state.x);
        if !self.has_clock() {
            let changes = energy_changes(&self.system, t, x);
            return if changes { Err(ModelError::EnergyInTime) } else { Ok(()) };
        }
        let energy = |t: f64| self.at(t).laws(x).energy;
        let terms = |t: f64| self.at(t).term_sizes(x).energy;
        compare_with_values(t, self.system.power(t, x), energy, terms, || x.to_vec())
    }
}

impl<S: Equations> OpenEquations<S> {
    /// Sums the effects of all parts with these covectors `w_H` and `w_S`, and adds their velocity to `force`.
    ///
    /// A port carries no entropy, `⟨dS, F⟩ = 0`. `in_a_step` the covector `w_S` is a discrete gradient, which differs from the
    /// differential, and a port has the velocity `F − w_S ⟨w_S, F⟩/⟨w_S, w_S⟩`, as in a typed system.
    fn exchange(
        &self,
        t: f64,
        x: &[f64],
        [w, s]: [&[f64]; 2],
        in_a_step: bool,
        mut force: Option<&mut [f64]>,
    ) -> Option<Exchanged> {
        let at = EntriesAt { t, x, w, s };
        let mut exchanged = Exchanged::default();
        for part in &self.parts {
            let temperature = part.temperature(t).unwrap_or(0.0);
            let Effect { mut v, dissipated, outside, .. } = part.effect(temperature, &at);
            if temperature < 0.0 || outside.is_some() {
                return None;
            }
            if in_a_step && !part.is_bath() {
                let carried = dot(s, &v);
                if carried != 0.0 {
                    let fraction = carried / dot(s, s);
                    v.iter_mut().zip(s).for_each(|(v, s)| *v -= fraction * s);
                }
            }
            let power = dot(w, &v);
            exchanged.entries.push(power);
            if part.is_bath() {
                let per_energy = per_energy(temperature);
                exchanged.entries.push(-power * per_energy);
                exchanged.production += dissipated * per_energy;
            }
            if let Some(force) = force.as_deref_mut() {
                force.iter_mut().zip(&v).for_each(|(force, v)| *force += v);
            }
        }
        let is_finite = exchanged.production.is_finite()
            && exchanged.entries.iter().all(|rate| rate.is_finite());
        is_finite.then_some(exchanged)
    }
}

super::open_flow! {
    [S: Equations] OpenEquations<S>: FromEquations<Kept<'static>>,
    weighs errors: false, catches panics: true, visit
}

impl<S: Equations> Written for OpenEquations<S> {
    fn vector(directions: &Directions) -> Self::Vector {
        let (v, beside) = directions.numbers().split_at(directions.len());
        super::Beside { v: Directions::of(v), beside: beside.to_vec() }
    }

    fn directions(v: &Self::Vector) -> Directions {
        let mut directions = Directions::beside(v.v.len() + v.beside.len(), v.beside.len());
        directions.numbers_mut().copy_from_slice(&v.to_list());
        directions
    }

    fn numbers(values: &Values) -> Values {
        values.clone()
    }
}
