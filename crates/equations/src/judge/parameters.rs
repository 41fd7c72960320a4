//! The derivatives of a model along its parameters, against the values of the models beside it.
//!
//! A derivative along a parameter `θ_k` is compared with difference quotients over fractions of `|θ_k|`, as those along the entries of a
//! state are (module `derivatives`). Many parameters are compared in groups, along one direction each, so that the number of models that
//! are built does not grow with theirs.

use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;
use smallvec::smallvec;

use super::RADIUS;
use super::at::{At, Place, max_abs, name};
use super::derivatives::{Derivatives, Mismatch, OF_CLOSURES, OF_SOLUTIONS, Rounding};
use super::domain::value_not_finite;
use super::fields::generic;
use super::sampling::CoordinateScales;
use super::table::{Row, zeros};
use crate::{ENERGY, ENTROPY, MetricError, Model, ModelError, Part};

/// The models at other values of the parameters: calls the function with the one whose parameters are displaced by these numbers, and
/// returns whether there is one.
pub type ModelBeside<'a> = &'a dyn Fn(&[f64], &mut dyn FnMut(&dyn Model)) -> bool;

/// The most directions along which many parameters are compared at a state. It bounds the time alone, not what is found.
const DIRECTIONS: usize = 16;

/// A seed, so that a model fails in the same way each time.
const SEED: u64 = 0x5061_7261_6d65_7465;

/// A field that depends on parameters.
#[derive(Clone, Copy)]
enum Field {
    Law(usize),
    Part(Part),
}

/// A state at which derivatives along parameters are compared.
struct Compared<'a, 'b> {
    place: &'a Place<'b>,
    /// A covector that involves every column of a tensor.
    alpha: Row,
    /// The sizes of the parameters.
    sizes: Vec<f64>,
    beside: ModelBeside<'a>,
}

/// Compares all derivatives at a state and at one near it.
pub(super) fn compare(
    at: At<'_>,
    values: &[f64],
    beside: ModelBeside<'_>,
) -> Result<(), ModelError> {
    if at.model.parameters() != values.len() || values.is_empty() {
        return Ok(());
    }
    let scales = CoordinateScales::at(at);
    compare_at(at, &scales.units, values, beside)?;
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let inside = |at: At<'_>| at.model.defect(at.x).is_finite() && value_not_finite(at).is_none();
    // A differential may vanish at a start at rest, and a derivative along a parameter with it.
    let near = scales.draw(at, RADIUS, &mut rng, &mut 0, inside);
    near.map_or(Ok(()), |(y, _)| compare_at(at.moved_to(&y), &scales.units, values, beside))
}

fn compare_at(
    at: At<'_>,
    units: &[f64],
    values: &[f64],
    beside: ModelBeside<'_>,
) -> Result<(), ModelError> {
    let place =
        &Place { at, units, energy: at.finite_jet2(ENERGY)?, entropy: at.finite_jet2(ENTROPY)? };
    let parts = [Part::Reversible, Part::Gyroscopic, Part::Irreversible];
    let parts = parts.into_iter().filter(|part| !at.model.is_zero(*part));
    let fields: Vec<Field> = at.laws().map(Field::Law).chain(parts.map(Field::Part)).collect();
    let mut compared = Compared { place, alpha: generic(units), sizes: Vec::new(), beside };
    compared.sizes = compared.sizes_of(values, &fields)?;
    fields.iter().try_for_each(|field| compared.field(*field))
}

impl Field {
    const fn name(self) -> &'static str {
        match self {
            Self::Law(law) => name(law),
            Self::Part(Part::Reversible) => "bracket",
            Self::Part(Part::Gyroscopic) => "force",
            Self::Part(Part::Irreversible) => "dissipation",
        }
    }

    const fn rounding(self) -> Rounding {
        match self {
            Self::Law(_) => OF_CLOSURES,
            Self::Part(_) => OF_SOLUTIONS,
        }
    }
}

impl Compared<'_, '_> {
    /// The values of a field of a model with other parameters: of a law with its differential, of a part at the covectors here.
    fn values(&self, model: &dyn Model, field: Field) -> Result<Row, MetricError> {
        let at = At { model, ..self.place.at };
        match field {
            Field::Law(law) => {
                let (value, df) = at.jet(law);
                Ok(std::iter::once(value).chain(df).collect())
            }
            Field::Part(part) => at.apply(part, self.place.differentials(), &self.alpha),
        }
    }

    /// The derivative of a field along a parameter.
    fn along(&self, field: Field, parameter: usize) -> Result<Row, ModelError> {
        let at = self.place.at;
        let mut v = zeros(self.place.units.len());
        let row: Row = match field {
            Field::Law(law) => {
                let slope = at.model.law_along_parameter(law, parameter, at.t, at.x, &mut v);
                std::iter::once(slope).chain(v).collect()
            }
            Field::Part(part) => {
                let (which, w) = ((part, parameter), self.place.differentials());
                let found =
                    at.model.part_along_parameter(which, at.t, at.x, w, &self.alpha, &mut v);
                found.map_err(|source| at.unusable(source))?;
                v
            }
        };
        if row.iter().all(|number| number.is_finite()) {
            Ok(row)
        } else {
            Err(ModelError::DerivativeNotFinite { field: field.name(), point: at.point() })
        }
    }

    /// The units of the values of a field.
    fn units(&self, field: Field) -> Row {
        let units = self.place.units;
        match field {
            Field::Law(_) => std::iter::once(1.0).chain(units.iter().map(|u| u.recip())).collect(),
            Field::Part(_) => Row::from_slice(units),
        }
    }

    /// The sizes of the parameters. That of one which is zero is the distance over which a field changes by its size, or that of the
    /// largest one.
    fn sizes_of(&self, values: &[f64], fields: &[Field]) -> Result<Vec<f64>, ModelError> {
        let largest = max_abs(values);
        let others = if largest > 0.0 { largest } else { 1.0 };
        let size = |(parameter, value): (usize, &f64)| {
            if *value != 0.0 {
                return Ok(value.abs());
            }
            let mut distance = f64::INFINITY;
            for field in fields {
                let in_units = |row: &[f64]| {
                    let pairs = row.iter().zip(self.units(*field));
                    pairs.map(|(number, unit)| (number / unit).abs()).fold(0.0, f64::max)
                };
                let here = self.values(self.place.at.model, *field);
                let here = here.map_err(|source| self.place.at.unusable(source))?;
                let (size, slope) = (in_units(&here), in_units(&self.along(*field, parameter)?));
                if size > 0.0 && slope > 0.0 {
                    distance = distance.min(size / slope);
                }
            }
            Ok(if distance.is_finite() { distance } else { others })
        };
        values.iter().enumerate().map(size).collect()
    }

    /// Compares the derivatives of a field along all parameters.
    fn field(&self, field: Field) -> Result<(), ModelError> {
        let count = self.sizes.len();
        let slopes: Vec<Row> =
            (0..count).map(|k| self.along(field, k)).collect::<Result<_, _>>()?;
        for first in 0..count.min(DIRECTIONS) {
            let group: Vec<usize> = (first..count).step_by(DIRECTIONS).collect();
            let Some(found) = self.mismatch(field, &slopes, &group) else { continue };
            let single = |k: &usize| Some((*k, self.mismatch(field, &slopes, &[*k])?));
            let (parameter, Mismatch { derivative, quotient }) =
                group.iter().find_map(single).unwrap_or((first, found));
            let (field, point, size) = (field.name(), self.place.at.point(), self.sizes[parameter]);
            let (derivative, quotient) = (derivative / size, quotient / size);
            return Err(ModelError::WrongAlongParameter {
                field,
                parameter,
                point,
                derivative,
                quotient,
            });
        }
        Ok(())
    }

    /// Compares a field along the direction in which each parameter of a group moves by its size.
    fn mismatch(&self, field: Field, slopes: &[Row], group: &[usize]) -> Option<Mismatch> {
        let units = self.units(field);
        let mut df: Row = smallvec![0.0; units.len()];
        for &k in group {
            df.iter_mut().zip(&slopes[k]).for_each(|(df, slope)| *df += slope * self.sizes[k]);
        }
        let derivatives = Derivatives { scale: 1.0, df, units, rounding: field.rounding() };
        derivatives.compare(&|s, values| {
            let mut by = vec![0.0; self.sizes.len()];
            group.iter().for_each(|&k| by[k] = s * self.sizes[k]);
            let mut found = None;
            let exists = (self.beside)(&by, &mut |model| found = self.values(model, field).ok());
            let mut row = found.filter(|_| exists)?;
            values.append(&mut row);
            Some(())
        })
    }
}
