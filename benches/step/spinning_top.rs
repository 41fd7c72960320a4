//! The spinning top on S² (Celledoni, Eidnes, Owren, Ringholm 2019, example 1).

use std::cell::Cell;
use std::rc::Rc;

use metriplectic::nalgebra::Matrix3x2;
use metriplectic::prelude::*;

use crate::stable_gradient::{self, Displacements, Linearised};
use crate::{Row, Step, check};

const D: Vector3<f64> = Vector3::new(1.0, 0.5, 0.25);
const STEP_SIZE: f64 = 0.1;

/// `H = ½ Σ D_i (x_i² + ⅔ x_i³)` at any scalar.
struct Energy;

impl ScalarField<Sphere<2>> for Energy {
    fn at<T: Scalar>(&self, x: &SVector<T, 3>) -> T {
        let term = |i: usize| x[i] * x[i] * (x[i] * (2.0 / 3.0) + 1.0) * (0.5 * D[i]);
        term(0) + term(1) + term(2)
    }
}

pub(crate) fn rows() -> Vec<Row> {
    const WELL: &str = "the top is a Hamiltonian system";
    let top = || {
        System::on(Sphere::<2>::round()).bracket(AreaForm).energy(|x: &Vector3<Real>| {
            (0..3).map(|i| (x[i].powi(2) + x[i].powi(3) * (2.0 / 3.0)) * (0.5 * D[i])).sum()
        })
    };
    let typed = System::on(Sphere::<2>::round()).bracket(AreaForm).energy(Energy);
    let (start, h) = (Vector3::repeat(3.0_f64.sqrt().recip()), STEP_SIZE);
    let hand = HandCoded { displacements: Displacements::new(), iterations: 0 };
    let mut rows = vec![
        Row::new("step/spinning_top/closure", top().build().expect(WELL), start, h),
        Row::new("step/spinning_top/typed", typed.build().expect(WELL), start, h),
        Row::by_hand("step/spinning_top/hand_coded", hand, start, h),
    ];
    check(&rows, 1e-12);

    let evaluations = Rc::new(Cell::new(0));
    let count = Rc::clone(&evaluations);
    let ambient = move |_: &Vector3<Real>| {
        count.set(count.get() + 1);
        Matrix3::<Real>::identity()
    };
    let numerical = || {
        let metric = Metric::field(ambient.clone());
        top().metric(metric).build().expect("the same system")
    };
    rows.push(Row::new("step/spinning_top/closure_metric", numerical(), start, h).counted(
        &evaluations,
        numerical(),
        start,
        h,
    ));
    check(&rows, 1e-10);
    rows
}

/// `H = ½ Σ D_i (x_i² + ⅔ x_i³)`
fn energy(x: &Vector3<f64>) -> f64 {
    let squares = x.component_mul(x);
    D.dot(&(squares * 0.5 + squares.component_mul(x) * (1.0 / 3.0)))
}

fn gradient(x: &Vector3<f64>) -> Vector3<f64> {
    D.component_mul(&(x + x.component_mul(x)))
}

/// By hand in ambient coordinates: `d = h z × w`, `w = ∇H(z) + c d`, on the great circle that leaves
/// `x` with `U = E u`, where `E` is a basis of the tangent plane.
#[derive(Clone)]
struct HandCoded {
    displacements: Displacements<3>,
    iterations: usize,
}

/// The middle, the displacement and the end of a path, with `cos θ/2` and `sin(θ/2)/θ`.
struct StepPath {
    tangent: Vector3<f64>,
    z: Vector3<f64>,
    d: Vector3<f64>,
    end: Vector3<f64>,
    s: f64,
    cosine: f64,
    sine: f64,
}

impl StepPath {
    /// `z = cos(θ/2) x + sin(θ/2)/θ U`, `d = cos(θ/2) U − θ sin(θ/2) x`, `x' = cos θ x + sin θ/θ U`.
    fn new(x: &Vector3<f64>, e: &Matrix3x2<f64>, u: &Vector2<f64>) -> Self {
        let (tangent, s) = (e * u, u.norm_squared());
        let theta = s.sqrt();
        let (sine, cosine) = (0.5 * theta).sin_cos();
        let sine = if theta > 0.0 { sine / theta } else { 0.5 };
        let z = x * cosine + tangent * sine;
        let d = tangent * cosine - x * (s * sine);
        let end = x * (1.0 - 2.0 * s * sine * sine) + tangent * (2.0 * cosine * sine);
        Self { tangent, z, d, end, s, cosine, sine }
    }

    /// The factor `c` of the discrete gradient.
    fn correction(&self, dh: &Vector3<f64>, difference: f64) -> f64 {
        if self.s > 0.0 { (difference - dh.dot(&self.d)) / self.s } else { 0.0 }
    }
}

/// The residual in the basis at `x`; it is tangent at `z`, so it vanishes with its components.
struct Equation {
    x: Vector3<f64>,
    e: Matrix3x2<f64>,
    h: f64,
    energy: f64,
}

impl Equation {
    fn residual(&self, u: &Vector2<f64>) -> Vector2<f64> {
        let path = StepPath::new(&self.x, &self.e, u);
        let dh = gradient(&path.z);
        let w = dh + path.d * path.correction(&dh, energy(&path.end) - self.energy);
        self.e.tr_mul(&(path.d - path.z.cross(&w) * self.h))
    }

    fn linearise(&self, u: &Vector2<f64>) -> Linearised<2> {
        let Self { x, e, h, .. } = self;
        let path = StepPath::new(x, e, u);
        let StepPath { tangent, z, d, s, cosine, sine, .. } = &path;
        let (dh, end) = (gradient(z), energy(&path.end));
        let c = path.correction(&dh, end - self.energy);
        let (w, dh_end) = (dh + d * c, gradient(&path.end));
        let velocity = z.cross(&w);
        let hessian = D.component_mul(&(z * 2.0).add_scalar(1.0));
        // d(sin(θ/2)/θ)/du = u · bend
        let bend = if *s > 1e-8 { (0.5 * cosine - sine) / s } else { -1.0 / 24.0 };
        let column = |k: usize| {
            let (u, e) = (u[k], e.column(k));
            let dz = tangent * (u * bend) - x * (0.5 * sine * u) + e * *sine;
            let dd = e * *cosine - tangent * (0.5 * sine * u) - x * (u * (2.0 * sine + s * bend));
            let dend = e * (2.0 * cosine * sine)
                + tangent * (u * (2.0 * cosine * bend - sine * sine))
                - x * (4.0 * u * sine * (sine + s * bend));
            let turn = hessian.component_mul(&dz);
            let change = dh_end.dot(&dend) - turn.dot(d) - dh.dot(&dd) - 2.0 * c * u;
            let dw = turn + dd * c + d * (change / s.max(f64::MIN_POSITIVE));
            self.e.tr_mul(&(dd - (dz.cross(&w) + z.cross(&dw)) * *h))
        };
        let jacobian = Matrix2::from_columns(&[column(0), column(1)]);
        let (length, pi) = (s.sqrt(), 2.0_f64.sqrt());
        let noise = f64::EPSILON * (self.energy.abs() + end.abs() + dh.norm()) / length;
        let floor = f64::EPSILON * (4.0 * h * pi * velocity.norm() + length) + h * pi * noise;
        let inverse = jacobian.try_inverse().unwrap_or_else(Matrix2::identity);
        Linearised { residual: self.e.tr_mul(&(d - velocity * *h)), inverse, floor }
    }
}

/// Two columns of the reflection that takes the last axis to `∓x`.
fn frame(x: &Vector3<f64>) -> Matrix3x2<f64> {
    let (sign, k) = (1.0_f64.copysign(x.z), (1.0 + x.z.abs()).recip());
    let mixed = -x.x * x.y * k;
    Matrix3x2::new(1.0 - x.x * x.x * k, mixed, mixed, 1.0 - x.y * x.y * k, -sign * x.x, -sign * x.y)
}

impl Step for HandCoded {
    type Point = Vector3<f64>;

    fn step(&mut self, x: &Vector3<f64>, h: f64) -> Vector3<f64> {
        let equation = Equation { x: *x, e: frame(x), h, energy: energy(x) };
        let guess = self.displacements.extrapolate();
        let guess = equation.e.tr_mul(&guess.unwrap_or_else(|| x.cross(&gradient(x)) * h));
        let here = equation.linearise(&guess);
        let (u, iterations) = stable_gradient::solve(guess, &here, |u| equation.residual(u));
        self.iterations += iterations;
        let path = StepPath::new(x, &equation.e, &u);
        self.displacements.note(path.tangent);
        path.end.normalize()
    }

    fn iterations(&self) -> usize {
        self.iterations
    }

    fn entries(x: &Vector3<f64>) -> Vec<f64> {
        x.as_slice().to_vec()
    }
}
