//! The Jacobian of a step, assembled from jets, against nested dual numbers.

use metriplectic::dynamics::velocity::{independence, projected_fractions};
use metriplectic::fields::{Column, Square, jacobian};
use metriplectic::integrators::{DiscreteGradient, Equation, Residual};
use metriplectic::manifolds::Riemannian;
use metriplectic::prelude::*;
use metriplectic_studies::{AnyGradient, Either};
use proptest::prelude::*;

/// Random coefficients of a field on Rⁿ.
type Coefficients<const N: usize> = [[f64; N]; 3];

fn coefficients<const N: usize>() -> impl Strategy<Value = Coefficients<N>> {
    prop::array::uniform3(prop::array::uniform::<_, N>(-1.0..1.0))
}

fn columns<const N: usize>(size: f64) -> impl Strategy<Value = SVector<f64, N>> {
    prop::array::uniform::<_, N>(-size..size).prop_map(SVector::<f64, N>::from)
}

/// A displacement that is neither at round-off nor out of proportion.
fn displacements<const N: usize>() -> impl Strategy<Value = SVector<f64, N>> {
    columns::<N>(1.0).prop_filter("long enough", |u| u.norm() > 0.05)
}

/// `1 + B Bᵀ/4`, symmetric and positive.
fn metrics<const N: usize>() -> impl Strategy<Value = SMatrix<f64, N, N>> {
    prop::array::uniform::<_, N>(columns::<N>(1.0)).prop_map(|columns| {
        let b = SMatrix::<f64, N, N>::from_columns(&columns);
        let g = SMatrix::identity() + b * b.transpose() * 0.25;
        (g + g.transpose()) * 0.5
    })
}

/// `Σ a_i x_i² + b_i sin x_i + c_i x_i x_{i+1}²`.
fn waves<D: Scalar, const N: usize>([a, b, c]: &Coefficients<N>, x: &SVector<D, N>) -> D {
    (0..N)
        .map(|i| {
            let next = x[(i + 1) % N];
            x[i].powi(2) * a[i] + x[i].sin() * b[i] + x[i] * next * next * c[i]
        })
        .sum()
}

/// The waves as a closure over `Real`.
fn wavy<const N: usize>(c: Coefficients<N>) -> impl Fn(&SVector<Real, N>) -> Real + Copy {
    move |x| waves(&c, x)
}

/// The waves as a type with a generic method.
#[derive(Clone, Copy)]
struct Wavy<const N: usize>(Coefficients<N>);

impl<const N: usize> ScalarField<Euclidean<N>> for Wavy<N> {
    fn at<D: Scalar>(&self, x: &SVector<D, N>) -> D {
        waves(&self.0, x)
    }
}

impl<const N: usize> ScalarField<LieDual<N>> for Wavy<N> {
    fn at<D: Scalar>(&self, x: &SVector<D, N>) -> D {
        waves(&self.0, x)
    }
}

/// Waves for a force, as a type with a generic method.
#[derive(Clone, Copy)]
struct Waves<const N: usize>([Coefficients<N>; N]);

impl<const N: usize> Force<N> for Waves<N> {
    fn at<D: Scalar>(&self, xi: &SVector<D, N>) -> SVector<D, N> {
        SVector::from_fn(|i, _| waves(&self.0[i], xi))
    }
}

/// Compares value and Jacobian of the residual of a step from `x` with its definition at dual
/// numbers, for both retractions.
fn agrees<Y: Metriplectic>(
    system: &Y,
    x: &<Y::Manifold as metriplectic::fields::Space>::Point<f64>,
    u: &metriplectic::fields::Vector<Y::Manifold>,
) -> Result<(), TestCaseError> {
    agrees_with((WEYL, Gonzalez, 1.0), system, x, u)?;
    agrees_with((EXPONENTIAL, Gonzalez, 1.0), system, x, u)
}

/// The same for the other discrete gradients, whose Jacobian is that of a chart that stays where it
/// is, as on a flat space. A quotient over a thousandth of a function has lost six digits in its slope.
fn gradients_agree<Y: Metriplectic>(
    system: &Y,
    x: &<Y::Manifold as metriplectic::fields::Space>::Point<f64>,
    u: &metriplectic::fields::Vector<Y::Manifold>,
) -> Result<(), TestCaseError> {
    agrees_with((WEYL, AnyGradient::MeanValue, 2.0), system, x, u)?;
    agrees_with((WEYL, AnyGradient::ItohAbe, 100.0), system, x, u)?;
    agrees_with((WEYL, AnyGradient::SymmetricItohAbe, 100.0), system, x, u)
}

/// Either of two retractions: each system compiles its equation once.
type Geodesic = Either<WeylMidpoint, Exponential>;
const WEYL: Geodesic = Either::First(WeylMidpoint);
const EXPONENTIAL: Geodesic = Either::Second(Exponential);

fn agrees_with<Y, W>(
    (retraction, gradient, tolerance): (Geodesic, W, f64),
    system: &Y,
    x: &<Y::Manifold as metriplectic::fields::Space>::Point<f64>,
    u: &metriplectic::fields::Vector<Y::Manifold>,
) -> Result<(), TestCaseError>
where
    Y: Metriplectic,
    W: DiscreteGradient,
{
    let scheme = Scheme::new(retraction).gradient(gradient);
    let residual = Residual::new(system, &scheme, x, 0.1);
    let Some(assembled) = residual.linearise(u) else {
        return Err(TestCaseError::fail("the residual is defined"));
    };
    let Some(value) = residual.value(u) else {
        return Err(TestCaseError::fail("the residual has a value"));
    };
    let defined = residual.at::<f64>(u).map_err(|error| TestCaseError::fail(error.to_string()))?;
    let nested = jacobian::<Y::Manifold, f64>(
        |u| residual.at(u).unwrap_or_else(|_| Column::from_index(|_| f64::NAN.into())),
        u,
    );
    // Both sides lose digits in the defect of the discrete gradient, whose terms are of order 1. A metric
    // that varies has numerical geodesics, good to 10⁻¹³ in each piece, which the two sides follow with
    // steps of their own.
    let numerical = if system.metric().slopes(x).is_some() { 10.0 } else { 1.0 };
    let size = tolerance * nested.max_abs().max(1.0);
    prop_assert!((assembled.residual - defined).magnitude() <= 1e-13 * numerical * size);
    prop_assert!((value - defined).magnitude() <= 1e-13 * numerical * size);
    let off = (assembled.jacobian - nested).max_abs();
    prop_assert!(off <= 1e-12 * size, "off by {off:.1e} of {size:.1e}");
    Ok(())
}

macro_rules! on_flat_spaces {
    ($name:ident, $n:literal) => {
        proptest! {
            #[test]
            fn $name(
                h in coefficients::<$n>(),
                s in coefficients::<$n>(),
                g in metrics::<$n>(),
                skew in prop::array::uniform::<_, $n>(columns::<$n>(1.0)),
                x in columns::<$n>(1.0),
                u in displacements::<$n>(),
            ) {
                let b = SMatrix::<f64, $n, $n>::from_columns(&skew);
                let system = System::on(Euclidean::<$n>)
                    .metric(Metric::constant(g).unwrap())
                    .bracket(Poisson::constant(b - b.transpose()).unwrap())
                    .energy(wavy(h))
                    .entropy(Wavy(s))
                    .second_law(SecondLaw::Published)
                    .build()
                    .unwrap();
                agrees(&system, &x, &u)?;
                gradients_agree(&system, &x, &u)?;
                // The exact scheme, with a bracket that varies; its Jacobian does not ask whether
                // the tensor satisfies Jacobi's identity, and annihilates dS.
                let tensor = move |x: &SVector<Real, $n>| {
                    let wave = x.map(|x| (x * 0.7).sin());
                    let b = b.cast::<Real>() + wave * x.transpose();
                    b - b.transpose()
                };
                let exact = System::on(Euclidean::<$n>)
                    .metric(Metric::field(move |_: &SVector<Real, $n>| g.cast::<Real>()))
                    .bracket(Poisson::field(tensor))
                    .energy(Wavy(h))
                    .entropy(wavy(s))
                    .build()
                    .unwrap();
                agrees(&exact, &x, &u)?;
            }
        }
    };
}
on_flat_spaces!(on_the_line, 1);
on_flat_spaces!(on_the_plane, 2);
on_flat_spaces!(in_dimension_three, 3);
on_flat_spaces!(in_dimension_four, 4);
on_flat_spaces!(in_dimension_five, 5);
on_flat_spaces!(in_dimension_six, 6);

proptest! {
    // One of six random systems has all of its differentials independent.
    #![proptest_config(ProptestConfig { max_global_rejects: 8192, ..ProptestConfig::default() })]

    #[test]
    fn on_duals_of_lie_algebras(
        h in coefficients::<3>(), s in coefficients::<3>(), g in metrics::<3>(),
        x in columns::<3>(1.0), u in displacements::<3>(),
        h6 in coefficients::<6>(), s6 in coefficients::<6>(),
        x6 in columns::<6>(1.0), u6 in displacements::<6>(),
    ) {
        for space in [LieDual::so3(), LieDual::sl2(), LieDual::heisenberg()] {
            let system = System::on(space)
                .metric(Metric::constant(g).unwrap())
                .energy(wavy(h))
                .entropy(wavy(s))
                .second_law(SecondLaw::Published)
                .build()
                .unwrap();
            agrees(&system, &x, &u)?;
        }
        for space in [LieDual::se3(), LieDual::so4()] {
            let system = System::on(space)
                .energy(wavy(h6))
                .entropy(wavy(s6))
                .second_law(SecondLaw::Published)
                .build()
                .unwrap();
            agrees(&system, &x6, &u6)?;
        }
    }

    #[test]
    fn on_the_dual_of_an_algebra_in_a_random_basis(
        h in coefficients::<3>(), s in coefficients::<3>(),
        basis in metrics::<3>(), g in metrics::<3>(),
        x in columns::<3>(1.0), u in displacements::<3>(),
    ) {
        // so(3) and sl(2) in the basis of the columns of B: no structure constant is zero.
        let so3 = [Vector3::x(), Vector3::y(), Vector3::z()].map(|e| e.cross_matrix());
        let diagonal = Matrix2::new(1.0, 0.0, 0.0, -1.0);
        let sl2 = [diagonal, Matrix2::new(0.0, 1.0, 0.0, 0.0), Matrix2::new(0.0, 0.0, 1.0, 0.0)];
        let mixed = |e: &[Matrix3<f64>; 3], j: usize| (0..3).map(|i| e[i] * basis[(i, j)]).sum();
        let rotations = LieAlgebra::of_matrices(&[0, 1, 2].map(|j| mixed(&so3, j))).unwrap();
        let mixed = |e: &[Matrix2<f64>; 3], j: usize| (0..3).map(|i| e[i] * basis[(i, j)]).sum();
        let squeezes = LieAlgebra::of_matrices(&[0, 1, 2].map(|j| mixed(&sl2, j))).unwrap();
        for algebra in [rotations, squeezes] {
            let system = System::on(LieDual::of(algebra))
                .metric(Metric::constant(g).unwrap())
                .energy(Wavy(h))
                .entropy(wavy(s))
                .second_law(SecondLaw::Published)
                .build()
                .unwrap();
            agrees(&system, &x, &u)?;
        }
    }

    #[test]
    fn with_a_metric_that_varies(
        h in coefficients::<2>(), s in coefficients::<2>(), c in prop::array::uniform2(-0.3..0.3),
        x in columns::<2>(0.5), u in displacements::<2>(),
    ) {
        // Geodesics are integrated to 10⁻¹³, and so are the derivatives of their ends.
        let metric = move |q: &Vector2<Real>| {
            let (a, b) = (q.x.sin() * c[0] + 1.0, q.y.cos() * c[1] + 1.0);
            Matrix2::new(a, a * b * 0.25, a * b * 0.25, b)
        };
        let system = System::on(Euclidean::<2>)
            .metric(Metric::field(metric))
            .bracket(AreaForm)
            .energy(wavy(h))
            .entropy(Wavy(s))
            .second_law(SecondLaw::Published)
            .build()
            .unwrap();
        agrees(&system, &x, &u)?;
    }

    /// The Jacobian does not ask whether the invariants are any.
    #[test]
    fn with_an_exact_second_law_and_further_invariants(
        h in coefficients::<4>(), s in coefficients::<4>(), c in coefficients::<4>(),
        j in coefficients::<4>(), g in metrics::<4>(),
        skew in prop::array::uniform::<_, 4>(columns::<4>(1.0)),
        x in columns::<4>(1.0), u in displacements::<4>(),
    ) {
        let b = SMatrix::<f64, 4, 4>::from_columns(&skew);
        let system = System::on(Euclidean::<4>)
            .metric(Metric::constant(g).unwrap())
            .bracket(Poisson::constant(b - b.transpose()).unwrap())
            .energy(wavy(h))
            .entropy(Wavy(s));
        agrees(&system.clone().build().unwrap(), &x, &u)?;
        let with_casimir = system.clone().casimir(wavy(c)).build().unwrap();
        let with_momentum = system.clone().momentum(Wavy(j)).build().unwrap();
        let with_both = system.casimir(wavy(c)).momentum(Wavy(j)).build().unwrap();
        let centre = metriplectic::fields::ChartPoint::centre(&(x + u * 0.5));
        let fractions = independence(&with_both, &centre);
        prop_assume!(fractions.iter().all(|fraction| *fraction > 0.3));
        agrees(&with_casimir, &x, &u)?;
        agrees(&with_momentum, &x, &u)?;
        agrees(&with_both, &x, &u)?;
        gradients_agree(&with_both, &x, &u)?;
    }

    /// Where invariants are nearly dependent, the weights of the projections have derivatives too.
    #[test]
    fn where_invariants_fade_out(
        h in coefficients::<4>(), s in coefficients::<4>(), c in coefficients::<4>(),
        waves in prop::array::uniform4(-0.3..0.3), digits in 3.0..5.0_f64,
        skew in prop::array::uniform::<_, 4>(columns::<4>(1.0)),
        x in columns::<4>(1.0), u in displacements::<4>(),
    ) {
        let b = SMatrix::<f64, 4, 4>::from_columns(&skew);
        let near = |by: f64| move |x: &SVector<Real, 4>| wavy(s)(x) + wavy(c)(x) * by;
        let metric = move |x: &SVector<Real, 4>| {
            let wave = SVector::<Real, 4>::from_fn(|i, _| x[(i + 1) % 4].sin() * waves[i]);
            SMatrix::<Real, 4, 4>::identity() + wave * wave.transpose()
        };
        let system = System::on(Euclidean::<4>)
            .bracket(Poisson::constant(b - b.transpose()).unwrap())
            .energy(wavy(h))
            .entropy(Wavy(s));
        let fading = 10.0_f64.powf(-digits);
        let casimir = system.clone().casimir(near(fading)).build().unwrap();
        let momentum = system.clone().momentum(near(0.01 * fading)).build().unwrap();
        let curved = system.metric(Metric::field(metric)).casimir(near(fading)).build().unwrap();
        let centre = metriplectic::fields::ChartPoint::centre(&(x + u * 0.5));
        let fraction = projected_fractions(&casimir, &centre)[0];
        prop_assume!(fraction > 1e-5);
        // A direction is off by ε/σ, and its derivatives by another 1/σ, which is in their size.
        let digits = 10.0 / fraction;
        agrees_with((WEYL, Gonzalez, digits), &casimir, &x, &u)?;
        agrees_with((WEYL, Gonzalez, digits), &curved, &x, &u)?;
        agrees_with((WEYL, Gonzalez, 100.0 * digits), &momentum, &x, &u)?;
    }

    #[test]
    fn with_an_exact_second_law_and_a_metric_that_varies(
        h in coefficients::<3>(), s in coefficients::<3>(), j in coefficients::<3>(),
        c in prop::array::uniform3(-0.3..0.3),
        x in columns::<3>(0.5), u in displacements::<3>(),
    ) {
        let metric = move |q: &Vector3<Real>| {
            let wave = Vector3::new(q.y.sin() * c[0], q.z.cos() * c[1], q.x * c[2]);
            Matrix3::from_diagonal_element(Real::from(1.0)) + wave * wave.transpose()
        };
        let system = System::on(LieDual::so3())
            .metric(Metric::field(metric))
            .energy(wavy(h))
            .entropy(Wavy(s))
            .momentum(wavy(j))
            .build()
            .unwrap();
        let centre = metriplectic::fields::ChartPoint::centre(&(x + u * 0.5));
        prop_assume!(independence(&system, &centre)[0] > 0.3);
        agrees(&system, &x, &u)?;
    }

    /// A force, alone, with an exact second law, beside friction, and with invariants that it changes: the
    /// Jacobian does not ask.
    #[test]
    fn with_a_force(
        h in coefficients::<3>(), s in coefficients::<3>(), j in coefficients::<3>(),
        g in metrics::<3>(), c in prop::array::uniform3(-0.3..0.3),
        f in prop::array::uniform3(coefficients::<3>()),
        x in columns::<3>(1.0), u in displacements::<3>(),
    ) {
        let force = move |xi: &Vector3<Real>| Vector3::from_fn(|i, _| waves(&f[i], xi));
        let body = System::on(LieDual::so3()).metric(Metric::constant(g).unwrap()).energy(wavy(h));
        agrees(&body.clone().force(force).build().unwrap(), &x, &u)?;
        agrees(&body.clone().force(Waves(f)).build().unwrap(), &x, &u)?;
        let exact = body.entropy(Wavy(s)).force(force);
        agrees(&exact.clone().build().unwrap(), &x, &u)?;
        let published = exact.second_law(SecondLaw::Published);
        gradients_agree(&published.clone().build().unwrap(), &x, &u)?;
        agrees(&published.dissipation(MetricDissipation).build().unwrap(), &x, &u)?;
        // A metric that varies, and a momentum beside the energy.
        let metric = move |q: &Vector3<Real>| {
            let wave = Vector3::new(q.y.sin() * c[0], q.z.cos() * c[1], q.x * c[2]);
            Matrix3::from_diagonal_element(Real::from(1.0)) + wave * wave.transpose()
        };
        let varies = System::on(LieDual::so3())
            .metric(Metric::field(metric))
            .energy(wavy(h))
            .force(force)
            .momentum(wavy(j))
            .build()
            .unwrap();
        let x = x * 0.5;
        let centre = metriplectic::fields::ChartPoint::centre(&(x + u * 0.5));
        prop_assume!(independence(&varies, &centre)[0] > 0.3);
        agrees(&varies, &x, &u)?;
    }

    #[test]
    fn with_a_force_on_se3_and_on_a_product(
        h in coefficients::<6>(), s in coefficients::<6>(), c in coefficients::<6>(),
        j in coefficients::<6>(), f in coefficients::<6>(), x in columns::<6>(1.0), u in displacements::<6>(),
    ) {
        let force = move |xi: &Vector6<Real>| {
            let k = waves(&f, xi);
            Vector6::from_fn(|i, _| xi[(i + 1) % 6].sin() * f[0][i] + k * f[1][i])
        };
        let system = System::on(LieDual::se3()).energy(Wavy(h)).force(force).entropy(wavy(s));
        agrees(&system.clone().build().unwrap(), &x, &u)?;
        let with_casimir = system.clone().casimir(wavy(c)).build().unwrap();
        let with_both = system.casimir(wavy(c)).momentum(wavy(j)).build().unwrap();
        let centre = metriplectic::fields::ChartPoint::centre(&(x + u * 0.5));
        let fractions = independence(&with_both, &centre);
        prop_assume!(fractions.iter().all(|fraction| *fraction > 0.3));
        agrees(&with_casimir, &x, &u)?;
        agrees(&with_both, &x, &u)?;
        let pair = System::on(Product(LieDual::so3(), LieDual::sl2()))
            .bracket((ForcedLiePoisson(move |xi: &Vector3<Real>| xi.map(|xi| (xi * f[2][0]).sin())), LiePoisson))
            .energy(move |x: &(Vector3<Real>, Vector3<Real>)| {
                waves(&h, &Vector6::from_fn(|i, _| if i < 3 { x.0[i] } else { x.1[i - 3] }))
            })
            .build()
            .unwrap();
        agrees(&pair, &(x.fixed_rows::<3>(0).into_owned(), x.fixed_rows::<3>(3).into_owned()), &u)?;
    }

    #[test]
    fn with_a_bracket_from_a_closure(
        h in coefficients::<3>(), c in prop::array::uniform3(-1.0..1.0),
        x in columns::<3>(1.0), u in displacements::<3>(),
    ) {
        // Π = hat(∇C) with C = Σ c_i x_i³/3 is a Poisson tensor for every c.
        let tensor = move |x: &Vector3<Real>| {
            let d = Vector3::from_fn(|i, _| x[i] * x[i] * c[i]);
            d.cross_matrix()
        };
        let system = System::on(Euclidean::<3>)
            .bracket(Poisson::field(tensor))
            .energy(wavy(h))
            .entropy(move |x: &Vector3<Real>| (0..3).map(|i| x[i].powi(3) * (c[i] / 3.0)).sum())
            .build()
            .unwrap();
        agrees(&system, &x, &u)?;
    }

    #[test]
    fn on_the_sphere_and_the_rotation_group(
        seed in any::<u64>(), h in coefficients::<3>(), s in coefficients::<3>(),
        u in displacements::<2>(), v in displacements::<3>(),
    ) {
        use rand::SeedableRng;
        let mut rng = rand::rngs::ChaCha8Rng::seed_from_u64(seed);
        let sphere = System::on(Sphere::<2>::round())
            .bracket(AreaForm)
            .energy(wavy(h))
            .entropy(wavy(s))
            .second_law(SecondLaw::Published)
            .build()
            .unwrap();
        agrees(&sphere, &Sphere::<2>::round().random(&mut rng), &u)?;
        let group = System::on(Rotations::bi_invariant())
            .bracket(Nambu::default())
            .energy(move |r: &Matrix3<Real>| wavy(h)(&r.column(0).into_owned()))
            .entropy(move |r: &Matrix3<Real>| wavy(s)(&r.column(2).into_owned()))
            .build()
            .unwrap();
        agrees(&group, &Rotations.random(&mut rng), &v)?;
    }
}
