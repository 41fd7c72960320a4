//! A system in plain numbers with the answers that do not change.

use metriplectic_equations::{Equations, Evaluated, Kind, Model, PointError, SecondLaw, Sizes};

/// A system whose sizes and promise are asked for once, and which is not asked for the charts of a vector space.
#[expect(missing_debug_implementations, reason = "systems have no `Debug`")]
pub struct Kept<'a> {
    system: &'a dyn Equations,
    /// The time at which it is asked, whatever time it is.
    time: Option<f64>,
    sizes: Sizes,
    second_law: SecondLaw,
    is_vector_space: bool,
}

impl<'a> Kept<'a> {
    pub(crate) fn new(system: &'a dyn Equations) -> Self {
        let (sizes, second_law) = (system.sizes(), system.second_law());
        let is_vector_space = system.is_vector_space();
        Self { system, time: None, sizes, second_law, is_vector_space }
    }

    /// The system at one time, whose parts are not known apart: they would be asked at another one.
    pub(crate) fn at(system: &'a dyn Equations, time: f64) -> Self {
        Self { time: Some(time), ..Self::new(system) }
    }

    #[inline]
    fn time(&self, t: f64) -> f64 {
        self.time.unwrap_or(t)
    }
}

/// A number for each pair.
#[inline]
fn each(to: &mut [f64], a: &[f64], b: &[f64], of: impl Fn(f64, f64) -> f64) {
    for ((to, a), b) in to.iter_mut().zip(a).zip(b) {
        *to = of(*a, *b);
    }
}

impl Equations for Kept<'_> {
    #[inline]
    fn sizes(&self) -> Sizes {
        self.sizes
    }

    fn values(&self, t: f64, x: &[f64], values: &mut [f64]) {
        self.system.values(self.time(t), x, values);
    }

    #[inline]
    fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        self.system.differentials(self.time(t), x, values, w);
    }

    #[inline]
    fn velocity(&self, t: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
        self.system.velocity(self.time(t), x, v)
    }

    #[inline]
    fn second_law(&self) -> SecondLaw {
        self.second_law
    }

    fn evaluated(&self, x: &[f64]) -> Vec<Evaluated> {
        self.system.evaluated(x)
    }

    fn kind(&self, invariant: usize) -> Kind {
        self.system.kind(invariant)
    }

    fn check(&self, x: &[f64]) -> Result<(), PointError> {
        self.system.check(x)
    }

    #[inline]
    fn defect(&self, x: &[f64]) -> f64 {
        if self.is_vector_space {
            x.iter().fold(0.0, |sum, entry| sum + 0.0 * entry)
        } else {
            self.system.defect(x)
        }
    }

    #[inline]
    fn scales(&self, x: &[f64], sizes: &mut [f64]) {
        if self.is_vector_space {
            each(sizes, x, x, |x, _| x.abs());
        } else {
            self.system.scales(x, sizes);
        }
    }

    #[inline]
    fn is_vector_space(&self) -> bool {
        self.is_vector_space
    }

    #[inline]
    fn chart(&self, x: &[f64], q: &[f64], y: &mut [f64]) {
        if self.is_vector_space {
            each(y, x, q, |x, q| x + q);
        } else {
            self.system.chart(x, q, y);
        }
    }

    #[inline]
    fn coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) -> bool {
        if self.is_vector_space {
            each(q, y, x, |y, x| y - x);
            q.iter().all(|q| q.is_finite())
        } else {
            self.system.coordinates(x, y, q)
        }
    }

    #[inline]
    fn stage_state(&self, x: &[f64], q: &[f64], y: &mut [f64]) -> bool {
        if self.is_vector_space {
            each(y, x, q, |x, q| x + q);
            // A state that is no number has no velocity.
            true
        } else {
            self.system.stage_state(x, q, y)
        }
    }

    #[inline]
    fn stage_coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) {
        if self.is_vector_space {
            each(q, y, x, |y, x| y - x);
        } else {
            self.system.stage_coordinates(x, y, q);
        }
    }

    #[inline]
    fn stage_rates(&self, x: &[f64], q: &[f64], y: &[f64], v: &[f64], rates: &mut [f64]) {
        if self.is_vector_space {
            rates.copy_from_slice(v);
        } else {
            self.system.stage_rates(x, q, y, v, rates);
        }
    }

    #[inline]
    fn velocity_with(&self, t: f64, x: &[f64], w: &[f64], v: &mut [f64]) -> Option<f64> {
        self.system.velocity_with(self.time(t), x, w, v)
    }

    #[inline]
    fn stage(&self, t: f64, x: &[f64], q: &[f64], rates: &mut [f64]) -> Option<f64> {
        self.system.stage(self.time(t), x, q, rates)
    }

    fn is_verified(&self) -> bool {
        self.system.is_verified()
    }

    #[inline]
    fn model(&self) -> Option<&dyn Model> {
        if self.time.is_some() { None } else { self.system.model() }
    }
}
