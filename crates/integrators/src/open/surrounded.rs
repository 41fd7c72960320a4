//! Surroundings of a flow of points whose number is known at run time: of a lattice, or of a system of your own.

use metriplectic_dynamics::ModelError;
use metriplectic_equations::{Apart, Path};

use super::beside::Beside;
use super::state::{Ledger, OpenSpace, OpenState};
use crate::explicit::{Combination, Limit, Projected, ProjectionError, StageFlow, Target};
use crate::implicit::NoImplicitSteps;
use crate::step::{
    Element, Flow, FlowError, Laws, Listed, Scales, StateSpace, StepError, Vector as _,
};

/// The effect of all ports and baths, in a unit of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Exchanged {
    /// The work of each port; the heat and the entropy of each bath.
    pub entries: Vec<f64>,
    /// The entropy `Σ_b ⟨A, R A⟩/T` that is produced.
    pub production: f64,
}

/// A point of an open flow, without clock and ledger.
pub type PointOf<F> = <<F as OpenFlow>::Points as StateSpace>::Element;
/// A state of an open flow.
pub type StateOf<F> = OpenState<PointOf<F>>;

/// A flow with a clock, ports and baths around points, of which the flow without them is known at each time.
///
/// The macro `open_flow` makes it a [`Flow`] for explicit methods, and for implicit ones by [`OpenSteps`](super::OpenSteps). The flows of
/// this library that are written out by it are open lattices and [`OpenEquations`](super::OpenEquations).
pub trait OpenFlow:
    Flow<Space = OpenSpace<Self::Points>, Vector = Beside<Self::Velocity>> + Sized
{
    /// The space of the points.
    type Points: StateSpace;
    /// A number for each direction of the points.
    type Velocity: crate::step::Vector;
    /// The differentials of the laws of the points.
    type Gradients: Clone + std::fmt::Debug;
    /// The flow of the points at one time.
    type Closed<'a>: StageFlow<
            Space = Self::Points,
            Vector = Self::Velocity,
            Numbers = <Self as Flow>::Numbers,
            Gradients = Self::Gradients,
        > + Listed<Layout = ()>
    where
        Self: 'a;

    /// The flow of the points with the energy at a time, without ports and baths.
    fn at(&self, t: f64) -> Self::Closed<'_>;

    /// Calls `f` with the parts of this flow in plain numbers; `None` if they are not known apart.
    fn with_parts<T>(&self, t: f64, f: impl FnOnce(&dyn Apart) -> T) -> Option<T>;

    /// Refuses points without implicit steps in plain numbers.
    ///
    /// # Errors
    ///
    /// [`NoImplicitSteps`].
    fn serve_points(&self, path: Path) -> Result<(), NoImplicitSteps>;

    /// The ledger of the ports and baths, on which nothing is booked.
    fn empty(&self) -> &Ledger;

    /// Returns whether the energy depends on time.
    fn has_clock(&self) -> bool;

    /// The rate `∂_tH(t, x)`; zero if the energy does not depend on time.
    fn power(&self, t: f64, x: &PointOf<Self>) -> f64;

    /// The work `H(t', x) − H(t, x)` at a frozen point; zero if the energy does not depend on time.
    fn frozen_work(&self, [t, end]: [f64; 2], x: &PointOf<Self>) -> f64 {
        if !self.has_clock() {
            return 0.0;
        }
        self.at(end).laws(x).energy - self.at(t).laws(x).energy
    }

    /// The velocity of the points with ports and baths, what these exchange, and the production of all of it. The differentials are
    /// given if they are known. `None` where it has no value.
    fn velocity_of(
        &self,
        t: f64,
        x: &PointOf<Self>,
        gradients: Option<&Self::Gradients>,
    ) -> Option<(Self::Velocity, Exchanged)>;

    /// Sums the effects of ports and baths at a point with these covectors of energy and entropy, and adds their velocity to `force`.
    /// `None` where they have no value, or a temperature is negative.
    fn exchanged(
        &self,
        t: f64,
        x: &[f64],
        w: [&[f64]; 2],
        force: Option<&mut [f64]>,
    ) -> Option<Exchanged>;

    /// The temperature of each bath at a time.
    fn temperatures(&self, t: f64) -> Vec<f64>;

    /// The temperature of each bath at a time, with the index of its heat among the entries of ports and baths.
    fn baths(&self, t: f64) -> Vec<(usize, f64)> {
        self.empty().heats().zip(self.temperatures(t)).collect()
    }

    /// Returns whether a bath takes energy alone.
    fn has_cold_bath(&self) -> bool;

    /// Returns whether the laws were verified before the run.
    fn was_verified(&self) -> bool;

    /// Verifies the flow of the points at the start of a run.
    ///
    /// # Errors
    ///
    /// The first law that is broken.
    fn check_points(&self, x0: &StateOf<Self>) -> Result<(), ModelError>;

    /// Verifies at the start of a run what only this flow knows of its points.
    ///
    /// # Errors
    ///
    /// The error of the points.
    fn examine_points(&self, x0: &StateOf<Self>) -> Result<(), FlowError>;

    /// Checks at a state that ports and baths have values, that ports carry no entropy, that they keep the further invariants, and that
    /// no temperature and no friction is negative.
    ///
    /// # Errors
    ///
    /// The first law that is broken.
    fn check_exchange(&self, x: &StateOf<Self>) -> Result<(), ModelError>;

    /// Checks at a state that the rate of the energy in time is that of its values, as
    /// [`compare_with_values`](super::compare_with_values) does.
    ///
    /// # Errors
    ///
    /// [`ModelError::LostTimeDerivative`] or [`ModelError::DerivativeNotFinite`].
    fn check_clock(&self, x: &StateOf<Self>) -> Result<(), ModelError>;
}

/// The laws of an open flow at a state, with the differentials of those of its points.
#[derive(Clone, Debug)]
pub struct OpenJets<G, N> {
    /// Of the points.
    pub gradients: G,
    /// The balance.
    pub values: Laws<N>,
}

/// The laws of an open flow with their differentials.
pub type JetsOf<F> = OpenJets<<F as OpenFlow>::Gradients, <F as Flow>::Numbers>;

/// The fraction of the energy to which the errors of work and heat are relative as long as less has flowed.
const LITTLE: f64 = 1e-3;

/// The entropy of heat: a bath at zero takes none.
#[must_use]
pub fn per_energy(temperature: f64) -> f64 {
    if temperature > 0.0 { temperature.recip() } else { 0.0 }
}

/// The state to which a displacement of the clock and the ledger leads, at this point.
pub fn advanced<F: OpenFlow>(
    flow: &F,
    x: &StateOf<F>,
    beside: &[f64],
    point: PointOf<F>,
) -> StateOf<F> {
    let time = x.time + beside[0];
    let frozen = flow.frozen_work([x.time, time], &x.x);
    let ledger = if flow.has_clock() {
        let mut entries = beside[1..].to_vec();
        entries[0] += frozen;
        x.ledger.with_entries(&entries)
    } else {
        x.ledger.with_entries(&beside[1..])
    };
    OpenState { x: point, time, ledger }
}

/// The displacement of the clock and the ledger between two states, beside the frozen work at the first one.
pub fn between<F: OpenFlow>(flow: &F, x: &StateOf<F>, y: &StateOf<F>) -> Vec<f64> {
    let mut beside = vec![y.time - x.time];
    beside.extend(y.ledger.entries_since(&x.ledger));
    beside[1] -= flow.frozen_work([x.time, y.time], &x.x);
    beside
}

/// The laws with their differentials, from those of the point.
pub fn jets_at<F: OpenFlow>(flow: &F, x: &StateOf<F>, gradients: F::Gradients) -> JetsOf<F> {
    OpenJets { values: x.ledger.balanced(flow.at(x.time).values(&gradients)), gradients }
}

/// The velocity with the rates of the clock and the ledger, and the production. The rate of the work of the time is that of
/// [`stage_rates`].
pub fn velocity<F: OpenFlow>(
    flow: &F,
    x: &StateOf<F>,
    gradients: Option<&F::Gradients>,
) -> Option<(Beside<F::Velocity>, f64)> {
    let (v, Exchanged { entries, production }) = flow.velocity_of(x.time, &x.x, gradients)?;
    let mut beside = Vec::with_capacity(2 + entries.len());
    beside.extend([1.0, 0.0]);
    beside.extend(entries);
    let is_finite = production.is_finite() && beside.iter().all(|rate| rate.is_finite());
    is_finite.then(|| (Beside { v, beside }, production))
}

/// The rates in the chart of a stage. The work of the time has its rate beside that at the frozen start.
pub fn stage_rates<F: OpenFlow>(
    flow: &F,
    x: &StateOf<F>,
    (q, y): (&Beside<F::Velocity>, &StateOf<F>),
    v: &Beside<F::Velocity>,
) -> Beside<F::Velocity> {
    let mut beside = v.beside.clone();
    if flow.has_clock() {
        beside[1] = flow.power(y.time, &y.x) - flow.power(y.time, &x.x);
    }
    Beside { v: flow.at(y.time).stage_rates(&x.x, (&q.v, &y.x), &v.v), beside }
}

/// Moves the point alone. The energy of the points is to be the target and what has flowed in, their entropy the target less
/// what the baths have gained.
///
/// # Errors
///
/// [`ProjectionError`] if no state near by has these laws.
pub fn project<F>(
    flow: &F,
    y: StateOf<F>,
    target: &Target<'_, F>,
    has_entropy: bool,
) -> Result<Projected<F>, ProjectionError>
where
    F: OpenFlow + StageFlow<Gradients = JetsOf<F>>,
{
    let OpenState { x, time, ledger } = y;
    let (laws, of_baths) = (ledger.targets(target.laws), ledger.entropy_of_baths());
    let terms = target.error.into_iter().flat_map(|error| error.terms);
    let terms: Vec<_> = terms.map(|&(w, v)| (w, &v.v)).collect();
    let of_points = |error: Combination<'_, _>| Combination { factor: error.factor, terms: &terms };
    let inner = Target {
        laws: &laws,
        with_entropy: target.with_entropy && has_entropy,
        limit: target.limit.map(|limit: Limit<'_, Beside<F::Velocity>>| limit.map(|v| &v.v)),
        units: target.units.map(|v| &v.v),
        error: target.error.map(of_points),
    };
    let Projected { x, gradients, entropy, entropy_round_off } =
        flow.at(time).project(x, &inner)?;
    // Without an entropy of their own, the points leave that of the baths as it is.
    let entropy = if has_entropy { entropy } else { 0.0 };
    let x = OpenState { x, time, ledger };
    Ok(Projected {
        gradients: jets_at(flow, &x, gradients),
        x,
        entropy: entropy + of_baths,
        entropy_round_off: entropy_round_off + 2.0 * f64::EPSILON * of_baths.abs(),
    })
}

/// The state at another reading of the clock, at the same point.
pub fn clocked<F: OpenFlow>(flow: &F, x: &StateOf<F>, time: f64) -> Option<StateOf<F>> {
    if x.time.to_bits() == time.to_bits() {
        return None;
    }
    let mut beside = vec![0.0; 1 + x.ledger.entry_sizes().len()];
    beside[0] = time - x.time;
    Some(OpenState { time, ..advanced(flow, x, &beside, x.x.clone()) })
}

/// The sizes of the entries of the ledger where little has flowed.
pub fn with_ledger_sizes<F: OpenFlow>(
    flow: &F,
    x: &StateOf<F>,
    mut scales: Scales<Beside<F::Velocity>>,
) -> Scales<Beside<F::Velocity>> {
    let energy = LITTLE * flow.at(x.time).term_sizes(&x.x).energy;
    let mut known = vec![energy; scales.sizes.beside.len()];
    known[0] = 0.0;
    for (heat, temperature) in flow.baths(x.time) {
        known[heat + 3] = energy * per_energy(temperature);
    }
    for (size, known) in scales.sizes.beside.iter_mut().zip(known) {
        *size = size.max(known);
    }
    scales
}

/// Looks at the ends of a step: at ports and baths, and for a jump of the energy in time inside a step of a fixed size.
///
/// # Errors
///
/// [`StepError::Model`] or [`StepError::ProtocolJumps`].
pub fn inspect<F: OpenFlow>(
    flow: &F,
    ends: [&StateOf<F>; 2],
    of_one_size: bool,
) -> Result<(), StepError> {
    let (times, point) = (ends.map(|x| x.time), &ends[1].x);
    if of_one_size && flow.has_clock() {
        let frozen = flow.frozen_work(times, point);
        let terms = || flow.energy_sizes(ends)[0];
        super::verify::protocol(times, frozen, |t| flow.power(t, point), terms)?;
    }
    flow.check_exchange(ends[1])
        .map_err(|law| StepError::Model { time: ends[1].time, law: Box::new(law) })
}

/// The state with these entries.
///
/// # Errors
///
/// [`PointError`](metriplectic_manifolds::PointError) if they are none.
pub fn element<F: OpenFlow>(
    flow: &F,
    entries: &[f64],
) -> Result<StateOf<F>, metriplectic_manifolds::PointError> {
    let beside = 1 + flow.empty().numbers().len();
    let Some(length) = entries.len().checked_sub(beside) else {
        let found = entries.len();
        return Err(metriplectic_manifolds::PointError::Length { found, expected: beside });
    };
    let (point, rest) = entries.split_at(length);
    let x = flow.at(rest[0]).element(point)?;
    Ok(OpenState { x, time: rest[0], ledger: flow.empty().with_numbers(&rest[1..]) })
}

/// The difference between a displacement and Simpson's rule over it, with the middle of the cubic through both ends: an estimate of
/// the local error of a step.
pub fn against_simpson<F: Flow>(
    flow: &F,
    x: &Element<F>,
    end: &Element<F>,
    h: f64,
) -> Option<F::Vector> {
    let q = flow.displacement(x, end)?;
    let (start, there) = (flow.rates(x, &q.zero())?, flow.rates(x, &q)?);
    let middle = crate::step::Vector::zip([&q, &there, &start], |[q, there, start]| {
        0.5 * q - (there - start) * (h / 8.0)
    });
    let middle = flow.rates(x, &middle)?;
    Some(crate::step::Vector::zip([&q, &start, &middle, &there], |[q, start, middle, there]| {
        q - (start + 4.0 * middle + there) * (h / 6.0)
    }))
}
