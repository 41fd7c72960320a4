//! What brackets and dissipations promise, and the functions that check it.

use metriplectic_fields::{
    BrokenLaw, ChartPoint, Column, Dimension, Matrix, Scalar, ScalarField, Space, Square, Vector,
    differential,
};
use metriplectic_manifolds::{Manifold, MetricError};

use crate::bracket::{by_dual_numbers as by_dual_numbers_bracket, epsilon};
use crate::dissipation::by_dual_numbers;
use crate::system::{Metriplectic, Point, SecondLaw};
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
pub(crate) fn bracket_defects<Y: Metriplectic + ?Sized>(
    system: &Y,
    x: &Point<Y>,
) -> Result<BracketDefects, MetricError> {
    let n = <Y::Manifold as Space>::Dim::LEN;
    let tensor = tensor(system, &ChartPoint::<Y::Manifold>::centre(x))?;
    let mut slopes = Vec::with_capacity(n);
    for l in 0..n {
        let moved = ChartPoint { base: x.clone(), q: epsilon::<Y::Manifold>(l) };
        slopes.push(self::tensor(system, &moved)?);
    }
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
    Ok(defects)
}

/// The Poisson tensor of a system at any scalar.
fn tensor<Y: Metriplectic + ?Sized, D: Scalar>(
    system: &Y,
    x: &ChartPoint<Y::Manifold, D>,
) -> Result<Matrix<Y::Manifold, D>, MetricError> {
    system.bracket().tensor(&system.site(x, &differential(system.entropy(), x)))
}

/// Checks the bracket of a system at `x` with the covectors `α`, `β`:
///
/// 1. `Π` is skew; 2. Jacobi identity; 3. `linearise` is the derivative of `apply`;
/// 4. `apply` is linear in the covector (which is Leibniz' rule); 5. `Π dS = 0`, if the system has
///    [`SecondLaw::Exact`].
///
/// # Errors
///
/// The first law that is broken.
pub fn bracket<Y: Metriplectic>(
    system: &Y,
    x: &Point<Y>,
    alpha: &Vector<Y::Manifold>,
    beta: &Vector<Y::Manifold>,
) -> Result<(), BrokenLaw> {
    let exists = |_| BrokenLaw { law: "Π exists", size: f64::NAN, bound: 0.0 };
    let bracket = system.bracket();
    let defects = bracket_defects(system, x).map_err(exists)?;
    let round_off = round_off::<Y::Manifold>;
    BrokenLaw::unless("Π is skew", defects.skewness, round_off(defects.size))?;
    // The terms may vanish one by one, so the size of a generic product Π ∂Π is allowed for.
    let size = defects.jacobi_size + defects.size;
    BrokenLaw::unless("Jacobi identity", defects.jacobi, round_off(size))?;

    let centre = ChartPoint::centre(x);
    let s = system.entropy().jet1(x).df;
    let site = system.site(&centre, &s);
    let jet = bracket.linearise(&site, alpha).map_err(exists)?;
    let defined = by_dual_numbers_bracket(bracket, &site, alpha).map_err(exists)?;
    let size = defects.size * (alpha.magnitude() + beta.magnitude());
    let off = (defined.value - jet.value).magnitude();
    BrokenLaw::unless("linearise has the value of apply", off, round_off(size))?;
    let off = (defined.tensor - jet.tensor).max_abs();
    BrokenLaw::unless("linearise has the tensor of apply", off, round_off(defects.size))?;
    let slopes = jet.along_z.max_abs() + jet.along_s.max_abs();
    let off = (defined.along_z - jet.along_z).max_abs();
    BrokenLaw::unless("linearise is the derivative along x", off, round_off(size + slopes))?;
    let off = (defined.along_s - jet.along_s).max_abs();
    BrokenLaw::unless("linearise is the derivative along dS", off, round_off(size + slopes))?;
    let combined = bracket.apply(&site, &(*alpha + *beta * 3.0)).map_err(exists)?;
    let apart = jet.value + bracket.apply(&site, beta).map_err(exists)? * 3.0;
    let off = (combined - apart).magnitude();
    BrokenLaw::unless("Π(α + 3β) = Πα + 3Πβ", off, round_off(4.0 * size))?;
    if system.second_law() != SecondLaw::Exact {
        return Ok(());
    }
    let left = bracket.apply(&site, &s).map_err(exists)?.magnitude();
    BrokenLaw::unless("Π dS = 0", left, round_off(defects.size * s.magnitude()))
}

/// Checks the dissipation of a system at `x` with the covector `w` to be killed and two more covectors:
///
/// 1. `K_w` is symmetric; 2. `K_w ⪰ 0`; 3. `K_w w = 0`; 4. `linearise` is the derivative of
///    `apply` along `x`, `w` and `α`.
///
/// # Errors
///
/// The first law that is broken.
pub fn dissipation<Y: Metriplectic>(
    system: &Y,
    x: &Point<Y>,
    w: &Vector<Y::Manifold>,
    alpha: &Vector<Y::Manifold>,
) -> Result<(), BrokenLaw> {
    let (dissipation, metric) = (system.dissipation(), system.metric());
    let broken = |law| move |_| BrokenLaw { law, size: f64::NAN, bound: 0.0 };
    let centre = ChartPoint::<Y::Manifold>::centre(x);
    let tensor = dissipation.tensor(metric, &centre, w).map_err(broken("K exists"))?;
    let size = tensor.max_abs();
    let asymmetry =
        Matrix::<Y::Manifold>::from_entries(|i, j| tensor[(i, j)] - tensor[(j, i)]).max_abs();
    BrokenLaw::unless("K is symmetric", asymmetry, round_off::<Y::Manifold>(size))?;
    let form = alpha.dot(&(tensor * *alpha));
    let scale = size * alpha.magnitude().powi(2);
    BrokenLaw::unless("K is positive semidefinite", -form, round_off::<Y::Manifold>(scale))?;
    let killed = dissipation.apply(metric, &centre, w, w).map_err(broken("K exists"))?;
    let off = killed.magnitude();
    BrokenLaw::unless("K_w w = 0", off, round_off::<Y::Manifold>(size * w.magnitude()))?;

    let jet = dissipation.linearise(metric, x, w, alpha).map_err(broken("K exists"))?;
    let defined = by_dual_numbers(dissipation, metric, x, w, alpha).map_err(broken("K exists"))?;
    // The terms have the sizes of ∂K α, K α / |w| and K.
    let relative = 1e2 * (1.0 + alpha.magnitude()) * (1.0 + w.magnitude().recip());
    for (law, left, right) in [
        ("linearise is the derivative along x", defined.along_z, jet.along_z),
        ("linearise is the derivative along w", defined.along_w, jet.along_w),
        ("linearise is the derivative along α", defined.tensor, jet.tensor),
    ] {
        let bound = relative * round_off::<Y::Manifold>(left.max_abs() + size);
        BrokenLaw::unless(law, (left - right).max_abs(), bound)?;
    }
    Ok(())
}
