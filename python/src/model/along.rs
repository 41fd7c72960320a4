//! The derivatives of a system of tapes along its parameters, on a flat space with the canonical metric.

use std::ops::Range;

use metriplectic_equations::{ENERGY, ENTROPY};
use metriplectic_fields::Real;
use metriplectic_recording::{Tape, TapeError};

use super::definition::{Bracket, Definition, Friction};
use super::error::DefinitionError;
use super::reals::with_reals;
use super::space::Space;
use super::tapes::{self, Form};

/// The parameters along which a system knows its derivatives, and its tensors with parameters as inputs.
#[derive(Clone, Debug)]
pub(super) struct Along {
    /// Their places among all parameters.
    pub(super) places: Vec<usize>,
    /// The recorded brackets, with the entries on which each one acts.
    brackets: Vec<(Range<usize>, Tape)>,
    friction: Rubs,
}

/// A friction along parameters.
#[derive(Clone, Debug)]
enum Rubs {
    /// It does not depend on them.
    Not,
    /// By its factor.
    Factor(Tape),
    /// By the tensor, whose product is a tape with the inputs `[x | w | t | α | θ]`.
    Tensor(Tape),
}

/// Lists the recorded brackets of a space that begins at an entry.
fn brackets(
    bracket: &Bracket,
    space: &Space,
    entry: usize,
    parameters: usize,
    to: &mut Vec<(Range<usize>, Tape)>,
) -> Result<(), TapeError> {
    match bracket {
        Bracket::Sum(brackets) => {
            let mut entry = entry;
            for (bracket, space) in brackets.iter().zip(space.components()) {
                self::brackets(bracket, space, entry, parameters, to)?;
                entry += space.entries();
            }
        }
        Bracket::Recorded { tape, .. } => {
            let n = space.entries();
            let product = tapes::product_of_parameters(tape, Form::Rows, n, n, parameters)?;
            to.push((entry..entry + n, product));
        }
        Bracket::None
        | Bracket::LiePoisson
        | Bracket::Canonical
        | Bracket::AreaForm
        | Bracket::Constant(_) => {}
    }
    Ok(())
}

impl Along {
    /// Prepares the derivatives of a system along the parameters at these places.
    pub(super) fn of(definition: &Definition, places: &[usize]) -> Result<Self, DefinitionError> {
        let (n, count) = (definition.space.entries(), definition.parameters.len());
        let error = |part| move |source: TapeError| DefinitionError::Tape { part, source };
        let mut of_brackets = Vec::new();
        brackets(&definition.bracket, &definition.space, 0, count, &mut of_brackets)
            .map_err(error("bracket"))?;
        let tensor = |tape, form| {
            let product = tapes::product_of_parameters(tape, form, n, 2 * n, count);
            product.map(Rubs::Tensor).map_err(error("friction"))
        };
        let friction = match &definition.friction {
            Friction::None | Friction::Metric { factor: None } => Rubs::Not,
            Friction::Metric { factor: Some(tape) } => Rubs::Factor(tape.clone()),
            Friction::Recorded(tape) => tensor(tape, Form::Rows)?,
            Friction::Contacts(tape) => tensor(tape, Form::Contacts)?,
        };
        Ok(Self { places: places.to_vec(), brackets: of_brackets, friction })
    }

    /// The derivative of a tape with the inputs `[x | t | θ]` along the parameter at a place, and that of its gradient by `x`.
    pub(super) fn law(
        tape: &Tape,
        (place, theta): (usize, &[f64]),
        t: f64,
        x: &[f64],
        df: &mut [f64],
    ) -> f64 {
        let inputs: Vec<f64> = x.iter().chain([&t]).chain(theta).copied().collect();
        let at = x.len() + 1 + place;
        let [mut along, mut w, mut hv] = [0; 3].map(|_| vec![0.0; inputs.len()]);
        along[at] = 1.0;
        tape.gradient_along(&inputs, &along, &mut w, &mut hv);
        df.copy_from_slice(&hv[..x.len()]);
        w[at]
    }

    /// Computes the derivative of the bracket `Π α` along the parameter at a place.
    pub(super) fn bracket(
        &self,
        at: (usize, &[f64]),
        t: f64,
        x: &[f64],
        alpha: &[f64],
        v: &mut [f64],
    ) {
        v.fill(0.0);
        for (entries, product) in &self.brackets {
            let (x, alpha) = (&x[entries.clone()], &alpha[entries.clone()]);
            derivative(product, [x, &[], &[t], alpha], at, &mut v[entries.clone()]);
        }
    }

    /// Computes the derivative of the friction `K_w α` along the parameter at a place. `unscaled` computes that of a metric without its
    /// factor.
    pub(super) fn friction(
        &self,
        at: (usize, &[f64]),
        t: f64,
        x: &[f64],
        [w, alpha]: [&[f64]; 2],
        unscaled: impl FnOnce(&mut [f64]),
        v: &mut [f64],
    ) {
        match &self.friction {
            Rubs::Not => v.fill(0.0),
            Rubs::Tensor(product) => derivative(product, [x, w, &[t], alpha], at, v),
            Rubs::Factor(tape) => {
                let mut slope = [0.0];
                derivative(tape, [x, &[], &[t], &[]], at, &mut slope);
                unscaled(v);
                v.iter_mut().for_each(|v| *v *= slope[0]);
            }
        }
    }
}

/// Computes the derivative of the outputs of a tape, whose last inputs are the parameters, along the one at a place.
fn derivative(tape: &Tape, before: [&[f64]; 4], (place, theta): (usize, &[f64]), v: &mut [f64]) {
    with_reals(tape.inputs() + v.len(), |room| {
        let (inputs, outputs) = room.split_at_mut(tape.inputs());
        let all = before.into_iter().flatten().chain(theta);
        inputs.iter_mut().zip(all).for_each(|(to, number)| *to = Real::from(*number));
        let first = inputs.len() - theta.len();
        inputs[first + place].eps1 = 1.0;
        tape.evaluate(inputs, outputs);
        v.iter_mut().zip(&*outputs).for_each(|(v, output)| *v = output.eps1);
    });
}

/// The tape of a law of a definition, with the inputs `[x | t | θ]`; `None` for an entropy that is zero.
pub(super) fn law_of(definition: &Definition, law: usize) -> Option<&Tape> {
    match law {
        ENERGY => Some(&definition.energy),
        ENTROPY => definition.entropy.as_ref(),
        _ => Some(&definition.invariants[law - ENTROPY - 1].1),
    }
}
