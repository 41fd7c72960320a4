use super::*;
use crate::{Canonical, Euclidean, Exponential, LieDual, Metric, WeylMidpoint};
use metriplectic_fields::Real;
use nalgebra::{SMatrix, SVector, Vector3, vector};
use num_dual::DualNum;
use proptest::prelude::*;

fn columns<const N: usize>() -> impl Strategy<Value = SVector<f64, N>> {
    prop::array::uniform(-2.0..2.0).prop_map(SVector::<f64, N>::from)
}

/// `1 + B Bᵀ`, positive by construction.
fn metrics<const N: usize>() -> impl Strategy<Value = SMatrix<f64, N, N>> {
    prop::array::uniform::<_, N>(columns::<N>()).prop_map(|columns| {
        let b = SMatrix::<f64, N, N>::from_columns(&columns);
        let g = SMatrix::identity() + b * b.transpose();
        (g + g.transpose()) * 0.5
    })
}

fn all<M: Manifold, G: Riemannian<M>>(
    space: &M,
    g: &G,
    x: &M::Point<f64>,
    u: &Vector<M>,
) -> Result<(), BrokenLaw> {
    manifold(space, x, u)?;
    metric(g, x, u)?;
    retraction(&WeylMidpoint, g, x, u)?;
    retraction(&Exponential, g, x, u)?;
    symmetric_retraction(&WeylMidpoint, g, x, &M::chart(x, u))
}

proptest! {
    #[test]
    fn flat_spaces_keep_the_laws(
        x in columns::<5>(), u in columns::<5>(), g in metrics::<5>(),
    ) {
        let constant = Metric::constant(g).unwrap();
        let field = Metric::field(move |_: &SVector<Real, 5>| g.cast::<Real>());
        all(&Euclidean::<5>, &Canonical, &x, &u)?;
        all(&Euclidean::<5>, &constant, &x, &u)?;
        all(&Euclidean::<5>, &field, &x, &u)?;
    }

    #[test]
    fn duals_of_lie_algebras_keep_the_laws(
        x in columns::<6>(), u in columns::<6>(), g in metrics::<6>(),
    ) {
        let constant = Metric::constant(g).unwrap();
        all(&LieDual::se3(), &Canonical, &x, &u)?;
        all(&LieDual::so4(), &constant, &x, &u)?;
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn metrics_that_vary_keep_the_laws(
        x in columns::<3>(), u in prop::array::uniform3(-0.7..0.7), a in 0.1..1.0_f64,
    ) {
        let g = Metric::field(move |q: &Vector3<Real>| {
            let wave = Vector3::new(q.y.sin(), q.z.cos(), q.x * 0.5);
            SMatrix::<Real, 3, 3>::from_diagonal_element(1.0.into())
                + wave * wave.transpose() * Real::from(a)
        });
        all(&Euclidean::<3>, &g, &x, &Vector3::from(u))?;
    }
}

#[test]
fn dimensions_one_and_sixteen_keep_the_laws() {
    all(&Euclidean::<1>, &Canonical, &vector![0.5], &vector![-2.0]).unwrap();
    let x = SVector::<f64, 16>::from_fn(|i, _| i as f64);
    all(&Euclidean::<16>, &Canonical, &x, &(x * -0.3)).unwrap();
}

#[test]
fn the_exponential_is_not_symmetric() {
    let (x, y) = (vector![1.0, 0.0, 0.0], vector![0.0, 1.0, 0.0]);
    let broken = symmetric_retraction::<Euclidean<3>, _, _>(&Exponential, &Canonical, &x, &y);
    assert_eq!(broken.unwrap_err().law, "R_h⁻¹(y, x) is the opposite of R_h⁻¹(x, y)");
}

#[test]
fn an_asymmetric_field_breaks_the_first_law_of_metrics() {
    let skewed = Metric::field(|_: &Vector3<Real>| {
        let mut g = SMatrix::<f64, 3, 3>::identity();
        g[(0, 1)] = 0.1;
        g.cast::<Real>()
    });
    let (x, v) = (vector![1.0, 0.0, 0.0], vector![0.0, 1.0, 0.0]);
    let broken = metric::<Euclidean<3>, _>(&skewed, &x, &v).unwrap_err();
    assert_eq!(broken.law, "g is symmetric");
}
