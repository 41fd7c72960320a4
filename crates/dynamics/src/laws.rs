//! What brackets and dissipations promise, and the functions that check it.

use metriplectic_fields::{BrokenLaw, ChartPoint, Column, Dimension, Matrix, Square, Vector};
use metriplectic_manifolds::{Manifold, Riemannian};
use num_dual::Dual64;

use crate::bracket::{by_dual_numbers as by_dual_numbers_bracket, epsilon};
use crate::dissipation::by_dual_numbers;
use crate::{Bracket, Dissipation};

/// Round-off of a tensor contraction whose terms have the size `scale`.
fn round_off<M: Manifold>(scale: f64) -> f64 {
    let n = M::Dim::LEN as f64;
    64.0 * n * n * f64::EPSILON * scale.max(f64::MIN_POSITIVE)
}

/// The largest violations of the laws of a Poisson tensor at one point, each with the size of the
/// terms that should cancel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BracketDefects {
    pub(crate) skewness: f64,
    pub(crate) jacobi: f64,
    pub(crate) size: f64,
    pub(crate) jacobi_size: f64,
}

/// Evaluates skewness and the Jacobi identity `Π^{il}∂_lΠ^{jk} + cyclic` at `x`.
pub(crate) fn bracket_defects<M: Manifold, B: Bracket<M>>(
    bracket: &B,
    space: &M,
    x: &M::Point<f64>,
) -> BracketDefects {
    let n = M::Dim::LEN;
    let tensor = bracket.tensor(space, &ChartPoint::<M>::centre(x));
    let slopes: Vec<Matrix<M, Dual64>> = (0..n)
        .map(|l| bracket.tensor(space, &ChartPoint { base: x.clone(), q: epsilon::<M>(l) }))
        .collect();
    let mut defects =
        BracketDefects { skewness: 0.0, jacobi: 0.0, size: tensor.max_abs(), jacobi_size: 0.0 };
    let worst = |old: f64, new: f64| if new > old || new.is_nan() { new } else { old };
    for i in 0..n {
        for j in 0..n {
            defects.skewness = worst(defects.skewness, (tensor[(i, j)] + tensor[(j, i)]).abs());
            for k in 0..n {
                let term = |a: usize, b: usize, c: usize| {
                    (0..n).map(|l| tensor[(a, l)] * slopes[l][(b, c)].eps).sum::<f64>()
                };
                let terms = [term(i, j, k), term(j, k, i), term(k, i, j)];
                defects.jacobi = worst(defects.jacobi, terms.iter().sum::<f64>().abs());
                let size = terms.iter().map(|term| term.abs()).fold(0.0, f64::max);
                defects.jacobi_size = worst(defects.jacobi_size, size);
            }
        }
    }
    defects
}

/// Checks a bracket at `x` with the covectors `α`, `β`:
///
/// 1. `Π` is skew; 2. Jacobi identity; 3. `linearise` is the derivative of `apply`;
/// 4. `apply` is linear in the covector (which is Leibniz' rule).
///
/// # Errors
///
/// The first law that is broken.
pub fn bracket<M: Manifold, B: Bracket<M>>(
    bracket: &B,
    space: &M,
    x: &M::Point<f64>,
    alpha: &Vector<M>,
    beta: &Vector<M>,
) -> Result<(), BrokenLaw> {
    let defects = bracket_defects(bracket, space, x);
    BrokenLaw::unless("Π is skew", defects.skewness, round_off::<M>(defects.size))?;
    // The terms may vanish one by one, so the size of a generic product Π ∂Π is allowed for.
    let size = defects.jacobi_size + defects.size;
    BrokenLaw::unless("Jacobi identity", defects.jacobi, round_off::<M>(size))?;

    let centre = ChartPoint::<M>::centre(x);
    let jet = bracket.linearise(space, x, alpha);
    let defined = by_dual_numbers_bracket(bracket, space, x, alpha);
    let size = defects.size * (alpha.magnitude() + beta.magnitude());
    let off = (defined.value - jet.value).magnitude();
    BrokenLaw::unless("linearise has the value of apply", off, round_off::<M>(size))?;
    let off = (defined.tensor - jet.tensor).max_abs();
    BrokenLaw::unless("linearise has the tensor of apply", off, round_off::<M>(defects.size))?;
    let off = (defined.along_z - jet.along_z).max_abs();
    let bound = round_off::<M>(size + jet.along_z.max_abs());
    BrokenLaw::unless("linearise is the derivative of apply", off, bound)?;
    let combined = bracket.apply(space, &centre, &(*alpha + *beta * 3.0));
    let apart = jet.value + bracket.apply(space, &centre, beta) * 3.0;
    let off = (combined - apart).magnitude();
    BrokenLaw::unless("Π(α + 3β) = Πα + 3Πβ", off, round_off::<M>(4.0 * size))
}

/// Checks a dissipation at `x` with the covector `w` to be killed and two more covectors:
///
/// 1. `K_w` is symmetric; 2. `K_w ⪰ 0`; 3. `K_w w = 0`; 4. `linearise` is the derivative of
///    `apply` along `x`, `w` and `α`.
///
/// # Errors
///
/// The first law that is broken.
pub fn dissipation<M: Manifold, G: Riemannian<M>, K: Dissipation<M, G>>(
    dissipation: &K,
    metric: &G,
    x: &M::Point<f64>,
    w: &Vector<M>,
    alpha: &Vector<M>,
) -> Result<(), BrokenLaw> {
    let broken = |law| move |_| BrokenLaw { law, size: f64::NAN, bound: 0.0 };
    let centre = ChartPoint::<M>::centre(x);
    let tensor = dissipation.tensor(metric, &centre, w).map_err(broken("K exists"))?;
    let size = tensor.max_abs();
    let asymmetry = Matrix::<M>::from_entries(|i, j| tensor[(i, j)] - tensor[(j, i)]).max_abs();
    BrokenLaw::unless("K is symmetric", asymmetry, round_off::<M>(size))?;
    let form = alpha.dot(&(tensor * *alpha));
    let scale = size * alpha.magnitude().powi(2);
    BrokenLaw::unless("K is positive semidefinite", -form, round_off::<M>(scale))?;
    let killed = dissipation.apply(metric, &centre, w, w).map_err(broken("K exists"))?;
    let off = killed.magnitude();
    BrokenLaw::unless("K_w w = 0", off, round_off::<M>(size * w.magnitude()))?;

    let jet = dissipation.linearise(metric, x, w, alpha).map_err(broken("K exists"))?;
    let defined = by_dual_numbers(dissipation, metric, x, w, alpha).map_err(broken("K exists"))?;
    // The terms have the sizes of ∂K α, K α / |w| and K.
    let relative = 1e2 * (1.0 + alpha.magnitude()) * (1.0 + w.magnitude().recip());
    for (law, left, right) in [
        ("linearise is the derivative along x", defined.along_z, jet.along_z),
        ("linearise is the derivative along w", defined.along_w, jet.along_w),
        ("linearise is the derivative along α", defined.tensor, jet.tensor),
    ] {
        let bound = relative * round_off::<M>(left.max_abs() + size);
        BrokenLaw::unless(law, (left - right).max_abs(), bound)?;
    }
    Ok(())
}
