//! The models that several tests run.
#![allow(dead_code, reason = "each test file uses some of the models")]

use metriplectic::dynamics::NaturalBracket;
use metriplectic::fields::{ChartPoint, Scalar, Space};
use metriplectic::manifolds::rand::Rng;
use metriplectic::nalgebra::Const;
use metriplectic::prelude::*;

/// Kinetic energy of a body with principal moments `inertia`, in angular momenta.
pub(crate) fn kinetic(inertia: Vector3<f64>) -> impl Fn(&Vector3<Real>) -> Real + Clone {
    move |p| p.component_mul(p).component_div(&inertia.cast()).sum() * 0.5
}

/// `S = |p|²/2`.
pub(crate) fn half_square(p: &Vector3<Real>) -> Real {
    p.norm_squared() * 0.5
}

/// The relaxing rigid body of the paper.
pub(crate) fn relaxing_body() -> impl Metriplectic<Manifold = LieDual<3>, Metric = Canonical> {
    System::on(LieDual::so3())
        .energy(kinetic(vector![10.0, 5.0, 1.0]))
        .entropy(half_square)
        .build()
        .expect("the relaxing rigid body is a system")
}

/// Where it starts, 10⁻³ from the unstable axis.
pub(crate) const UNSTABLE: Vector3<f64> = Vector3::new(0.001, -1.0, 0.001);

/// A free rigid body, which never rests.
pub(crate) fn free_body() -> impl Metriplectic<Manifold = LieDual<3>, Metric = Canonical> {
    System::on(LieDual::so3())
        .energy(kinetic(vector![1.0, 2.0, 3.0]))
        .build()
        .expect("the free rigid body is a system")
}

/// Where it starts.
pub(crate) const TUMBLING: Vector3<f64> = Vector3::new(1.0, 0.3, 0.8);

/// The energy of the spinning top of Celledoni, Eidnes, Owren, Ringholm (2019), example 1.
pub(crate) fn top(x: &Vector3<Real>) -> Real {
    let weights = [1.0, 0.5, 0.25];
    (0..3).map(|i| (x[i].powi(2) + x[i].powi(3) * (2.0 / 3.0)) * (0.5 * weights[i])).sum()
}

/// Two gas containers with a moving wall that leaks heat at the rate `alpha` (Shang and Öttinger 2020), as
/// `(q, p, U₁, U₂)`.
pub(crate) fn gas(alpha: f64) -> impl Metriplectic<Manifold = Euclidean<4>, Metric = Canonical> {
    let wall = |x: &Vector4<Real>| {
        let [left, right] = [x.z / x.x, x.w / (-x.x + 2.0)].map(|d| d * (2.0 / 3.0));
        let (o, one) = (Real::from(0.0), Real::from(1.0));
        Matrix4::new(o, one, o, o, -one, o, left, -right, o, -left, o, o, o, right, o, o)
    };
    let leak = move |_: &Vector4<Real>, w: &Vector4<Real>| {
        let o = Real::from(0.0);
        let (one, both, two) = (w.w * w.w * alpha, w.z * w.w * -alpha, w.z * w.z * alpha);
        Matrix4::new(o, o, o, o, o, o, o, o, o, o, one, both, o, o, both, two)
    };
    System::on(Euclidean::<4>)
        .bracket(Poisson::field(wall))
        .dissipation(FieldDissipation(leak))
        .energy(|x: &Vector4<Real>| x.y * x.y * 0.5 + x.z + x.w)
        .entropy(|x: &Vector4<Real>| (x.x * (-x.x + 2.0)).ln() + (x.z * x.w).ln() * 1.5)
        .build()
        .expect("the gas containers are a system")
}

pub(crate) type State6 = SVector<Real, 6>;

fn split(x: &State6) -> (Vector3<Real>, Vector3<Real>) {
    (x.fixed_rows::<3>(0).into_owned(), x.fixed_rows::<3>(3).into_owned())
}

/// Heavy top on se(3)*: `H = ½ M·I⁻¹M + Γ·χ`.
pub(crate) fn heavy(x: &State6) -> Real {
    let (m, gamma) = split(x);
    kinetic(vector![1.0, 1.5, 2.0])(&m) + gamma.x * 0.2 + gamma.z * 0.7
}

pub(crate) fn gamma_squared(x: &State6) -> Real {
    split(x).1.norm_squared()
}

pub(crate) fn alignment(x: &State6) -> Real {
    let (m, gamma) = split(x);
    m.dot(&gamma)
}

pub(crate) const HEAVY: [f64; 6] = [0.4, -0.7, 0.9, 0.3, 0.5, 0.8];

/// The thermoelastic double pendulum (Romero 2009), all constants 1, as `(q₁, q₂, p₁, p₂, s₁, s₂)`.
pub(crate) type State10 = SVector<Real, 10>;

pub(crate) fn pair(x: &State10, i: usize) -> Vector2<Real> {
    Vector2::new(x[i], x[i + 1])
}

fn stored(length: Real, s: Real) -> Real {
    let stretch = length.ln();
    stretch.powi(2) * 0.5 + stretch + (s - stretch).exp() - 1.0
}

pub(crate) fn pendulum_energy(x: &State10) -> Real {
    let lengths =
        [pair(x, 0).norm_squared().sqrt(), (pair(x, 2) - pair(x, 0)).norm_squared().sqrt()];
    (pair(x, 4).norm_squared() + pair(x, 6).norm_squared()) * 0.5
        + stored(lengths[0], x[8])
        + stored(lengths[1], x[9])
}

pub(crate) fn angular_momentum(x: &State10) -> Real {
    x[0] * x[5] - x[1] * x[4] + x[2] * x[7] - x[3] * x[6]
}

pub(crate) fn pendulum_bracket() -> SMatrix<f64, 10, 10> {
    let mut pi = SMatrix::zeros();
    for i in 0..4 {
        (pi[(i, i + 4)], pi[(i + 4, i)]) = (1.0, -1.0);
    }
    pi
}

pub(crate) fn heat_exchange(_: &State10, w: &State10) -> SMatrix<Real, 10, 10> {
    // Temperatures are θᵢ = w_{sᵢ}; K = b bᵀ/(θ₁θ₂) with b = (θ₂, −θ₁) on the entropies.
    let mut b = State10::zeros();
    (b[8], b[9]) = (w[9], -w[8]);
    b * b.transpose() * (w[8] * w[9]).recip()
}

pub(crate) const PENDULUM: [f64; 10] = [1.0, 0.0, 2.2, 0.0, 0.0, 2.0, 1.0, 0.0, 1.0, 0.2];

/// A manifold that a user wrote: the spheroid `x = D n`, `|n| = 1`, with `D = diag(1, 1, 0.7)`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Globe;

const AXES: Vector3<f64> = Vector3::new(1.0, 1.0, 0.7);

fn shrink<D: Scalar>(x: &Vector3<D>) -> Vector3<D> {
    x.component_div(&AXES.map(D::from))
}

impl Globe {
    /// The point over a unit vector.
    pub(crate) fn point<D: Scalar>(n: Vector3<D>) -> Vector3<D> {
        n.component_mul(&AXES.map(D::from))
    }
}

impl Space for Globe {
    type Dim = Const<2>;
    type Velocity = Const<3>;
    type Point<D: Scalar> = Vector3<D>;

    fn constant<D: Scalar>(x: &Vector3<f64>) -> Vector3<D> {
        x.map(D::from)
    }

    fn real<D: Scalar>(x: &Vector3<D>) -> Vector3<f64> {
        x.map(|entry| entry.re())
    }

    fn chart<D: Scalar>(x: &Vector3<f64>, q: &Vector2<D>) -> Vector3<D> {
        Self::point(Sphere::<2>::chart(&shrink(x), q))
    }

    fn coordinates<D: Scalar>(x: &Vector3<f64>, y: &Vector3<D>) -> Vector2<D> {
        Sphere::<2>::coordinates(&shrink(x), &shrink(y))
    }

    fn embed<D: Scalar>(at: &ChartPoint<Self, D>, v: &Vector2<D>) -> Vector3<D> {
        let around = ChartPoint { base: shrink(&at.base), q: at.q };
        Self::point(Sphere::<2>::embed(&around, v))
    }

    fn is_near(q: &Vector2<f64>) -> bool {
        Sphere::<2>::is_near(q)
    }
}

impl Manifold for Globe {
    fn defect(&self, x: &Vector3<f64>) -> f64 {
        (shrink(x).norm() - 1.0).abs()
    }

    fn entries(x: &Vector3<f64>) -> Vec<f64> {
        x.iter().copied().collect()
    }

    fn assemble(next: &mut impl FnMut() -> f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| next())
    }

    fn magnitude(x: &Vector3<f64>) -> f64 {
        x.norm()
    }

    fn project(&self, x: &Vector3<f64>) -> Vector3<f64> {
        Self::point(shrink(x).normalize())
    }

    fn random(&self, rng: &mut impl Rng) -> Vector3<f64> {
        Self::point(Sphere::<2>::round().random(rng))
    }
}

impl NaturalBracket for Globe {
    type Bracket = AreaForm;

    fn natural_bracket(&self) -> AreaForm {
        AreaForm
    }
}

/// A spring in the plane that is not linear, `x = (q, p)`, with its angular momentum.
pub(crate) fn spring() -> impl Metriplectic<Manifold = Euclidean<4>, Metric = Canonical> {
    spring_with(|r| r * 0.5 + r.powi(2) * 0.25)
}

/// The same with a potential of `r = |q|²`.
pub(crate) fn spring_with(
    potential: fn(Real) -> Real,
) -> impl Metriplectic<Manifold = Euclidean<4>, Metric = Canonical> {
    let canonical = Matrix4::from_fn(|i, j| f64::from(j == i + 2) - f64::from(i == j + 2));
    System::on(Euclidean::<4>)
        .bracket(Poisson::constant(canonical).expect("it is skew"))
        .energy(move |x: &Vector4<Real>| {
            (x.z.powi(2) + x.w.powi(2)) * 0.5 + potential(x.x.powi(2) + x.y.powi(2))
        })
        .momentum(|x: &Vector4<Real>| x.x * x.w - x.y * x.z)
        .build()
        .expect("the spring is a system")
}

/// A level set of `H = z` and `C = z + y² − x³` with a cusp, into which the entropy `−x` drives the state. There
/// `dC` and `dH` are parallel, and the level set ends.
pub(crate) fn cusp() -> impl Metriplectic<Manifold = Euclidean<3>, Metric = Canonical> {
    System::on(Euclidean::<3>)
        .energy(|x: &Vector3<Real>| x.z)
        .entropy(|x: &Vector3<Real>| -x.x)
        .casimir(|x: &Vector3<Real>| x.z + x.y.powi(2) - x.x.powi(3))
        .build()
        .expect("the cusp is a system")
}

/// Where it starts.
pub(crate) const BEFORE_THE_CUSP: Vector3<f64> = Vector3::new(0.25, 0.125, 0.0);

/// The slope of the errors that are above round-off, by least squares.
pub(crate) fn slope(steps: &[f64], errors: &[f64], round_off: f64) -> f64 {
    let points: Vec<(f64, f64)> = steps
        .iter()
        .zip(errors)
        .filter(|(_, error)| **error > round_off)
        .map(|(h, error)| (h.ln(), error.ln()))
        .collect();
    assert!(points.len() >= 3, "{errors:?} are round-off");
    let n = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
    let both: f64 = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    both / points.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>()
}

/// The distance of two points in the space around, by their entries.
pub(crate) fn distance<M: Manifold>(a: &M::Point<f64>, b: &M::Point<f64>) -> f64 {
    let both = M::entries(a).into_iter().zip(M::entries(b));
    both.map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// A function in a box: systems of one shape with boxed functions have one type, and are compiled once.
pub(crate) fn boxed<P: 'static, T>(
    f: impl Fn(&P) -> T + Send + Sync + 'static,
) -> Box<dyn Fn(&P) -> T + Send + Sync> {
    Box::new(f)
}
