//! The flow of a typed system in plain numbers, of which a run asks nearly all by [`Equations`].

use metriplectic_dynamics::invariants::Kind;
use metriplectic_dynamics::{ModelError, SecondLaw};
use metriplectic_equations::{Equations, Evaluated};
use metriplectic_manifolds::PointError;

use super::FromEquations;
use crate::step::{
    Directions, Entries, Flow, Laws, PlainNumbers, Recheck, Scales, Values, Written, both,
};
use crate::system::recheck;

/// A typed system, as far as its [`Equations`] do not say what a run asks: derivatives of its velocity, and the stack that its
/// matrices need.
pub(crate) trait Beside {
    /// [`Flow::room`].
    fn room(&self, work: &mut dyn FnMut());

    /// [`Flow::rates`].
    fn rates(&self, x: &[f64], d: &Directions) -> Option<Directions>;

    /// [`Flow::production`].
    fn production(&self, x: &[f64]) -> Option<f64>;

    /// [`Flow::is_projected`].
    fn is_projected(&self) -> bool;

    /// [`Flow::default_friction`].
    fn default_friction(&self, x: &[f64]) -> Option<f64>;

    /// [`Flow::energy_sizes`].
    fn energy_sizes(&self, ends: [&[f64]; 2]) -> [f64; 2];

    /// [`Flow::dependent_invariant`].
    fn dependent_invariant(&self, x: &[f64]) -> Option<(usize, f64)>;

    /// [`Flow::reach`].
    fn reach(&self, x: &[f64], span: f64) -> Option<Scales<Directions>>;

    /// [`Flow::velocity_terms`].
    fn velocity_terms(&self, x: &[f64], v: &Directions, sizes: &Directions) -> Option<Directions>;

    /// [`Flow::rates_and_terms`].
    fn rates_and_terms(&self, x: &[f64]) -> Option<[Directions; 2]>;

    /// [`Flow::local_error`].
    fn local_error(&self, x: &[f64], end: &[f64], h: f64) -> Option<Directions>;
}

/// A typed flow.
pub(crate) struct InTypes<'a, F>(pub(crate) &'a F);

impl<F: Written> Beside for InTypes<'_, F> {
    fn room(&self, work: &mut dyn FnMut()) {
        self.0.room(work);
    }

    fn rates(&self, x: &[f64], d: &Directions) -> Option<Directions> {
        self.0.rates(&F::read(self.0.layout(), x), &F::vector(d)).map(|v| F::directions(&v))
    }

    fn production(&self, x: &[f64]) -> Option<f64> {
        self.0.production(&F::read(self.0.layout(), x))
    }

    fn is_projected(&self) -> bool {
        self.0.is_projected()
    }

    fn default_friction(&self, x: &[f64]) -> Option<f64> {
        self.0.default_friction(&F::read(self.0.layout(), x))
    }

    fn energy_sizes(&self, ends: [&[f64]; 2]) -> [f64; 2] {
        let [x, y] = both(ends, |x| F::read(self.0.layout(), x));
        self.0.energy_sizes([&x, &y])
    }

    fn dependent_invariant(&self, x: &[f64]) -> Option<(usize, f64)> {
        self.0.dependent_invariant(&F::read(self.0.layout(), x))
    }

    fn reach(&self, x: &[f64], span: f64) -> Option<Scales<Directions>> {
        let Scales { sizes, terms } = self.0.reach(&F::read(self.0.layout(), x), span)?;
        Some(Scales { sizes: F::directions(&sizes), terms: F::directions(&terms) })
    }

    fn velocity_terms(&self, x: &[f64], v: &Directions, sizes: &Directions) -> Option<Directions> {
        let x = F::read(self.0.layout(), x);
        let terms = self.0.velocity_terms(&x, &F::vector(v), &F::vector(sizes))?;
        Some(F::directions(&terms))
    }

    fn rates_and_terms(&self, x: &[f64]) -> Option<[Directions; 2]> {
        let [rates, terms] = self.0.rates_and_terms(&F::read(self.0.layout(), x))?;
        Some([F::directions(&rates), F::directions(&terms)])
    }

    fn local_error(&self, x: &[f64], end: &[f64], h: f64) -> Option<Directions> {
        let [x, end] = both([x, end], |x| F::read(self.0.layout(), x));
        self.0.local_error(&x, &end, h).map(|v| F::directions(&v))
    }
}

/// The flow of a typed system in plain numbers: its [`Equations`], and what stands beside them.
pub(crate) struct Answered<'a> {
    pub(crate) numbers: FromEquations<&'a dyn Equations>,
    beside: &'a dyn Beside,
}

impl<'a> Answered<'a> {
    pub(crate) const fn of(system: &'a dyn Equations, beside: &'a dyn Beside) -> Self {
        Self { numbers: FromEquations(system), beside }
    }
}

/// Answers as [`FromEquations`] does.
macro_rules! by_equations {
    ($(fn $name:ident(&self$(, $argument:ident: $of:ty)*) -> $result:ty;)*) => {$(
        fn $name(&self$(, $argument: $of)*) -> $result {
            self.numbers.$name($($argument),*)
        }
    )*};
}

impl Flow for Answered<'_> {
    type Space = PlainNumbers;
    type Numbers = Values;
    type Vector = Directions;

    by_equations! {
        fn laws(&self, x: &Entries) -> Laws<Values>;
        fn term_sizes(&self, x: &Entries) -> Laws<Values>;
        fn sizes(&self, x: &Entries) -> Directions;
        fn moved(&self, x: &Entries, d: &Directions) -> Entries;
        fn displacement(&self, x: &Entries, y: &Entries) -> Option<Directions>;
        fn onto(&self, y: &Entries, laws: &Laws<Values>, entropy: Option<f64>) -> Option<Entries>;
        fn element(&self, entries: &[f64]) -> Result<Entries, PointError>;
        fn entropy_law(&self) -> SecondLaw;
        fn evaluated(&self, x: &Entries) -> Vec<Evaluated>;
        fn kinds(&self) -> Vec<Kind>;
        fn check(&self, x0: &Entries) -> Result<(), ModelError>;
        fn is_verified(&self) -> bool;
        fn rechecks(&self, occasion: Recheck) -> bool;
        fn defect(&self, x: &Entries) -> f64;
        fn entropy_round_off(&self, ends: [&Entries; 2]) -> f64;
    }

    fn room(&self, work: &mut dyn FnMut()) {
        self.beside.room(work);
    }

    fn rates(&self, x: &Entries, d: &Directions) -> Option<Directions> {
        self.beside.rates(x, d)
    }

    fn production(&self, x: &Entries) -> Option<f64> {
        self.beside.production(x)
    }

    fn recheck(&self, x: &Entries, occasion: Recheck) -> Result<(), ModelError> {
        recheck(self.numbers.0, x, occasion)
    }

    fn is_projected(&self) -> bool {
        self.beside.is_projected()
    }

    fn default_friction(&self, x: &Entries) -> Option<f64> {
        self.beside.default_friction(x)
    }

    fn energy_sizes(&self, [x, y]: [&Entries; 2]) -> [f64; 2] {
        self.beside.energy_sizes([x, y])
    }

    fn dependent_invariant(&self, x: &Entries) -> Option<(usize, f64)> {
        self.beside.dependent_invariant(x)
    }

    fn reach(&self, x: &Entries, span: f64) -> Option<Scales<Directions>> {
        self.beside.reach(x, span)
    }

    fn velocity_terms(
        &self,
        x: &Entries,
        v: &Directions,
        sizes: &Directions,
    ) -> Option<Directions> {
        self.beside.velocity_terms(x, v, sizes)
    }

    fn rates_and_terms(&self, x: &Entries) -> Option<[Directions; 2]> {
        self.beside.rates_and_terms(x)
    }

    fn local_error(&self, x: &Entries, end: &Entries, h: f64) -> Option<Directions> {
        self.beside.local_error(x, end, h)
    }
}
