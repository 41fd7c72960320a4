//! The laws of brackets and dissipations, and the functions that check them.

use metriplectic_equations::judge::{BracketDefects, bracket_defects, coordinate_scales};
use metriplectic_fields::{
    BrokenLaw, ChartPoint, Column, Dimension, Matrix, ScalarField, Space, Square, Vector,
};
use metriplectic_manifolds::Manifold;

use crate::bracket::{
    Bracket, BracketArgs, by_dual_numbers as by_dual_numbers_bracket, force_by_dual_numbers,
};
use crate::dissipation::{Dissipation, by_dual_numbers};
use crate::in_numbers::{InNumbers, units_at};
use crate::metriplectic::{Metriplectic, Point, SecondLaw};

/// The round-off of a tensor contraction whose terms have the size `scale`.
fn round_off<M: Manifold>(scale: f64) -> f64 {
    let n = M::Dim::LEN as f64;
    64.0 * n * n * f64::EPSILON * scale
}

/// Checks the bracket of a system at `x` with the covectors `α`, `β`:
///
/// 1. `Π` is skew; 2. Jacobi identity, if the bracket is to be Poisson; 3. `linearise` is the
///    derivative of `apply`; 4. `apply` is linear in the covector (which is Leibniz' rule); 5. `Π dS = 0`, if
///    the system has [`SecondLaw::Exact`]; 6. a force does no work, `⟨α, force(α)⟩ = 0`, and
///    `linearise_force` is its derivative.
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
    let (system_in_numbers, entries) = (InNumbers(system), Y::Manifold::entries(x));
    let units = coordinate_scales(&system_in_numbers, 0.0, &entries).units;
    let BracketDefects { size: tensor_size, skewness, jacobi, .. } =
        bracket_defects(&system_in_numbers, 0.0, &entries, &units).map_err(exists)?;
    let round_off = round_off::<Y::Manifold>;
    BrokenLaw::unless("Π is skew", skewness.size, round_off(skewness.terms))?;
    if bracket.is_poisson() {
        BrokenLaw::unless("Jacobi identity", jacobi.size, round_off(jacobi.terms))?;
    }

    let centre = ChartPoint::centre(x);
    let s = system.entropy().jet1(x).df;
    let g = system.metric_at(&centre);
    let args = system.bracket_args(&g, &s);
    let jet = bracket.linearise(&args, alpha).map_err(exists)?;
    let defined = by_dual_numbers_bracket(bracket, &args, alpha).map_err(exists)?;
    let size = tensor_size * (alpha.magnitude() + beta.magnitude());
    let error = (defined.value - jet.value).magnitude();
    BrokenLaw::unless("linearise has the value of apply", error, round_off(size))?;
    let error = (defined.tensor - jet.tensor).max_abs();
    BrokenLaw::unless("linearise has the tensor of apply", error, round_off(tensor_size))?;
    let slopes = jet.along_z.max_abs() + jet.along_s.max_abs();
    let error = (defined.along_z - jet.along_z).max_abs();
    BrokenLaw::unless("linearise is the derivative along x", error, round_off(size + slopes))?;
    let error = (defined.along_s - jet.along_s).max_abs();
    BrokenLaw::unless("linearise is the derivative along dS", error, round_off(size + slopes))?;
    let combined = bracket.apply(&args, &(*alpha + *beta * 3.0)).map_err(exists)?;
    let apart = jet.value + bracket.apply(&args, beta).map_err(exists)? * 3.0;
    let error = (combined - apart).magnitude();
    BrokenLaw::unless("Π(α + 3β) = Πα + 3Πβ", error, round_off(4.0 * size))?;
    if bracket.is_forced() {
        force(system, &args, alpha)?;
    }
    if system.second_law() != SecondLaw::Exact {
        return Ok(());
    }
    let left = bracket.apply(&args, &s).map_err(exists)?.magnitude();
    BrokenLaw::unless("Π dS = 0", left, round_off(tensor_size * s.magnitude()))
}

/// Checks the force of a bracket: it does no work, and `linearise_force` is its derivative.
fn force<Y: Metriplectic>(
    system: &Y,
    args: &BracketArgs<'_, Y::Manifold, Y::Metric>,
    alpha: &Vector<Y::Manifold>,
) -> Result<(), BrokenLaw> {
    let exists = |_| BrokenLaw { law: "the force exists", size: f64::NAN, bound: 0.0 };
    let round_off = round_off::<Y::Manifold>;
    let jet = system.bracket().linearise_force(args, alpha).map_err(exists)?;
    let defined = force_by_dual_numbers(system.bracket(), args, alpha).map_err(exists)?;
    let size = defined.tensor.max_abs() * alpha.magnitude();
    let power = alpha.dot(&defined.value).abs();
    BrokenLaw::unless("⟨α, force(α)⟩ = 0", power, round_off(size * alpha.magnitude()))?;
    for (law, error, size) in [
        ("linearise_force has the value of force", (defined.value - jet.value).magnitude(), size),
        (
            "linearise_force is the derivative along α",
            (defined.tensor - jet.tensor).max_abs(),
            defined.tensor.max_abs(),
        ),
        (
            "linearise_force is the derivative along x",
            (defined.along_z - jet.along_z).max_abs(),
            size + defined.along_z.max_abs(),
        ),
        (
            "linearise_force is the derivative along dS",
            (defined.along_s - jet.along_s).max_abs(),
            size + defined.along_s.max_abs(),
        ),
    ] {
        BrokenLaw::unless(law, error, round_off(size))?;
    }
    Ok(())
}

/// Checks the dissipation of a system at `x` with the covector `w` to be annihilated and two more covectors:
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
    let dissipation = system.dissipation();
    let broken = |law| move |_| BrokenLaw { law, size: f64::NAN, bound: 0.0 };
    let centre = ChartPoint::<Y::Manifold>::centre(x);
    let g = system.metric_at(&centre);
    let tensor = dissipation.tensor(&g, w).map_err(broken("K exists"))?;
    let size = tensor.max_abs();
    let asymmetry =
        Matrix::<Y::Manifold>::from_entries(|i, j| tensor[(i, j)] - tensor[(j, i)]).max_abs();
    BrokenLaw::unless("K is symmetric", asymmetry, round_off::<Y::Manifold>(size))?;
    let form = alpha.dot(&(tensor * *alpha));
    let scale = size * alpha.magnitude().powi(2);
    BrokenLaw::unless("K is positive semidefinite", -form, round_off::<Y::Manifold>(scale))?;
    let annihilated = dissipation.apply(&g, w, w).map_err(broken("K exists"))?;
    let error = annihilated.magnitude();
    BrokenLaw::unless("K_w w = 0", error, round_off::<Y::Manifold>(size * w.magnitude()))?;

    let jet = dissipation.linearise(&g, w, alpha).map_err(broken("K exists"))?;
    let defined = by_dual_numbers(dissipation, &g, w, alpha).map_err(broken("K exists"))?;
    // The terms have the sizes K α / ℓ, K α / |w| and K.
    let units = units_at(system, x);
    let shortest = (0..<Y::Manifold as Space>::Dim::LEN).map(|i| units[i]).fold(f64::MAX, f64::min);
    let image = size * alpha.magnitude();
    for (law, left, right, terms) in [
        ("linearise is the derivative along x", defined.along_z, jet.along_z, image / shortest),
        (
            "linearise is the derivative along w",
            defined.along_w,
            jet.along_w,
            image / w.magnitude(),
        ),
        ("linearise is the derivative along α", defined.tensor, jet.tensor, size),
    ] {
        let bound = 1e2 * round_off::<Y::Manifold>(left.max_abs() + terms);
        BrokenLaw::unless(law, (left - right).max_abs(), bound)?;
    }
    Ok(())
}
