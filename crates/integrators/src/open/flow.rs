//! An open system as a flow.

use std::sync::Arc;

use metriplectic_dynamics::exchange::{Entries as _, Exchange};
use metriplectic_dynamics::velocity::{differentials, irreversible};
use metriplectic_dynamics::{
    Dissipation as _, Metriplectic, ModelError, SecondLaw, VectorField, Verify as _,
    invariants::Kind, system::Point,
};
use metriplectic_equations::Evaluated;
use metriplectic_fields::{ChartPoint, Column, Space as _, Vector};
use metriplectic_manifolds::{Manifold, PointError};

use super::clock::Clock;
use super::state::{Booked, Columns, Ledger, OpenSpace, OpenState};
use super::system::{CovectorsOf, Direction, OpenSystem, StateOf};
use super::vector::OpenVector;
use crate::explicit::{StageFlow as _, Target};
use crate::round_off::bound::{NO_DIGITS, of_an_increment, size_of_terms, sizes_on_a_step};
use crate::step::scales::relative;
use crate::step::{
    self, Components, Directions, EventExchange, Flow, FlowVisitor, Laws, LedgerErrors,
    LedgerSummary, Listed, Numbers, Recheck, Scales, StartError, StateSpace as _, StepError,
    Values, Vector as _, Written,
};
use crate::system::default_friction;

impl<Y, C, X> Flow for OpenSystem<Y, C, X>
where
    Y: Metriplectic,
    C: Clock<Y::Manifold, Y::Energy>,
    X: Exchange<Y::Manifold, Y::Metric>,
{
    type Space = OpenSpace<Y::Manifold>;
    type Numbers = Numbers<Y>;
    type Vector = Direction<Y, X>;

    fn room(&self, work: &mut dyn FnMut()) {
        self.closed().room(work);
    }

    fn laws(&self, x: &StateOf<Y>) -> Laws<Numbers<Y>> {
        let laws = self.closed().laws(&x.x);
        x.ledger.balanced(Laws { energy: self.energy(x.time, &x.x), ..laws })
    }

    fn term_sizes(&self, x: &StateOf<Y>) -> Laws<Numbers<Y>> {
        let sizes = self.closed().term_sizes(&x.x);
        let view = self.frozen(x.time);
        let energy = size_of_terms::<Y::Manifold>(view.energy(), &x.x) + x.ledger.net().abs();
        Laws { energy, entropy: sizes.entropy + x.ledger.entropy_of_baths().abs(), ..sizes }
    }

    fn rates(&self, x: &StateOf<Y>, d: &Direction<Y, X>) -> Option<Direction<Y, X>> {
        let t = x.time + d.clock;
        let at = ChartPoint { base: x.x.clone(), q: d.v };
        let v = VectorField::velocity(&self.frozen(t), &at).ok()?;
        let y = Y::Manifold::chart(&x.x, &d.v);
        let parameter = if C::RUNS { self.power(t, &y) - self.power(t, &x.x) } else { 0.0 };
        let entries = self.entry_rates(t, &y, &self.covectors(t, &y))?;
        Some(OpenVector { v, clock: 1.0, booked: Booked { parameter, entries } })
    }

    fn sizes(&self, x: &StateOf<Y>) -> Direction<Y, X> {
        OpenVector { booked: x.ledger.sizes(), ..OpenVector::of(Y::Manifold::scales(&x.x)) }
    }

    fn moved(&self, x: &StateOf<Y>, d: &Direction<Y, X>) -> StateOf<Y> {
        self.advanced(x, d, Y::Manifold::chart(&x.x, &d.v))
    }

    fn displacement(&self, x: &StateOf<Y>, y: &StateOf<Y>) -> Option<Direction<Y, X>> {
        let q = Y::Manifold::coordinates(&x.x, &y.x);
        (q.is_finite() && Y::Manifold::is_near(&q)).then(|| self.direction(x, y, q))
    }

    fn production(&self, x: &StateOf<Y>) -> Option<f64> {
        let w = self.covectors(x.time, &x.x);
        let exchanged = self.exchanged(x.time, &x.x, [&w.energy, &w.entropy]).ok()?.production;
        let production = self.internal_production(x.time, &x.x, &w)? + exchanged;
        production.is_finite().then_some(production)
    }

    fn onto(
        &self,
        y: &StateOf<Y>,
        laws: &Laws<Numbers<Y>>,
        entropy: Option<f64>,
    ) -> Option<StateOf<Y>> {
        let laws = Laws { entropy: entropy.unwrap_or(laws.entropy), ..*laws };
        let with_entropy = entropy.is_some();
        let target = Target { laws: &laws, with_entropy, limit: None, units: None, error: None };
        self.project(y.clone(), &target).ok().map(|end| end.x)
    }

    fn element(&self, entries: &[f64]) -> Result<StateOf<Y>, PointError> {
        let beside = 1 + Ledger::length(self.columns());
        let Some(length) = entries.len().checked_sub(beside) else {
            return Err(PointError::Length { found: entries.len(), expected: beside });
        };
        let (point, rest) = entries.split_at(length);
        let x = self.closed().manifold().from_entries(point)?;
        Ok(OpenState { x, time: rest[0], ledger: Ledger::read(self.columns(), &rest[1..]) })
    }

    fn begin(&self, x: StateOf<Y>, time: f64) -> Result<StateOf<Y>, StartError> {
        x.begun(time, &Ledger::empty(self.columns()))
    }

    fn clocked(&self, x: &StateOf<Y>, time: f64) -> Option<StateOf<Y>> {
        if x.time.to_bits() == time.to_bits() {
            return None;
        }
        let work = Booked {
            parameter: self.frozen_work([x.time, time], &x.x),
            ..Booked::<X::Entries>::nothing()
        };
        Some(OpenState { x: x.x.clone(), time, ledger: x.ledger.with(&work) })
    }

    fn jumped(&self, x: &StateOf<Y>, y: StateOf<Y>) -> StateOf<Y> {
        x.at(y.x)
    }

    fn with_event(&self, x: &StateOf<Y>, event: &EventExchange) -> Option<StateOf<Y>> {
        Some(OpenState { ledger: x.ledger.with_event(event), ..x.clone() })
    }

    fn depends_on_time(&self) -> bool {
        true
    }

    fn ledger(&self, x: &StateOf<Y>) -> Option<LedgerSummary> {
        let parameter = C::RUNS.then(|| x.ledger.parameter_work());
        Some(x.ledger.summarised(parameter, self.entropy_at(x)))
    }

    fn has_ledger(&self) -> bool {
        true
    }

    fn ledger_errors(&self, errors: &Direction<Y, X>) -> Option<LedgerErrors> {
        Some(errors.errors(self.columns()))
    }

    fn with_ledger_sizes(
        &self,
        x: &StateOf<Y>,
        Scales { mut sizes, mut terms }: Scales<Direction<Y, X>>,
    ) -> Scales<Direction<Y, X>> {
        let Some(energy) = self.energy_of_motion(x, &sizes.v) else {
            return Scales { sizes, terms };
        };
        let speed = self.fastest(x, &sizes);
        let temperatures = self.baths(x.time);
        let entropy = |i: usize| {
            let of_bath = temperatures.iter().find(|(heat, _)| heat + 1 == i);
            of_bath.map_or(0.0, |(_, t)| if *t > 0.0 { energy / t } else { 0.0 })
        };
        let known = self.columns().sizes(energy, entropy);
        let floor = |size: f64, known: f64| size.max(LITTLE * known);
        sizes.booked = Booked {
            parameter: floor(sizes.booked.parameter, energy),
            entries: X::Entries::from_index(|i| floor(sizes.booked.entries.get(i), known[i])),
        };
        terms.booked = Booked {
            parameter: energy * speed,
            entries: X::Entries::from_index(|i| known[i] * speed),
        };
        Scales { sizes, terms }
    }

    fn inspect(&self, ends: [&StateOf<Y>; 2], of_one_size: bool) -> Result<(), StepError> {
        if of_one_size {
            self.check_protocol(ends)?;
        }
        self.check_exchange(ends[1])
            .map_err(|law| StepError::Model { time: ends[1].time, law: Box::new(law) })
    }

    /// In plain numbers, so that a run is compiled with this library.
    fn visit<V: FlowVisitor<Self>>(&self, visitor: V) -> V::Output {
        visitor.written(self)
    }

    fn entropy_law(&self) -> SecondLaw {
        match self.closed().second_law() {
            _ if self.exchange().has_cold_bath() => SecondLaw::Published,
            SecondLaw::NoEntropy if X::BATHS > 0 => SecondLaw::Exact,
            law => law,
        }
    }

    fn evaluated(&self, x: &StateOf<Y>) -> Vec<Evaluated> {
        self.closed().evaluated(&x.x)
    }

    fn kinds(&self) -> Vec<Kind> {
        self.closed().kinds()
    }

    fn is_projected(&self) -> bool {
        self.closed().dissipation().is_projected()
    }

    fn default_friction(&self, x: &StateOf<Y>) -> Option<f64> {
        default_friction(&self.without_exchange(x.time), &x.x)
    }

    fn check(&self, x0: &StateOf<Y>) -> Result<(), ModelError> {
        self.judged(x0, |model, x| model.check_start(x))
    }

    fn is_verified(&self) -> bool {
        self.has_certificate() || self.closed().is_verified()
    }

    fn rechecks(&self, _: Recheck) -> bool {
        true
    }

    fn recheck(&self, x: &StateOf<Y>, occasion: Recheck) -> Result<(), ModelError> {
        let model = self.without_exchange(x.time);
        match occasion {
            Recheck::OnTheWay { step } => {
                model.check_state(&x.x)?;
                model.look_at_derivatives(&x.x, step)
            }
            Recheck::End => {
                model.check_state(&x.x)?;
                model.check_derivatives(&x.x)?;
                self.check_clock(x)
            }
            Recheck::Failure { .. } => {
                self.check_exchange(x)?;
                model.check_around(&x.x, &[])
            }
        }
    }

    fn defect(&self, x: &StateOf<Y>) -> f64 {
        self.closed().manifold().defect(&x.x)
    }

    fn energy_sizes(&self, [x, end]: [&StateOf<Y>; 2]) -> [f64; 2] {
        let sizes = sizes_on_a_step(&self.between([x.time, end.time]), [&x.x, &end.x]);
        // What flows in may find a state without energy.
        let flowed =
            self.frozen_work([x.time, end.time], &x.x).abs() + end.ledger.flowed(&x.ledger);
        sizes.map(|size| size + flowed)
    }

    fn entropy_round_off(&self, ends: [&StateOf<Y>; 2]) -> f64 {
        let of_baths = ends.map(|x| x.ledger.entropy_of_baths().abs());
        let of_system = of_an_increment(&self.frozen(ends[0].time), ends.map(|x| &x.x));
        of_system + 4.0 * f64::EPSILON * of_baths[0].max(of_baths[1])
    }

    fn dependent_invariant(&self, x: &StateOf<Y>) -> Option<(usize, f64)> {
        self.without_exchange(x.time).dependent_invariant(&x.x)
    }

    #[inline(never)]
    fn local_error(&self, x: &StateOf<Y>, end: &StateOf<Y>, h: f64) -> Option<Direction<Y, X>> {
        let q = Y::Manifold::coordinates(&x.x, &end.x);
        if !Y::Manifold::is_near(&q) {
            return None;
        }
        let f = |t: f64, q| {
            let at = ChartPoint { base: x.x.clone(), q };
            let v = VectorField::velocity(&self.frozen(t), &at).ok()?;
            let booked = self.booking(t, [&x.x, &Y::Manifold::chart(&x.x, &q)])?;
            Some((v, booked))
        };
        let (start, there) = (f(x.time, Vector::<Y::Manifold>::zero())?, f(end.time, q)?);
        let middle = f(x.time + 0.5 * h, q * 0.5 - (there.0 - start.0) * (h / 8.0))?;
        let v = q - (start.0 + middle.0 * 4.0 + there.0) * (h / 6.0);
        let rule =
            Booked::combined(&[(h / 6.0, &start.1), (h / 1.5, &middle.1), (h / 6.0, &there.1)]);
        let booked = Booked::combined(&[(1.0, &self.booked_between(x, end)), (-1.0, &rule)]);
        Some(OpenVector { v, clock: 0.0, booked })
    }
}

impl<Y, C, X> Listed for OpenSystem<Y, C, X>
where
    Y: Metriplectic,
    C: Clock<Y::Manifold, Y::Energy>,
    X: Exchange<Y::Manifold, Y::Metric>,
{
    type Layout = Arc<Columns>;

    fn layout(&self) -> &Arc<Columns> {
        self.columns()
    }

    fn read(columns: &Arc<Columns>, entries: &[f64]) -> StateOf<Y> {
        let (point, rest) = entries.split_at(entries.len() - 1 - Ledger::length(columns));
        let ledger = Ledger::read(columns, &rest[1..]);
        OpenState { x: Y::read(&(), point), time: rest[0], ledger }
    }

    fn at_start(&self, entries: &[f64]) -> Result<StateOf<Y>, PointError> {
        match self.closed().manifold().from_entries(entries) {
            Err(PointError::Length { .. }) => self.element(entries),
            point => point.map(|x| self.start(x)),
        }
    }

    fn led(x: &StateOf<Y>, y: StateOf<Y>) -> StateOf<Y> {
        x.at(y.x)
    }

    fn write(x: &StateOf<Y>) -> step::Entries {
        OpenSpace::<Y::Manifold>::numbers(x).into()
    }
}

impl<Y, C, X> Written for OpenSystem<Y, C, X>
where
    Y: Metriplectic,
    C: Clock<Y::Manifold, Y::Energy>,
    X: Exchange<Y::Manifold, Y::Metric>,
{
    fn vector(directions: &Directions) -> Direction<Y, X> {
        let (v, rest) = directions.numbers().split_at(Vector::<Y::Manifold>::LEN);
        let entries = X::Entries::from_index(|i| rest[i + 2]);
        let booked = Booked { parameter: rest[1], entries };
        OpenVector { v: Column::from_index(|i| v[i]), clock: rest[0], booked }
    }

    fn directions(v: &Direction<Y, X>) -> Directions {
        let beside = Direction::<Y, X>::BESIDE;
        let mut directions = Directions::beside(Vector::<Y::Manifold>::LEN + beside, beside);
        let to = directions.numbers_mut().iter_mut().enumerate();
        to.for_each(|(i, to)| *to = v.get(i));
        directions
    }

    fn numbers(values: &Values) -> Numbers<Y> {
        Y::numbers(values)
    }
}

/// The fraction of the energy of the motion to which the errors of work and heat are relative as long as less has flowed.
const LITTLE: f64 = 0.1;
/// The displacement, relative to the sizes, at which the speed of a motion is looked at beside its start.
const AHEAD: f64 = 1e-3;

impl<Y, C, X> OpenSystem<Y, C, X>
where
    Y: Metriplectic,
    C: Clock<Y::Manifold, Y::Energy>,
    X: Exchange<Y::Manifold, Y::Metric>,
{
    /// The point with zeros in place of the entries whose squares have no digits.
    pub(super) fn without_tiny(&self, x: &Point<Y>) -> Result<Point<Y>, PointError> {
        let tiny = NO_DIGITS.sqrt();
        let entries = Y::Manifold::entries(x).into_iter();
        let entries: Vec<f64> = entries.map(|x| if x.abs() < tiny { 0.0 } else { x }).collect();
        self.closed().manifold().from_entries(&entries)
    }

    /// The differentials of all laws at a point.
    pub(crate) fn covectors(&self, t: f64, x: &Point<Y>) -> CovectorsOf<Y> {
        differentials(&self.without_exchange(t), &ChartPoint::<Y::Manifold>::centre(x))
    }

    /// The entropy `⟨dS, K dS⟩` that the system produces by itself.
    pub(super) fn internal_production(
        &self,
        t: f64,
        x: &Point<Y>,
        w: &CovectorsOf<Y>,
    ) -> Option<f64> {
        let model = self.without_exchange(t);
        if model.dissipation().is_none() {
            return Some(0.0);
        }
        let centre = ChartPoint::<Y::Manifold>::centre(x);
        Some(w.entropy.dot(&irreversible(&model, &model.metric_at(&centre), w).ok()?))
    }

    /// The change of the energy if each entry moves by its size: the size of work and heat, which no constant in the energy
    /// changes. `None` where it has no value or does not change.
    fn energy_of_motion(&self, x: &StateOf<Y>, sizes: &Vector<Y::Manifold>) -> Option<f64> {
        let energy = |q| self.energy(x.time, &Y::Manifold::chart(&x.x, &q));
        let here = energy(Vector::<Y::Manifold>::zero());
        let mut largest = 0.0;
        for c in 0..Vector::<Y::Manifold>::LEN {
            let moved = Vector::<Y::Manifold>::basis(c) * sizes[c];
            let changes = [moved, moved * -1.0].map(|q| (energy(q) - here).abs());
            largest =
                changes.into_iter().filter(|change| change.is_finite()).fold(largest, f64::max);
        }
        (largest > 0.0).then_some(largest)
    }

    /// The rate at which a state moves by its size, there and where it has moved by it.
    fn fastest(&self, x: &StateOf<Y>, sizes: &Direction<Y, X>) -> f64 {
        let speed = |d: &Direction<Y, X>| {
            self.rates(x, d).map(|rates| relative(&rates, sizes)).filter(|speed| speed.is_finite())
        };
        let there = OpenVector::of(sizes.v * AHEAD);
        let speeds = [speed(&OpenVector::of(Vector::<Y::Manifold>::zero())), speed(&there)];
        speeds.into_iter().flatten().fold(0.0, f64::max)
    }

    /// The rates at which a step from a point books at another one: beside the frozen work at its start.
    pub(super) fn booking(&self, t: f64, [x, y]: [&Point<Y>; 2]) -> Option<Booked<X::Entries>> {
        let parameter = if C::RUNS { self.power(t, y) - self.power(t, x) } else { 0.0 };
        let entries = self.entry_rates(t, y, &self.covectors(t, y))?;
        Some(Booked { parameter, entries })
    }

    /// The errors of what a step of the midpoint rule has booked. Its error and that of the trapezoidal rule have the ratio −½, so
    /// their difference is three times the error where the state moves along a line, and about as large where it does not.
    pub(super) fn against_trapezoid(
        &self,
        x: &StateOf<Y>,
        end: &StateOf<Y>,
        h: f64,
    ) -> Option<LedgerErrors> {
        let [first, last] = [x, end].map(|at| self.booking(at.time, [&x.x, &at.x]));
        let (first, last) = (first?, last?);
        let booked = self.booked_between(x, end);
        let third = 1.0 / 3.0;
        let weight = -0.5 * third * h;
        let booked = Booked::combined(&[(third, &booked), (weight, &first), (weight, &last)]);
        let none = OpenVector::of(Vector::<Y::Manifold>::zero());
        self.ledger_errors(&OpenVector { booked, ..none })
    }

    /// The numbers that a step has booked beside the frozen work at its start.
    pub(super) fn booked_between(&self, x: &StateOf<Y>, end: &StateOf<Y>) -> Booked<X::Entries> {
        let mut booked = end.ledger.since(&x.ledger);
        booked.parameter -= self.frozen_work([x.time, end.time], &x.x);
        booked
    }

    /// The rates of the entries of the ledger.
    pub(super) fn entry_rates(
        &self,
        t: f64,
        x: &Point<Y>,
        w: &CovectorsOf<Y>,
    ) -> Option<X::Entries> {
        if X::PORTS + X::BATHS == 0 {
            return Some(X::Entries::from_index(|_| 0.0));
        }
        Some(self.exchanged(t, x, [&w.energy, &w.entropy]).ok()?.entries)
    }

    /// The state at a point that the displacement `d` leads to.
    pub(super) fn advanced(
        &self,
        x: &StateOf<Y>,
        d: &Direction<Y, X>,
        point: Point<Y>,
    ) -> StateOf<Y> {
        let time = x.time + d.clock;
        let parameter = d.booked.parameter + self.frozen_work([x.time, time], &x.x);
        let ledger = x.ledger.with(&Booked { parameter, ..d.booked });
        OpenState { x: point, time, ledger }
    }

    /// The displacement from a state to another one, with these components.
    pub(super) fn direction(
        &self,
        x: &StateOf<Y>,
        y: &StateOf<Y>,
        v: Vector<Y::Manifold>,
    ) -> Direction<Y, X> {
        OpenVector { v, clock: y.time - x.time, booked: self.booked_between(x, y) }
    }

    /// The components of a direction, as those of the closed system.
    pub(super) fn components(d: &Direction<Y, X>) -> Components<Vector<Y::Manifold>> {
        Components(d.v)
    }
}
