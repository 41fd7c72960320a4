//! Spaces whose size is known at run time.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use metriplectic_manifolds::lie_algebra::{AlgebraError, StructureConstant};
use metriplectic_manifolds::{HalfLine, LieDual, Rotations, Sphere};

use super::error::DefinitionError;
use super::factor::{Factor, Flat, Typed};

/// A space of states, and products of them in any order.
///
/// A state is a list of [`entries`](Self::entries), around which there are [`directions`](Self::directions) of a chart. Recorded tensors act
/// on covectors of as many numbers as a velocity has ([`velocities`](Self::velocities)).
///
/// | space | entries | directions | a velocity |
/// |---|---|---|---|
/// | `Rⁿ`, the dual of a Lie algebra | `n` | `n` | `x'` |
/// | `Sⁿ`, `n = 1 … 7` | `n + 1` | `n` | `x'`, `n + 1` numbers |
/// | `SO(3)`, row by row | 9 | 3 | the body angular velocity |
/// | `T*SO(3)`, an attitude and a body momentum | 12 | 6 | the body angular velocity, and `p'` |
/// | positive numbers | 1 | 1 | `s'` |
#[derive(Clone, Debug)]
pub struct Space {
    kind: SpaceKind,
}

#[derive(Clone, Debug)]
enum SpaceKind {
    Euclidean(usize),
    LieDual(usize, Vec<StructureConstant>),
    Sphere(usize, Arc<dyn Factor>),
    Rotations,
    CotangentRotations,
    HalfLine,
    Product(Vec<Space>),
}

/// A space that is no product, as the brackets of the library know it.
#[derive(Clone, Copy, Debug)]
pub(super) enum Simple<'a> {
    Flat(usize),
    LieDual(&'a [StructureConstant]),
    Sphere(usize),
    Rotations,
    CotangentRotations,
    Other,
}

impl Space {
    /// Makes the flat space `Rⁿ`.
    ///
    /// # Errors
    ///
    /// [`DefinitionError::NoVariables`] for `n = 0`.
    pub fn euclidean(n: usize) -> Result<Self, DefinitionError> {
        if n == 0 {
            return Err(DefinitionError::NoVariables);
        }
        Ok(Self { kind: SpaceKind::Euclidean(n) })
    }

    /// Makes the dual of a Lie algebra of `n` dimensions with `[e_a, e_b] = C_ab^d e_d`, from the constants `(a, b, d, C_ab^d)` that are not
    /// zero. Both `C_ab^d` and `C_ba^d` are listed.
    ///
    /// # Errors
    ///
    /// [`DefinitionError::Algebra`] if a constant is not finite, not antisymmetric, or violates the Jacobi identity;
    /// [`DefinitionError::Index`] for an index beyond `n`.
    pub fn lie_dual(
        n: usize,
        constants: &[(usize, usize, usize, f64)],
    ) -> Result<Self, DefinitionError> {
        if n == 0 {
            return Err(DefinitionError::NoVariables);
        }
        let constants =
            constants.iter().map(|&(a, b, d, value)| StructureConstant { a, b, d, value });
        let constants = super::algebra::checked(n, constants.collect())?;
        Ok(Self { kind: SpaceKind::LieDual(n, constants) })
    }

    /// Makes `so(3)*`, the angular momenta of a body: `[e_a, e_b] = ε_abc e_c`.
    #[must_use]
    pub fn so3_dual() -> Self {
        Self::known(&LieDual::so3())
    }

    /// Makes `se(3)*`, the states `(M, Γ)` of a heavy top.
    #[must_use]
    pub fn se3_dual() -> Self {
        Self::known(&LieDual::se3())
    }

    /// Makes `so(4)*`.
    #[must_use]
    pub fn so4_dual() -> Self {
        Self::known(&LieDual::so4())
    }

    /// Makes `sl(2)*`.
    #[must_use]
    pub fn sl2_dual() -> Self {
        Self::known(&LieDual::sl2())
    }

    /// Makes the dual of the Heisenberg algebra.
    #[must_use]
    pub fn heisenberg_dual() -> Self {
        Self::known(&LieDual::heisenberg())
    }

    fn known<const N: usize>(dual: &LieDual<N>) -> Self {
        Self { kind: SpaceKind::LieDual(N, dual.algebra().constants().to_vec()) }
    }

    /// Makes the unit sphere `Sⁿ` in `Rⁿ⁺¹`.
    ///
    /// # Errors
    ///
    /// [`DefinitionError::Sphere`] unless `n = 1 … 7`.
    pub fn sphere(n: usize) -> Result<Self, DefinitionError> {
        let factor: Arc<dyn Factor> = match n {
            1 => Arc::new(Typed::new(Sphere::<1>)),
            2 => Arc::new(Typed::new(Sphere::<2>)),
            3 => Arc::new(Typed::new(Sphere::<3>)),
            4 => Arc::new(Typed::new(Sphere::<4>)),
            5 => Arc::new(Typed::new(Sphere::<5>)),
            6 => Arc::new(Typed::new(Sphere::<6>)),
            7 => Arc::new(Typed::new(Sphere::<7>)),
            _ => return Err(DefinitionError::Sphere { n }),
        };
        Ok(Self { kind: SpaceKind::Sphere(n, factor) })
    }

    /// Makes the group `SO(3)` of attitudes.
    #[must_use]
    pub const fn rotations() -> Self {
        Self { kind: SpaceKind::Rotations }
    }

    /// Makes `T*SO(3) = SO(3) × R³`: attitudes with body momenta.
    #[must_use]
    pub const fn cotangent_rotations() -> Self {
        Self { kind: SpaceKind::CotangentRotations }
    }

    /// Makes the positive numbers.
    #[must_use]
    pub const fn half_line() -> Self {
        Self { kind: SpaceKind::HalfLine }
    }

    /// Makes the product of spaces. A state is that of the first one, followed by that of the next.
    ///
    /// # Errors
    ///
    /// [`DefinitionError::NoVariables`] for an empty product.
    pub fn product(spaces: Vec<Self>) -> Result<Self, DefinitionError> {
        if spaces.is_empty() {
            return Err(DefinitionError::NoVariables);
        }
        Ok(Self { kind: SpaceKind::Product(spaces) })
    }

    /// The numbers of a state.
    #[must_use]
    pub fn entries(&self) -> usize {
        self.sum(|factor| factor.entries())
    }

    /// The directions of a chart.
    #[must_use]
    pub fn directions(&self) -> usize {
        self.sum(|factor| factor.directions())
    }

    /// The numbers of a velocity, on which recorded tensors act.
    #[must_use]
    pub fn velocities(&self) -> usize {
        self.sum(|factor| factor.velocities())
    }

    /// Returns whether the space is flat: a vector space, whose charts are `x + q`.
    #[must_use]
    pub fn is_flat(&self) -> bool {
        let mut flat = true;
        self.each(&mut |factor| flat &= factor.is_flat());
        flat
    }

    /// The factors of a product, in their order; the space itself, if it is none.
    #[must_use]
    pub fn components(&self) -> &[Self] {
        match &self.kind {
            SpaceKind::Product(spaces) => spaces,
            _ => std::slice::from_ref(self),
        }
    }

    /// Returns whether it is a product.
    pub(super) const fn is_product(&self) -> bool {
        matches!(self.kind, SpaceKind::Product(_))
    }

    pub(super) fn simple(&self) -> Simple<'_> {
        match &self.kind {
            SpaceKind::Euclidean(n) => Simple::Flat(*n),
            SpaceKind::LieDual(_, constants) => Simple::LieDual(constants),
            SpaceKind::Sphere(n, _) => Simple::Sphere(*n),
            SpaceKind::CotangentRotations => Simple::CotangentRotations,
            SpaceKind::Rotations => Simple::Rotations,
            SpaceKind::HalfLine | SpaceKind::Product(_) => Simple::Other,
        }
    }

    fn sum(&self, of: impl Fn(&dyn Factor) -> usize) -> usize {
        let mut sum = 0;
        self.each(&mut |factor| sum += of(&**factor));
        sum
    }

    fn each(&self, f: &mut dyn FnMut(&Arc<dyn Factor>)) {
        match &self.kind {
            SpaceKind::Euclidean(n) | SpaceKind::LieDual(n, _) => {
                f(&(Arc::new(Flat(*n)) as Arc<dyn Factor>));
            }
            SpaceKind::Sphere(_, factor) => f(factor),
            SpaceKind::Rotations => f(&(Arc::new(Typed::new(Rotations)) as Arc<dyn Factor>)),
            SpaceKind::CotangentRotations => {
                f(&(Arc::new(Typed::new(Rotations)) as Arc<dyn Factor>));
                f(&(Arc::new(Flat(3)) as Arc<dyn Factor>));
            }
            SpaceKind::HalfLine => f(&(Arc::new(Typed::new(HalfLine)) as Arc<dyn Factor>)),
            SpaceKind::Product(spaces) => spaces.iter().for_each(|space| space.each(f)),
        }
    }
}

impl fmt::Display for Space {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.kind {
            SpaceKind::Euclidean(n) => write!(f, "R^{n}"),
            SpaceKind::LieDual(n, _) => write!(f, "the dual of a Lie algebra of dimension {n}"),
            SpaceKind::Sphere(n, _) => write!(f, "S^{n}"),
            SpaceKind::Rotations => f.write_str("SO(3)"),
            SpaceKind::CotangentRotations => f.write_str("T*SO(3)"),
            SpaceKind::HalfLine => f.write_str("the positive numbers"),
            SpaceKind::Product(spaces) => {
                for (k, space) in spaces.iter().enumerate() {
                    let between = if k > 0 { " × " } else { "" };
                    if space.is_product() {
                        write!(f, "{between}({space})")?;
                    } else {
                        write!(f, "{between}{space}")?;
                    }
                }
                Ok(())
            }
        }
    }
}

/// A factor with the places of its numbers.
#[derive(Clone, Debug)]
pub(super) struct Placed {
    pub(super) factor: Arc<dyn Factor>,
    pub(super) entries: Range<usize>,
    pub(super) directions: Range<usize>,
    pub(super) velocities: Range<usize>,
}

/// All factors of a space, in a row.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub(super) factors: Vec<Placed>,
    pub(super) entries: usize,
    pub(super) directions: usize,
    pub(super) velocities: usize,
    pub(super) is_flat: bool,
}

impl Layout {
    /// Lists the factors of a space. Flat ones in a row are one factor.
    pub(super) fn of(space: &Space) -> Self {
        let mut all: Vec<Arc<dyn Factor>> = Vec::new();
        space.each(&mut |factor| match all.last_mut() {
            Some(last) if last.is_flat() && factor.is_flat() => {
                *last = Arc::new(Flat(last.entries() + factor.entries()));
            }
            _ => all.push(Arc::clone(factor)),
        });
        let is_flat = all.iter().all(|factor| factor.is_flat());
        let mut layout =
            Self { factors: Vec::new(), entries: 0, directions: 0, velocities: 0, is_flat };
        for factor in all {
            let after = |from: usize, count: usize| from..from + count;
            let placed = Placed {
                entries: after(layout.entries, factor.entries()),
                directions: after(layout.directions, factor.directions()),
                velocities: after(layout.velocities, factor.velocities()),
                factor,
            };
            layout.entries = placed.entries.end;
            layout.directions = placed.directions.end;
            layout.velocities = placed.velocities.end;
            layout.factors.push(placed);
        }
        layout
    }
}

impl From<AlgebraError> for DefinitionError {
    fn from(error: AlgebraError) -> Self {
        Self::Algebra(error)
    }
}
