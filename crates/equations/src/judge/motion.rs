//! The laws of a system of which nothing is known but its laws and its velocity.

use super::table::{Row, zeros};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use smallvec::smallvec;

use super::at::{all_finite, name};
use super::balance::{self, Balance};
use super::derivatives::{Derivatives, Mismatch, OF_CLOSURES};
use super::findings::Findings;
use super::{ENOUGH, SAMPLES, sums};
use crate::{ENERGY, ENTROPY, Equations, ModelError, Report, SecondLaw, Sizes};

/// A seed, so that a system fails in the same way each time.
const SEED: u64 = 0x4d6f_7469_6f6e_2121;

/// How often a sample is drawn again, at a quarter of the distance, until the system has values there.
const DRAWS: i32 = 12;

/// The distance of the states at which a broken law must be broken too, relative to the size of each coordinate, and how
/// many there are.
const NEAR: (f64, usize) = (1e-6, 4);

/// A system at a state and a time.
#[derive(Clone, Copy)]
pub(super) struct Motion<'a> {
    pub(super) system: &'a dyn Equations,
    pub(super) t: f64,
    pub(super) x: &'a [f64],
}

/// The laws, their differentials and the velocity at a state.
struct Here {
    values: Row,
    /// The differentials, one after another.
    w: Row,
    v: Row,
    production: f64,
}

impl<'a> Motion<'a> {
    fn moved_to<'b>(&self, x: &'b [f64]) -> Motion<'b>
    where
        'a: 'b,
    {
        Motion { x, ..*self }
    }

    /// The laws, their differentials and the velocity, which must have values.
    fn here(&self) -> Result<Here, ModelError> {
        let Sizes { directions: n, laws, .. } = self.system.sizes();
        let (mut values, mut w, mut v) = (zeros(laws), zeros(laws * n), zeros(n));
        self.system.differentials(self.t, self.x, &mut values, &mut w);
        let point = || self.x.to_vec();
        for (law, row) in w.chunks_exact(n).enumerate() {
            let (field, value) = (name(law), values[law]);
            if !value.is_finite() {
                return Err(ModelError::ValueNotFinite { field, value, point: point() });
            }
            if !all_finite(row) {
                return Err(ModelError::DerivativeNotFinite { field, point: point() });
            }
        }
        let production = self.system.velocity(self.t, self.x, &mut v).unwrap_or(f64::NAN);
        let wrong = v.iter().chain([&production]).find(|number| !number.is_finite());
        match wrong {
            Some(&value) => {
                Err(ModelError::ValueNotFinite { field: "velocity", value, point: point() })
            }
            None => Ok(Here { values, w, v, production }),
        }
    }

    /// The sizes of the coordinates, all of them positive: where an entry is zero, the distance over which the energy
    /// changes by the sum of its terms.
    fn units(&self, here: &Here) -> Row {
        let mut units = zeros(here.v.len());
        self.system.scales(self.x, &mut units);
        let terms: f64 = here.w.iter().zip(&units).map(|(w, size)| (w * size).abs()).sum();
        for (unit, slope) in units.iter_mut().zip(&here.w) {
            let distance = terms / slope.abs();
            if *unit == 0.0 && distance.is_normal() {
                *unit = distance;
            }
        }
        sums::make_positive(&mut units);
        units
    }

    /// A random state within `radius` of these sizes at which the system has values, or nearer.
    fn draw(
        &self,
        (units, radius): (&[f64], f64),
        rng: &mut ChaCha8Rng,
        passed_over: &mut usize,
    ) -> Option<Row> {
        let mut y = zeros(self.x.len());
        (0..=DRAWS).find_map(|draw| {
            let reach = radius * 0.25_f64.powi(draw);
            let q: Row =
                units.iter().map(|unit| reach * unit * rng.random_range(-1.0..1.0)).collect();
            self.system.chart(self.x, &q, &mut y);
            let found = self.system.defect(&y).is_finite() && self.moved_to(&y).here().is_ok();
            *passed_over += usize::from(!found);
            found.then(|| y.clone())
        })
    }

    /// Passes the violation of each law on, relative to its terms, with the error that names it.
    fn laws(
        &self,
        here: &Here,
        units: &[f64],
        mut note: impl FnMut(&'static str, f64, fn(Vec<f64>, f64) -> ModelError),
    ) {
        let n = here.v.len();
        let row = |law: usize| &here.w[law * n..][..n];
        let size = balance::pairing(row(ENERGY), &here.v, units);
        note("⟨dH, x'⟩ = 0", size, |point, size| ModelError::MotionChangesEnergy {
            point,
            size,
        });
        for law in ENTROPY + 1..here.values.len() {
            let size = balance::pairing(row(law), &here.v, units);
            note("⟨dL, x'⟩ = 0", size, |point, size| ModelError::MotionChangesInvariant {
                point,
                size,
            });
        }
        if self.system.second_law() != SecondLaw::Exact {
            return;
        }
        let terms = row(ENTROPY).iter().zip(&here.v).map(|(w, v)| w * v);
        let balance: Balance = terms.chain([-here.production]).collect();
        let size = balance.beside(0.0).relative();
        note("⟨dS, x'⟩ = σ", size, |point, size| ModelError::ProductionOff { point, size });
        let sizes: f64 = row(ENTROPY).iter().zip(&here.v).map(|(w, v)| (w * v).abs()).sum();
        let falls = if here.production < 0.0 { -here.production / sizes } else { 0.0 };
        note("σ ≥ 0", falls, |point, size| ModelError::ProductionNegative { point, size });
    }

    /// Checks the laws here, and at states nearby where one seems broken.
    pub(super) fn check(&self) -> Result<(), ModelError> {
        let here = self.here()?;
        let units = self.units(&here);
        let broken = |at: Motion<'_>, here: &Here| {
            let mut found = None;
            at.laws(here, &units, |_, size, error| {
                // A sum that is not a number has terms that overflow, and says nothing.
                if found.is_none() && size > sums::TOLERANCE && size.is_finite() {
                    found = Some(error(at.x.to_vec(), size));
                }
            });
            found
        };
        let Some(found) = broken(*self, &here) else { return Ok(()) };
        let (mut rng, (radius, count)) = (ChaCha8Rng::seed_from_u64(SEED), NEAR);
        let everywhere = (0..count).all(|_| {
            let drawn = self.draw((&units, radius), &mut rng, &mut 0);
            drawn.is_some_and(|y| {
                let there = self.moved_to(&y);
                there.here().is_ok_and(|here| broken(there, &here).is_some())
            })
        });
        if everywhere { Err(found) } else { Ok(()) }
    }

    /// Compares the differentials of all laws with their values along every axis.
    pub(super) fn compare(&self) -> Result<(), ModelError> {
        let here = self.here()?;
        let units = self.units(&here);
        (0..units.len()).try_for_each(|axis| self.along(&here, &units, axis))
    }

    /// Compares them along one axis, which `turn` chooses.
    pub(super) fn look(&self, turn: usize) -> Result<(), ModelError> {
        let here = self.here()?;
        let units = self.units(&here);
        self.along(&here, &units, turn % units.len())
    }

    fn along(&self, here: &Here, units: &[f64], axis: usize) -> Result<(), ModelError> {
        let n = units.len();
        // A law whose derivative is wrong is judged by itself: its entries have units of their own.
        (0..here.values.len()).try_for_each(|law| {
            let df = smallvec![here.w[law * n + axis]];
            let scale = units[axis];
            let derivatives =
                Derivatives { scale, df, units: smallvec![1.0], rounding: OF_CLOSURES };
            let mismatch = derivatives.compare(&|s, to| {
                let (mut q, mut y) = (zeros(n), zeros(self.x.len()));
                let mut values = zeros(here.values.len());
                q[axis] = s;
                self.system.chart(self.x, &q, &mut y);
                self.system.values(self.t, &y, &mut values);
                to.push(values[law]);
                Some(())
            });
            mismatch.map_or(Ok(()), |Mismatch { derivative, quotient }| {
                let (field, point) = (name(law), self.x.to_vec());
                Err(ModelError::WrongDerivative { field, axis, point, derivative, quotient })
            })
        })
    }

    /// Judges a system around a start.
    pub(super) fn examine(&self, radius: f64, report: &mut Report) -> Result<(), ModelError> {
        self.system.check(self.x)?;
        let here = self.here()?;
        let units = self.units(&here);
        let n = units.len();
        let (mut rng, mut first) = (ChaCha8Rng::seed_from_u64(SEED), Ok(()));
        for sample in 0..=SAMPLES {
            let drawn = match sample {
                0 => Some(Row::from_slice(self.x)),
                _ => self.draw((&units, radius), &mut rng, &mut report.passed_over),
            };
            let Some(x) = drawn else { continue };
            report.judged += 1;
            let at = self.moved_to(&x);
            let here = at.here()?;
            let each = n.div_ceil(SAMPLES / 2);
            let axes = if sample == 0 { 0..n } else { (sample - 1) * each..sample * each };
            let compared =
                axes.map(|axis| axis % n).try_for_each(|axis| at.along(&here, &units, axis));
            let mut findings = Findings { point: x.to_vec(), laws: &mut report.laws, first: None };
            at.laws(&here, &units, |law, size, error| findings.note(law, size, error));
            first = first.and(compared).and(findings.first.map_or(Ok(()), Err));
        }
        first?;
        if report.judged < ENOUGH {
            let (judged, wanted) = (report.judged, SAMPLES + 1);
            return Err(ModelError::TooFewPoints { judged, wanted, point: self.x.to_vec() });
        }
        Ok(())
    }
}
