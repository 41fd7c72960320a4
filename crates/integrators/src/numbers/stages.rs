//! A system in plain numbers as a flow for explicit methods, with vectors of a length that is known at run time, or when this
//! library is compiled.

use metriplectic_equations::{ENTROPY, Equations};

use super::lengths::{Lengths, List};
use super::projection::sum;
use super::rows::Rows;
use crate::round_off::bound::{NO_DIGITS, ROUNDED};
use crate::step::Vector as _;
use crate::system::NO_CLOCK;

/// The sizes of the entries of a state.
#[inline]
pub(super) fn scales<V: List>(system: &(impl Equations + ?Sized), x: &[f64]) -> V {
    let mut sizes = V::room(|| system.sizes().directions);
    system.scales(x, sizes.numbers_mut());
    sizes
}

/// The displacement from a state to another one; `None` beyond the edge of the chart.
pub(super) fn displacement<V: List>(
    system: &(impl Equations + ?Sized),
    x: &[f64],
    y: &[f64],
) -> Option<V> {
    let mut q = V::room(|| system.sizes().directions);
    system.coordinates(x, y, q.numbers_mut()).then_some(q)
}

/// The velocity and the production at a state, with its differentials if they are known.
#[inline]
pub(super) fn motion<L: Lengths>(
    system: &(impl Equations + ?Sized),
    x: &[f64],
    rows: Option<&Rows<L>>,
) -> Option<(L::Vector, f64)> {
    let mut v = L::Vector::room(|| system.sizes().directions);
    let production = match rows {
        Some(rows) => system.velocity_with(NO_CLOCK, x, rows.all(), v.numbers_mut())?,
        None => system.velocity(NO_CLOCK, x, v.numbers_mut())?,
    };
    v.numbers().iter().all(|v| v.is_finite()).then_some((v, production))
}

/// The round-off `4ε (|S| + Σ_i |∂_iS x_i|)` of an entropy increment, the larger one of the two ends, with the value and the
/// differential at the second one. The entries of `x' = x + u` are rounded in units of the larger end, so `x_i` is that of
/// both.
pub(super) fn entropy_round_off<L: Lengths>(
    system: &(impl Equations + ?Sized),
    [x, y]: [&[f64]; 2],
    end: (f64, &L::Vector),
) -> f64 {
    let [at_x, at_y]: [L::Vector; 2] = [scales(system, x), scales(system, y)];
    let sizes = L::Vector::zip([&at_x, &at_y], |[at_x, at_y]| at_x.max(at_y));
    let size = |value: f64, w: &L::Vector| value.abs() + sum(w, &sizes, |w, size| w.abs() * size);
    let start = if let Some(model) = system.model() {
        let mut w = sizes.zero();
        let value = model.jet(ENTROPY, NO_CLOCK, x, w.numbers_mut());
        size(value, &w)
    } else {
        let rows = Rows::<L>::of(system, x);
        size(rows.values()[ENTROPY], &rows.row(ENTROPY))
    };
    ROUNDED * start.max(size(end.0, end.1)) + NO_DIGITS
}

/// Makes a flow whose `equations()` are a system in plain numbers one of explicit methods.
macro_rules! stage_flow {
    ([$($generics:tt)*] $flow:ty, $lengths:ty) => {
        impl<$($generics)*> StageFlow for $flow {
            type Gradients = Rows<$lengths>;

            #[inline]
            fn gradients(&self, x: &Element<Self>) -> Option<Rows<$lengths>> {
                let rows = Rows::of(self.equations(), x.numbers());
                rows.is_finite().then_some(rows)
            }

            #[inline]
            fn values(&self, rows: &Rows<$lengths>) -> Laws<Self::Numbers> {
                rows.laws()
            }

            #[inline]
            fn entropy_round_off_to(
                &self,
                [x, y]: [&Element<Self>; 2],
                end: &Rows<$lengths>,
            ) -> f64 {
                let end = (end.values()[ENTROPY], &end.row(ENTROPY));
                let ends = [x.numbers(), y.numbers()];
                stages::entropy_round_off::<$lengths>(self.equations(), ends, end)
            }

            #[inline]
            fn velocity(
                &self,
                x: &Element<Self>,
                rows: &Rows<$lengths>,
            ) -> Option<(Self::Vector, f64)> {
                stages::motion(self.equations(), x.numbers(), Some(rows))
            }

            fn motion(&self, x: &Element<Self>) -> Option<(Self::Vector, f64)> {
                stages::motion::<$lengths>(self.equations(), x.numbers(), None)
            }

            #[inline]
            fn stage(&self, x: &Element<Self>, q: &Self::Vector) -> Option<Element<Self>> {
                let mut y = <Element<Self>>::room(|| x.numbers().len());
                let to = y.numbers_mut();
                self.equations().stage_state(x.numbers(), q.numbers(), to).then_some(y)
            }

            #[inline]
            fn stage_rates(
                &self,
                x: &Element<Self>,
                (q, y): (&Self::Vector, &Element<Self>),
                v: &Self::Vector,
            ) -> Self::Vector {
                let mut rates = v.zero();
                let [x, q, y, v] = [x.numbers(), q.numbers(), y.numbers(), v.numbers()];
                self.equations().stage_rates(x, q, y, v, rates.numbers_mut());
                rates
            }

            #[inline(always)]
            fn stage_along<'b>(
                &self,
                x: &Element<Self>,
                (h, count): (f64, usize),
                term: impl Fn(usize) -> (f64, &'b Self::Vector),
                coordinates: Option<&mut Self::Vector>,
            ) -> Option<(Self::Vector, f64)>
            where
                Self::Vector: 'b,
            {
                let q = Self::Vector::combination(h, count, term);
                let mut rates = q.zero();
                let (x, to) = (x.numbers(), rates.numbers_mut());
                let production = self.equations().stage(NO_CLOCK, x, q.numbers(), to)?;
                if let Some(coordinates) = coordinates {
                    *coordinates = q;
                }
                Some((rates, production))
            }

            #[inline]
            fn stage_coordinates(&self, x: &Element<Self>, y: &Element<Self>) -> Self::Vector {
                let mut q = Self::Vector::room(|| self.equations().sizes().directions);
                self.equations().stage_coordinates(x.numbers(), y.numbers(), q.numbers_mut());
                q
            }

            fn falls_below_round_off(&self, x: &Element<Self>, y: &Element<Self>) -> bool {
                referred_rise::falls(self.equations(), x.numbers(), y.numbers())
            }

            #[inline]
            fn project(
                &self,
                y: Element<Self>,
                target: &Target<'_, Self>,
            ) -> Result<Projected<Self>, ProjectionError> {
                let Target { laws, with_entropy, limit, units, .. } = *target;
                let target = Aim::<$lengths> { laws, with_entropy, limit, units };
                let landed = Projection { system: self.equations(), target }.from(y)?;
                Ok(Projected {
                    x: landed.x,
                    gradients: landed.rows,
                    entropy: landed.entropy,
                    entropy_round_off: landed.entropy_round_off,
                })
            }
        }
    };
}
pub(super) use stage_flow;
