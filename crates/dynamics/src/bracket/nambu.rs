//! The brackets of a volume form and `n − 2` Casimirs: the area form of a surface, Nambu's on a
//! 3-manifold, and their continuation to every dimension.

use std::fmt;

use metriplectic_fields::{
    ChartPoint, Column, Dimension, Matrix, Scalar, ScalarField, Space, Square, Vector, differential,
};
use metriplectic_manifolds::{
    InnerProduct, Manifold, MetricAt, MetricError, Riemannian, Rotations, Sphere,
};
use nalgebra::Const;

use super::{Bracket, BracketArgs, BracketJet, NaturalBracket, Zero};

/// The generalised Nambu bracket of an oriented Riemannian `n`-manifold with `n − 2` Casimirs `C_a`
/// (Nambu 1973 for `n = 3`; Takhtajan 1994, eq. 5, with all arguments but two held fixed):
///
/// ```math
/// (\Pi\, dH)^i = \frac{\lambda}{\sqrt{\det g}}\, \det\bigl[dC_1, \dots, dC_{n-2}, dH, e^i\bigr] .
/// ```
///
/// It satisfies the Jacobi identity for every choice of the `C_a` and of `λ(x)`. Its members:
///
/// | `n` | value | Casimirs | |
/// |---|---|---|---|
/// | 2 | [`AreaForm`](type@AreaForm) | none | `−ε^{ij}H_j/√det g` |
/// | 3 | `Nambu::default()` | the entropy | `ε^{ijk}S_jH_k/√det g`: `H`, `S` and a metric are enough |
/// | 3 | `Nambu::of(c)` | `c` | a Hamiltonian system without entropy |
/// | 4 … 8 | `Nambu::default().and(c)…` | the entropy and `n − 3` more | the motion is along the curve on which all of them and `H` are constant |
///
/// On R³ with `S = |p|²/2` it is the Lie-Poisson bracket of so(3)*; on SO(3), in the body frame,
/// `Ω = dS × dH / √det g` and `R' = R Ω̂`; on Sⁿ the orientation is `vol(a, …, b) = det[x, a, …, b]`.
///
/// The entropy is a Casimir by construction, also discretely. A step conserves the others to round-off if they
/// are listed too: [`SystemBuilder::casimir`](crate::SystemBuilder::casimir).
///
/// ```
/// use metriplectic_dynamics::{Nambu, System};
/// use metriplectic_fields::Real;
/// use metriplectic_manifolds::Sphere;
/// use nalgebra::Vector5;
///
/// // S⁴: the entropy, and one more Casimir.
/// let height = |x: &Vector5<Real>| x[4];
/// let system = System::on(Sphere::<4>)
///     .bracket(Nambu::default().and(height))
///     .energy(|x: &Vector5<Real>| x[0] * x[0] + x[1] * x[1] * 2.0)
///     .entropy(|x: &Vector5<Real>| x[0] + x[2] * x[3])
///     .casimir(height)
///     .build();
/// assert!(system.is_ok());
/// ```
#[derive(Clone, Copy, PartialEq)]
pub struct Nambu<C = OfEntropy, L = f64> {
    factor: L,
    casimirs: C,
}

/// The empty list of Casimirs, that of an area form.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoCasimir;

/// The Casimir that is the entropy of the system.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OfEntropy;

/// The bracket of the area form of an oriented surface, the member of [`Nambu`] without a Casimir:
///
/// ```math
/// (\Pi\, dH)^i = -\frac{\varepsilon^{ij} H_j}{\sqrt{\det g}} ,
/// ```
///
/// which on the round sphere is `x' = x × dH` (Marsden and Ratiu 1999, §2). It is nondegenerate: only
/// constants are Casimirs, so an entropy on a surface needs the bracket [`Zero`],
/// [`SecondLaw::Published`](crate::SecondLaw::Published), or a separate factor.
pub type AreaForm = Nambu<NoCasimir>;

/// The value of the type [`AreaForm`](type@AreaForm).
#[expect(non_upper_case_globals, reason = "it reads as the value of a unit struct does")]
pub const AreaForm: AreaForm = Nambu { factor: 1.0, casimirs: NoCasimir };

impl Default for Nambu {
    fn default() -> Self {
        Self { factor: 1.0, casimirs: OfEntropy }
    }
}

impl<F> Nambu<(NoCasimir, F)> {
    /// The bracket on a 3-manifold with the Casimir `c`, which need not be an entropy.
    pub const fn of(c: F) -> Self {
        Self { factor: 1.0, casimirs: (NoCasimir, c) }
    }
}

impl<C, L> Nambu<C, L> {
    /// Adds a Casimir, for a manifold of one dimension more.
    pub fn and<F>(self, c: F) -> Nambu<(C, F), L> {
        Nambu { factor: self.factor, casimirs: (self.casimirs, c) }
    }

    /// The bracket with the factor `λ`: a number, or a closure `|x| -> Real`, or any other
    /// [`ScalarField`].
    pub fn times<F>(self, factor: F) -> Nambu<C, F> {
        Nambu { factor, casimirs: self.casimirs }
    }
}

// By hand, because closures have no `Debug`.
impl<C, L> fmt::Debug for Nambu<C, L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Nambu").finish_non_exhaustive()
    }
}

/// A list of the `N − 2` Casimirs of a [`Nambu`] bracket on an `N`-manifold.
#[diagnostic::on_unimplemented(
    message = "a bracket with the Casimirs `{Self}` does not fit a manifold of dimension {N}, where it needs {N} − 2 of them",
    label = "a bracket for another dimension",
    note = "`AreaForm` has none and is for surfaces, dimension 2",
    note = "`Nambu::default()` has the entropy and `Nambu::of(c)` a function of your own, for dimension 3; each `.and(c)` adds a function and a dimension"
)]
pub trait Casimirs<M: Space, const N: usize> {
    /// Whether the entropy is the first Casimir.
    const ENTROPY: bool;

    /// Their covectors at `x`, from that of the entropy.
    fn covectors<D: Scalar>(&self, x: &ChartPoint<M, D>, s: &Vector<M, D>, rows: &mut Rows<M, D>);

    /// Computes the covectors at a real point, with the derivatives of those that are differentials there.
    fn jets(
        &self,
        x: &M::Point<f64>,
        s: &Vector<M>,
        rows: &mut Rows<M>,
        slopes: &mut <M::Dim as Dimension>::Array<Matrix<M>>,
    );
}

/// Covectors, one after another.
pub type Rows<M, D = f64> = <<M as Space>::Dim as Dimension>::Array<Vector<M, D>>;

impl<M: Space> Casimirs<M, 2> for NoCasimir {
    const ENTROPY: bool = false;

    #[inline]
    fn covectors<D: Scalar>(&self, _: &ChartPoint<M, D>, _: &Vector<M, D>, _: &mut Rows<M, D>) {}

    #[inline]
    fn jets(
        &self,
        _: &M::Point<f64>,
        _: &Vector<M>,
        _: &mut Rows<M>,
        _: &mut <M::Dim as Dimension>::Array<Matrix<M>>,
    ) {
    }
}

impl<M: Space> Casimirs<M, 3> for OfEntropy {
    const ENTROPY: bool = true;

    #[inline]
    fn covectors<D: Scalar>(&self, _: &ChartPoint<M, D>, s: &Vector<M, D>, rows: &mut Rows<M, D>) {
        rows[0] = *s;
    }

    #[inline]
    fn jets(
        &self,
        _: &M::Point<f64>,
        s: &Vector<M>,
        rows: &mut Rows<M>,
        _: &mut <M::Dim as Dimension>::Array<Matrix<M>>,
    ) {
        rows[0] = *s;
    }
}

macro_rules! one_more {
    ($($k:literal => $n:literal),+) => {$(
        impl<M: Space, C: Casimirs<M, $k>, F: ScalarField<M>> Casimirs<M, $n> for (C, F) {
            const ENTROPY: bool = C::ENTROPY;

            #[inline]
            fn covectors<D: Scalar>(
                &self,
                x: &ChartPoint<M, D>,
                s: &Vector<M, D>,
                rows: &mut Rows<M, D>,
            ) {
                self.0.covectors(x, s, rows);
                rows[$k - 2] = differential(&self.1, x);
            }

            #[inline]
            fn jets(
                &self,
                x: &M::Point<f64>,
                s: &Vector<M>,
                rows: &mut Rows<M>,
                slopes: &mut <M::Dim as Dimension>::Array<Matrix<M>>,
            ) {
                self.0.jets(x, s, rows, slopes);
                let jet = self.1.jet2(x);
                (rows[$k - 2], slopes[$k - 2]) = (jet.df, jet.hf);
            }
        }
    )+};
}
one_more!(2 => 3, 3 => 4, 4 => 5, 5 => 6, 6 => 7, 7 => 8);

/// The largest dimension that a list of Casimirs is long enough for.
const LARGEST: usize = 8;

/// The vector `v^i = det[r_1, …, r_{n−1}, e^i]`: in dimension 3 the cross product.
///
/// It expands, row by row, the minors on all sets of columns. It divides by nothing, so the
/// derivatives are also right where the rows are dependent.
#[inline]
fn cross<M: Space, D: Scalar>(rows: &Rows<M, D>) -> Vector<M, D> {
    let n = M::Dim::LEN;
    let mut v = Vector::<M, D>::zero();
    if n == 2 {
        (v[0], v[1]) = (-rows[0][1], rows[0][0]);
        return v;
    }
    if n == 3 {
        let (a, b) = (&rows[0], &rows[1]);
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            v[i] = a[j] * b[k] - a[k] * b[j];
        }
        return v;
    }
    let mut minors = [D::zero(); 1 << LARGEST];
    minors[0] = D::one();
    // A column has the sign of its place from the end, which is the place of its row.
    let expand = |columns: usize, j: usize, minor: D| {
        let behind = (columns >> (j + 1)).count_ones();
        if behind.is_multiple_of(2) { minor } else { -minor }
    };
    let all: usize = (1 << n) - 1;
    for columns in 1..all {
        let row = &rows[columns.count_ones() as usize - 1];
        for j in (0..n).filter(|j| columns >> j & 1 == 1) {
            let minor = expand(columns, j, minors[columns & !(1 << j)]);
            minors[columns] += row[j] * minor;
        }
    }
    for i in 0..n {
        v[i] = expand(all, i, minors[all & !(1 << i)]);
    }
    v
}

/// The derivative of `ln(1/√det g)` along the chart at its centre, `−½ tr(g⁻¹ ∂_k g)`.
#[inline]
fn density_slope<M: Manifold, G: Riemannian<M>>(
    g: &MetricAt<'_, M, G>,
) -> Result<Vector<M>, MetricError> {
    let mut slope = Vector::<M>::zero();
    let Some(slopes) = g.slopes()? else { return Ok(slope) };
    let inner = g.inner()?;
    for i in 0..M::Dim::LEN {
        let row = inner.sharp(&Vector::<M>::basis(i));
        for k in 0..M::Dim::LEN {
            slope[k] -= 0.5 * (slopes[k] * row)[i];
        }
    }
    Ok(slope)
}

impl<M, G, C, L, const N: usize> Bracket<M, G> for Nambu<C, L>
where
    M: Manifold<Dim = Const<N>>,
    G: Riemannian<M>,
    C: Casimirs<M, N>,
    L: ScalarField<M>,
{
    #[inline]
    fn apply<D: Scalar>(
        &self,
        at: &BracketArgs<'_, M, G, D>,
        alpha: &Vector<M, D>,
    ) -> Result<Vector<M, D>, MetricError> {
        let x = at.g.x;
        let density = self.factor.at(&x.point()) / at.g.volume_density()?;
        let mut rows = Const::<N>::array(|_| Vector::<M, D>::zero());
        self.casimirs.covectors(x, at.s, &mut rows);
        rows[N - 2] = *alpha;
        Ok(cross::<M, D>(&rows) * density)
    }

    #[inline]
    fn linearise(
        &self,
        at: &BracketArgs<'_, M, G>,
        alpha: &Vector<M>,
    ) -> Result<BracketJet<M>, MetricError> {
        let x = &at.g.x.base;
        // The derivatives first, so that the metric is evaluated once.
        let density_slope = density_slope(at.g)?;
        let (volume, factor) = (at.g.volume_density()?, self.factor.jet1(x));
        let density = factor.value / volume;
        let zero = Matrix::<M>::zeros();
        let (mut rows, mut slopes) =
            (Const::<N>::array(|_| Vector::<M>::zero()), Const::<N>::array(|_| zero));
        self.casimirs.jets(x, at.s, &mut rows, &mut slopes);
        rows[N - 2] = *alpha;
        // The determinant is linear in each row.
        let along = |row: usize, slope: &Matrix<M>| -> Matrix<M> {
            Square::from_columns(|k| {
                let mut rows = rows;
                rows[row] = slope.column_at(k);
                cross::<M, f64>(&rows) * density
            })
        };
        let (one, plain) = (<Matrix<M>>::one(), cross::<M, f64>(&rows));
        let slope = density_slope * density + factor.df * volume.recip();
        let mut along_z = <Matrix<M> as Square<f64>>::outer(&plain, &slope);
        let moving = slopes.iter().enumerate().take(N - 2).skip(usize::from(C::ENTROPY));
        for (row, slope) in moving {
            along_z += along(row, slope);
        }
        let along_s = if C::ENTROPY { along(0, &one) } else { zero };
        Ok(BracketJet { value: plain * density, along_z, along_s, tensor: along(N - 2, &one) })
    }

    fn annihilates_entropy(&self) -> bool {
        C::ENTROPY
    }
}

impl NaturalBracket for Rotations {
    type Bracket = Zero;

    fn natural_bracket(&self) -> Zero {
        Zero
    }
}

impl<const N: usize> NaturalBracket for Sphere<N>
where
    Self: Manifold,
{
    type Bracket = Zero;

    fn natural_bracket(&self) -> Zero {
        Zero
    }
}
