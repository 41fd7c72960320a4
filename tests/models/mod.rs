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
