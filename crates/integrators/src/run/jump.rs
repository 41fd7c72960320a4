//! Events that change the state: the map that was asked for, and what it has exchanged.

use std::any::{Any, type_name};
use std::sync::Arc;

use metriplectic_fields::Real;

use crate::round_off::sum::plus;
use crate::run::span_error::SpanError;
use crate::run::state::State;
use crate::step::{Element, Entries, EventExchange, Listed, StateSpace};

/// A jump of the state at an event, asked for by [`Watched::jump`](crate::Watched::jump).
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(bound = "M: StateSpace"))]
#[non_exhaustive]
pub struct Jump<M: StateSpace> {
    /// The state after it.
    pub after: State<M>,
    /// The work and the heat that it has brought into the system, and the entropy that it has given to the surroundings.
    pub exchange: EventExchange,
}

/// The balance of the jumps at one event in a run.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct JumpBalance {
    /// The name of the event.
    pub name: String,
    /// How often the state has jumped.
    pub count: usize,
    /// The work of all jumps, into the system.
    pub work: f64,
    /// The heat of all jumps, into the system.
    pub heat: f64,
    /// The least change of the entropy of the system and its surroundings in a jump.
    pub least_rise: f64,
}

impl JumpBalance {
    /// The balance with one more jump.
    pub(crate) fn enter(&mut self, exchange: &EventExchange, rise: f64) {
        self.least_rise = if self.count == 0 { rise } else { self.least_rise.min(rise) };
        self.count += 1;
        self.work += exchange.work;
        self.heat += exchange.heat;
    }

    pub(crate) const fn new(name: String) -> Self {
        Self { name, count: 0, work: 0.0, heat: 0.0, least_rise: 0.0 }
    }
}

/// The exchange by jumps of a system whose states have no ledger, as sums of two numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Exchanged {
    pub(crate) energy: [f64; 2],
    /// The entropy of the surroundings.
    pub(crate) entropy: [f64; 2],
}

impl Exchanged {
    pub(crate) const NOTHING: Self = Self { energy: [0.0; 2], entropy: [0.0; 2] };

    pub(crate) fn enter(&mut self, &EventExchange { work, heat, entropy }: &EventExchange) {
        self.energy = plus(plus(self.energy, work), heat);
        self.entropy = plus(self.entropy, entropy);
    }

    /// The energy of a run that started with this one.
    #[inline]
    pub(crate) const fn energy_after(&self, initial: f64) -> f64 {
        (initial + self.energy[0]) + self.energy[1]
    }
}

/// The state after an event, from the time and the state at which it was found.
type Map<P> = dyn Fn(f64, &P) -> P + Send + Sync;

/// A map of points as a type that can be recovered from `dyn Any`.
struct Function<P>(Box<Map<P>>);

/// A number at a time and a state that carry derivatives.
type SmoothFunction<P> = dyn Fn(Real, &P) -> Real + Send + Sync;
/// A state at a time and a state that carry derivatives.
type SmoothMap<P> = dyn Fn(Real, &P) -> P + Send + Sync;

/// The function of an event and the map of its jump, if there is one, at numbers that carry derivatives.
pub(crate) struct SmoothEvent<P> {
    pub(crate) function: Box<SmoothFunction<P>>,
    pub(crate) map: Option<Box<SmoothMap<P>>>,
}

/// A jump that was asked for.
#[derive(Clone)]
pub(crate) struct JumpRequest {
    point: &'static str,
    /// The type that the points should have, if it is another one than that of the run.
    expected: Option<&'static str>,
    function: Arc<dyn Any + Send + Sync>,
    /// The temperature of the surroundings that give the energy as heat.
    pub(crate) temperature: Option<f64>,
    /// Whether the entropy of the system and its surroundings may fall.
    pub(crate) lowers: bool,
}

impl JumpRequest {
    pub(crate) fn new<P: 'static>(map: impl Fn(f64, &P) -> P + Send + Sync + 'static) -> Self {
        let function = Arc::new(Function::<P>(Box::new(map)));
        let point = type_name::<P>();
        let expected = None;
        Self { point, expected, function, temperature: None, lowers: false }
    }

    /// Compares the maps by identity, and the options.
    pub(crate) fn is(&self, other: &Self) -> bool {
        self.temperature == other.temperature
            && self.lowers == other.lowers
            && Arc::ptr_eq(&self.function, &other.function)
    }

    /// Translates the jump to states in plain numbers.
    pub(crate) fn in_numbers<F: Listed>(&self, flow: &F) -> Self {
        let expected = Some(type_name::<Element<F>>());
        let Ok(map) = Arc::clone(&self.function).downcast::<Function<Element<F>>>() else {
            return Self { expected, ..self.clone() };
        };
        let layout = flow.layout().clone();
        let read = F::read as fn(&F::Layout, &[f64]) -> Element<F>;
        let led = F::led as fn(&Element<F>, Element<F>) -> Element<F>;
        let write = F::write as fn(&Element<F>) -> Entries;
        let map = move |time: f64, x: &Entries| {
            let x = read(&layout, x);
            write(&led(&x, (map.0)(time, &x)))
        };
        let function = Arc::new(Function::<Entries>(Box::new(map)));
        Self { expected, function, ..*self }
    }

    /// Translates a jump of states in plain numbers to those of a flow.
    pub(crate) fn in_types<F: Listed>(&self, flow: &F) -> Self {
        let expected = Some(type_name::<Entries>());
        let Ok(map) = Arc::clone(&self.function).downcast::<Function<Entries>>() else {
            return Self { expected, ..self.clone() };
        };
        let layout = flow.layout().clone();
        let read = F::read as fn(&F::Layout, &[f64]) -> Element<F>;
        let write = F::write as fn(&Element<F>) -> Entries;
        let map = move |time: f64, x: &Element<F>| read(&layout, &(map.0)(time, &write(x)));
        let function = Arc::new(Function::<Element<F>>(Box::new(map)));
        Self { expected, function, ..*self }
    }

    /// The jump on the states of a run.
    pub(crate) fn on<M: StateSpace>(self, index: usize) -> Result<JumpOn<M>, SpanError> {
        if let Some(temperature) = self.temperature
            && !(temperature > 0.0 && temperature.is_finite())
        {
            return Err(SpanError::JumpTemperature { index, temperature });
        }
        match Arc::clone(&self.function).downcast::<Function<M::Element>>() {
            Ok(map) => Ok(JumpOn { map, temperature: self.temperature, lowers: self.lowers }),
            Err(_) => {
                let expected = self.expected.unwrap_or(type_name::<M::Element>());
                Err(SpanError::EventPoint { index, found: self.point, expected })
            }
        }
    }
}

/// A jump on the states of a run.
pub(crate) struct JumpOn<M: StateSpace> {
    map: Arc<Function<M::Element>>,
    pub(crate) temperature: Option<f64>,
    pub(crate) lowers: bool,
}

impl<M: StateSpace> Clone for JumpOn<M> {
    fn clone(&self) -> Self {
        Self { map: Arc::clone(&self.map), ..*self }
    }
}

impl<M: StateSpace> JumpOn<M> {
    /// The state to which it leads.
    pub(crate) fn to(&self, state: &State<M>) -> M::Element {
        (self.map.0)(state.time, &state.point)
    }

    /// Returns the exchange of a change of the energy: heat if the surroundings have a temperature, and work if not.
    pub(crate) fn exchange(&self, energy: f64) -> EventExchange {
        match self.temperature {
            Some(temperature) => {
                EventExchange { work: 0.0, heat: energy, entropy: -energy / temperature }
            }
            None => EventExchange { work: energy, ..EventExchange::default() },
        }
    }
}
