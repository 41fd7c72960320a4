//! Brackets on the factors of a space.

use std::fmt::Debug;
use std::ops::Range;
use std::sync::Arc;

use metriplectic_dynamics::bracket::AreaForm;
use metriplectic_dynamics::{InNumbers, Metriplectic, Symplectic, System};
use metriplectic_equations::room::with_numbers;
use metriplectic_equations::{Covectors, Jet, MetricError, Model as _, Part};
use metriplectic_fields::Real;
use metriplectic_manifolds::lie_algebra::StructureConstant;
use metriplectic_manifolds::{Euclidean, Product, Rotations, Sphere};
use metriplectic_recording::{Tape, TapeError};
use nalgebra::{Matrix3, Vector1, Vector2, Vector3};

use super::definition::Bracket;
use super::error::DefinitionError;
use super::field::{Field, FieldJet};
use super::space::{Layout, Simple, Space};
use super::tapes::Form;

/// A bracket of the library on a space of the library, in plain numbers.
trait OfTypes: Debug + Send + Sync {
    /// Computes `Π α` at `φ_x(q)`.
    fn apply(
        &self,
        place: (&[f64], &[f64]),
        alpha: &[f64],
        v: &mut [f64],
    ) -> Result<(), MetricError>;

    /// Evaluates `Π α` with its derivatives.
    fn linearise(&self, x: &[f64], alpha: &[f64], to: &mut FieldJet<'_>)
    -> Result<(), MetricError>;

    /// Evaluates the derivative of `Π α` along the direction `u`.
    fn slope_of(
        &self,
        x: &[f64],
        u: &[f64],
        alpha: &[f64],
        slope: &mut [f64],
    ) -> Result<(), MetricError>;
}

/// A system of the library, of which the bracket alone is used.
#[derive(Debug)]
struct BracketOf<Y>(Y);

/// No covectors: the brackets here depend on none.
const NONE: Covectors<'static> = Covectors { energy: &[0.0; 8], entropy: &[0.0; 8] };

impl<Y: Metriplectic + Debug + Send + Sync> OfTypes for BracketOf<Y> {
    fn apply(
        &self,
        place: (&[f64], &[f64]),
        alpha: &[f64],
        v: &mut [f64],
    ) -> Result<(), MetricError> {
        InNumbers(&self.0).apply(Part::Reversible, 0.0, place, NONE, alpha, v)
    }

    fn linearise(
        &self,
        x: &[f64],
        alpha: &[f64],
        to: &mut FieldJet<'_>,
    ) -> Result<(), MetricError> {
        let FieldJet { value, along_x, along_w, tensor } = to;
        let mut jet = Jet { value, along_x, along_w, tensor };
        InNumbers(&self.0).linearise(Part::Reversible, 0.0, x, NONE, alpha, &mut jet)
    }

    fn slope_of(
        &self,
        x: &[f64],
        u: &[f64],
        alpha: &[f64],
        slope: &mut [f64],
    ) -> Result<(), MetricError> {
        InNumbers(&self.0).bracket_slope_of(0.0, x, [u, NONE.energy], NONE.entropy, alpha, slope)
    }
}

/// The area form of S².
fn area_form() -> Option<Arc<dyn OfTypes>> {
    let system = System::on(Sphere::<2>::round())
        .bracket(AreaForm)
        .energy(|_: &Vector3<Real>| Real::from(0.0))
        .build();
    Some(Arc::new(BracketOf(system.ok()?)))
}

/// The canonical bracket of T*SO(3).
fn of_attitudes() -> Option<Arc<dyn OfTypes>> {
    let system = System::on(Product(Rotations::bi_invariant(), Euclidean::<3>))
        .bracket(Symplectic)
        .energy(|_: &(Matrix3<Real>, Vector3<Real>)| Real::from(0.0))
        .build();
    Some(Arc::new(BracketOf(system.ok()?)))
}

/// The canonical bracket of T*S¹ = S¹ × R.
fn of_angles() -> Option<Arc<dyn OfTypes>> {
    let system = System::on(Product(Sphere::<1>::round(), Euclidean::<1>))
        .bracket(Symplectic)
        .energy(|_: &(Vector2<Real>, Vector1<Real>)| Real::from(0.0))
        .build();
    Some(Arc::new(BracketOf(system.ok()?)))
}

/// The tensor of a factor.
#[derive(Clone, Debug)]
enum Tensor {
    /// `Π_ij = c_ij + Σ_d C_ji^d x_d` on a flat factor: entries that are constant, and structure constants.
    Affine { constant: Vec<(usize, usize, f64)>, linear: Vec<StructureConstant> },
    /// A bracket of the library.
    Typed(Arc<dyn OfTypes>),
    /// A recorded one.
    Recorded(Box<Field>),
}

/// A tensor with the place of its factor.
#[derive(Clone, Debug)]
struct Block {
    entries: Range<usize>,
    directions: Range<usize>,
    tensor: Tensor,
}

/// The bracket of a space: a sum of those of its factors.
#[derive(Clone, Debug)]
pub(super) struct Poisson {
    n: usize,
    blocks: Vec<Block>,
    pub(super) is_poisson: bool,
}

impl Poisson {
    /// Prepares a bracket on a space.
    pub(super) fn of(
        bracket: &Bracket,
        space: &Space,
        theta: &[f64],
    ) -> Result<Self, DefinitionError> {
        let mut all = Self { n: space.directions(), blocks: Vec::new(), is_poisson: true };
        all.add(bracket, space, (0, 0), theta)?;
        Ok(all)
    }

    /// Returns whether nothing moves.
    pub(super) const fn is_zero(&self) -> bool {
        self.blocks.is_empty()
    }

    /// Returns whether a recorded tensor depends on the time.
    pub(super) fn in_time(&self) -> bool {
        self.blocks
            .iter()
            .any(|block| matches!(&block.tensor, Tensor::Recorded(field) if field.in_time))
    }

    /// Adds the bracket of a factor that begins at this entry and at this direction.
    fn add(
        &mut self,
        bracket: &Bracket,
        space: &Space,
        (entry, direction): (usize, usize),
        theta: &[f64],
    ) -> Result<(), DefinitionError> {
        let affine = |constant, linear| Ok(Tensor::Affine { constant, linear });
        let n = space.directions();
        let elsewhere = |bracket, remedy| {
            Err(DefinitionError::Bracket { bracket, space: space.to_string(), remedy })
        };
        let typed = |tensor: Option<Arc<dyn OfTypes>>| tensor.map(Tensor::Typed);
        let tensor = match bracket {
            Bracket::None => return Ok(()),
            Bracket::Sum(brackets) => {
                let (found, spaces) = (brackets.len(), space.components());
                if found != spaces.len() {
                    let (expected, space) = (spaces.len(), space.to_string());
                    return Err(DefinitionError::Blocks { found, expected, space });
                }
                let (mut entry, mut direction) = (entry, direction);
                for (bracket, space) in brackets.iter().zip(spaces) {
                    self.add(bracket, space, (entry, direction), theta)?;
                    entry += space.entries();
                    direction += space.directions();
                }
                return Ok(());
            }
            Bracket::LiePoisson => match space.simple() {
                Simple::LieDual(constants) => affine(Vec::new(), constants.to_vec()),
                _ => {
                    elsewhere("the Lie-Poisson bracket", "it is that of the dual of a Lie algebra")
                }
            },
            Bracket::AreaForm => match space.simple() {
                Simple::Sphere(2) => {
                    typed(area_form()).map_or_else(|| elsewhere("the area form", ""), Ok)
                }
                _ => elsewhere("the area form", "it is that of S^2"),
            },
            Bracket::Canonical => {
                let remedy =
                    "it is that of positions and their momenta (q, p): R^2k, S^1 × R and T*SO(3)";
                let other = match space.simple() {
                    Simple::CotangentRotations => typed(of_attitudes()),
                    _ if is_pair(space, |first| matches!(first, Simple::Sphere(1)), 1) => {
                        typed(of_angles())
                    }
                    _ if is_pair(space, |first| matches!(first, Simple::Rotations), 3) => {
                        typed(of_attitudes())
                    }
                    _ => None,
                };
                match other {
                    Some(tensor) => Ok(tensor),
                    None if space.is_flat() && n.is_multiple_of(2) => {
                        let k = n / 2;
                        let pairs = (0..k).flat_map(|i| [(i, i + k, 1.0), (i + k, i, -1.0)]);
                        affine(pairs.collect(), Vec::new())
                    }
                    None => elsewhere("the canonical bracket", remedy),
                }
            }
            Bracket::Constant(entries) => {
                if space.is_flat() {
                    affine(skew(n, entries)?, Vec::new())
                } else {
                    elsewhere("a constant bracket", "it is for flat spaces")
                }
            }
            Bracket::Recorded { tape, is_poisson } => {
                self.is_poisson &= is_poisson;
                Ok(Tensor::Recorded(Box::new(recorded(tape, space, theta)?)))
            }
        }?;
        let (entries, directions) = (entry..entry + space.entries(), direction..direction + n);
        self.blocks.push(Block { entries, directions, tensor });
        Ok(())
    }

    /// Computes the vector `Π α` at `φ_x(q)`, in the chart at `x`.
    #[inline]
    pub(super) fn apply(
        &self,
        t: f64,
        (x, q): (&[f64], &[f64]),
        alpha: &[f64],
        v: &mut [f64],
    ) -> Result<(), MetricError> {
        v.fill(0.0);
        for Block { entries, directions, tensor } in &self.blocks {
            let (x, q) = (&x[entries.clone()], &q[directions.clone()]);
            let (alpha, v) = (&alpha[directions.clone()], &mut v[directions.clone()]);
            match tensor {
                Tensor::Affine { constant, linear } => {
                    for &(i, j, value) in constant {
                        v[i] += value * alpha[j];
                    }
                    for &StructureConstant { a, b, d, value } in linear {
                        v[b] += alpha[a] * (x[d] + q[d]) * value;
                    }
                }
                Tensor::Typed(of) => of.apply((x, q), alpha, v)?,
                Tensor::Recorded(field) => field.apply(t, (x, q), &[], alpha, v)?,
            }
        }
        Ok(())
    }

    /// Evaluates `Π α` at a state with its derivatives; nothing is along a covector.
    pub(super) fn linearise(
        &self,
        t: f64,
        x: &[f64],
        alpha: &[f64],
        jet: &mut Jet<'_>,
    ) -> Result<(), MetricError> {
        let n = self.n;
        jet.value.fill(0.0);
        [&mut *jet.along_x, &mut *jet.along_w, &mut *jet.tensor]
            .into_iter()
            .for_each(|matrix| matrix.fill(0.0));
        for Block { entries, directions, tensor } in &self.blocks {
            let (x, alpha) = (&x[entries.clone()], &alpha[directions.clone()]);
            let value = &mut jet.value[directions.clone()];
            let (from, m) = (directions.start, directions.len());
            let at = |i: usize, j: usize| (from + i) * n + from + j;
            if let Tensor::Affine { constant, linear } = tensor {
                for &(i, j, entry) in constant {
                    value[i] += entry * alpha[j];
                    jet.tensor[at(i, j)] += entry;
                }
                for &StructureConstant { a, b, d, value: c } in linear {
                    value[b] += alpha[a] * x[d] * c;
                    jet.along_x[at(b, d)] += alpha[a] * c;
                    jet.tensor[at(b, a)] += x[d] * c;
                }
                continue;
            }
            with_numbers(3 * m * m, |room| {
                let (along_x, room) = room.split_at_mut(m * m);
                let (along_w, tensors) = room.split_at_mut(m * m);
                let mut to = FieldJet { value, along_x, along_w, tensor: tensors };
                match tensor {
                    Tensor::Typed(of) => of.linearise(x, alpha, &mut to)?,
                    Tensor::Recorded(field) => field.linearise(t, x, &[], alpha, &mut to)?,
                    Tensor::Affine { .. } => {}
                }
                super::layout::put_block(n, directions, to.along_x, jet.along_x);
                super::layout::put_block(n, directions, to.tensor, jet.tensor);
                Ok::<(), MetricError>(())
            })?;
        }
        Ok(())
    }

    /// Evaluates the matrix at a state.
    pub(super) fn tensor(&self, t: f64, x: &[f64], to: &mut [f64]) -> Result<(), MetricError> {
        self.columns(to, |axis, column, still| self.apply(t, (x, still), axis, column))
    }

    /// Evaluates the derivative of the matrix along the direction `u`.
    pub(super) fn slope(
        &self,
        t: f64,
        x: &[f64],
        u: &[f64],
        to: &mut [f64],
    ) -> Result<(), MetricError> {
        self.columns(to, |axis, column, _| self.slope_of(t, x, u, axis, column))
    }

    /// Fills a matrix, a column for each axis. Factors do not mix: columns of all factors are found at once.
    fn columns(
        &self,
        to: &mut [f64],
        of: impl Fn(&[f64], &mut [f64], &[f64]) -> Result<(), MetricError>,
    ) -> Result<(), MetricError> {
        let n = self.n;
        to.fill(0.0);
        let most = self.blocks.iter().map(|block| block.directions.len()).max().unwrap_or(0);
        with_numbers(3 * n, |room| {
            let (axes, room) = room.split_at_mut(n);
            let (column, still) = room.split_at_mut(n);
            for k in 0..most {
                let listed = || self.blocks.iter().filter(move |block| k < block.directions.len());
                listed().for_each(|block| axes[block.directions.start + k] = 1.0);
                of(axes, column, still)?;
                for Block { directions, .. } in listed() {
                    axes[directions.start + k] = 0.0;
                    directions.clone().for_each(|i| to[i * n + directions.start + k] = column[i]);
                }
            }
            Ok(())
        })
    }

    /// Evaluates the derivative of `Π α` along the direction `u`.
    pub(super) fn slope_of(
        &self,
        t: f64,
        x: &[f64],
        u: &[f64],
        alpha: &[f64],
        slope: &mut [f64],
    ) -> Result<(), MetricError> {
        slope.fill(0.0);
        for Block { entries, directions, tensor } in &self.blocks {
            let (x, u) = (&x[entries.clone()], &u[directions.clone()]);
            let (alpha, slope) = (&alpha[directions.clone()], &mut slope[directions.clone()]);
            match tensor {
                Tensor::Affine { linear, .. } => {
                    for &StructureConstant { a, b, d, value } in linear {
                        slope[b] += alpha[a] * u[d] * value;
                    }
                }
                Tensor::Typed(of) => of.slope_of(x, u, alpha, slope)?,
                Tensor::Recorded(field) => field.slope_of(t, x, u, alpha, slope)?,
            }
        }
        Ok(())
    }
}

/// Returns whether a space is a product of such a space and Rⁿ.
fn is_pair(space: &Space, first: impl Fn(Simple<'_>) -> bool, n: usize) -> bool {
    match space.components() {
        [a, b] => first(a.simple()) && matches!(b.simple(), Simple::Flat(m) if m == n),
        _ => false,
    }
}

/// Lists the entries of a constant tensor that are not zero.
fn skew(n: usize, entries: &[f64]) -> Result<Vec<(usize, usize, f64)>, DefinitionError> {
    if entries.len() != n * n {
        return Err(DefinitionError::TensorSize { found: entries.len(), n });
    }
    let all = || (0..n * n).map(|k| (k / n, k % n, entries[k]));
    if let Some((row, column, _)) = all().find(|(.., value)| !value.is_finite()) {
        return Err(DefinitionError::TensorNotFinite { row, column });
    }
    // The round-off of a constant tensor of the library.
    let allowed =
        4.0 * f64::EPSILON * entries.iter().fold(0.0_f64, |most, entry| most.max(entry.abs()));
    let off = |row: usize, column: usize, value: f64| (value + entries[column * n + row]).abs();
    if let Some((row, column, value)) = all().find(|&(i, j, value)| off(i, j, value) > allowed) {
        return Err(DefinitionError::TensorNotSkew { row, column, size: off(row, column, value) });
    }
    Ok(all().filter(|(.., value)| *value != 0.0).collect())
}

/// Prepares a recorded tensor.
fn recorded(tape: &Tape, space: &Space, theta: &[f64]) -> Result<Field, DefinitionError> {
    let (layout, part) = (Layout::of(space), "bracket");
    let n = layout.velocities;
    super::definition::expect(part, tape, layout.entries + 1 + theta.len(), n * n)?;
    let error = |source: TapeError| DefinitionError::Tape { part, source };
    Field::new(layout, tape, false, Form::Rows, theta).map_err(error)
}
