//! The models that several tests run.
#![allow(dead_code, reason = "each test file uses some of the models")]

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
