//! Relaxation on SO(3) with the Nambu bracket, for fields that are quadratic in the entries of `R`.

use std::cell::Cell;
use std::rc::Rc;

use metriplectic::manifolds::rotations;
use metriplectic::prelude::*;

use crate::stable_gradient::{self, Displacements, Linearised};
use crate::{Row, Step, check};

const STEP_SIZE: f64 = 0.005;

/// The fields of [`rows`] at any scalar.
struct Energy;
struct Entropy;

impl ScalarField<Rotations> for Energy {
    fn at<D: Scalar>(&self, r: &SMatrix<D, 3, 3>) -> D {
        r.m11 + r.m22 * 2.0 + r.m33 * 3.0 + r.m12 * r.m23 * 0.5
    }
}

impl ScalarField<Rotations> for Entropy {
    fn at<D: Scalar>(&self, r: &SMatrix<D, 3, 3>) -> D {
        let tilt = r.m31 + r.m32;
        r.m13 - r.m21 * 0.5 + tilt * tilt * 0.25
    }
}

pub(crate) fn rows() -> Vec<Row> {
    const WELL: &str = "energy, entropy and metric are a system on SO(3)";
    let frame = || {
        System::on(Rotations::bi_invariant())
            .bracket(Nambu::default())
            .energy(|r: &Matrix3<Real>| r.m11 + r.m22 * 2.0 + r.m33 * 3.0 + r.m12 * r.m23 * 0.5)
            .entropy(|r: &Matrix3<Real>| r.m13 - r.m21 * 0.5 + (r.m31 + r.m32).powi(2) * 0.25)
            // The step by hand is that of the published scheme.
            .second_law(SecondLaw::Published)
    };
    let typed = System::on(Rotations::bi_invariant())
        .bracket(Nambu::default())
        .energy(Energy)
        .entropy(Entropy)
        .second_law(SecondLaw::Published);
    let (start, h) = (rotations::exp(&Vector3::new(0.3, -0.2, 0.5)), STEP_SIZE);
    let hand = HandCoded { displacements: Displacements::new(), iterations: 0 };
    let mut rows = vec![
        Row::new("step/so3_nambu/closure", frame().build().expect(WELL), start, h),
        Row::new("step/so3_nambu/typed", typed.build().expect(WELL), start, h),
        Row::by_hand("step/so3_nambu/hand_coded", hand, start, h),
    ];
    check(&rows, 1e-12);

    let evaluations = Rc::new(Cell::new(0));
    let count = Rc::clone(&evaluations);
    let body = move |_: &Matrix3<Real>| {
        count.set(count.get() + 1);
        Matrix3::<Real>::identity()
    };
    let numerical = || {
        let metric = Metric::field(body.clone());
        frame().metric(metric).build().expect("the same system")
    };
    rows.push(Row::new("step/so3_nambu/closure_metric", numerical(), start, h).counted(
        &evaluations,
        numerical(),
        start,
        h,
    ));
    check(&rows, 1e-10);

    let exact = frame().second_law(SecondLaw::Exact).build().expect(WELL);
    rows.push(Row::new("step/so3_nambu/exact", exact, start, h));
    rows
}

/// By hand in the body frame: `u = h (s × w + |w|² s − (w·s) w)` with `w = dH(z) + c u`, `s = dS(z)`,
/// `z = R exp(û/2)` and `x' = R exp(û)`.
#[derive(Clone)]
struct HandCoded {
    displacements: Displacements<3>,
    iterations: usize,
}

/// `H = R₁₁ + 2R₂₂ + 3R₃₃ + ½R₁₂R₂₃`
fn energy(r: &Matrix3<f64>) -> f64 {
    r.m11 + 2.0 * r.m22 + 3.0 * r.m33 + 0.5 * r.m12 * r.m23
}

/// `Rᵀ ∂H/∂R`
fn energy_slope(r: &Matrix3<f64>) -> Matrix3<f64> {
    r.tr_mul(&Matrix3::new(1.0, 0.5 * r.m23, 0.0, 0.0, 2.0, 0.5 * r.m12, 0.0, 0.0, 3.0))
}

/// `Rᵀ ∂S/∂R` of `S = R₁₃ − ½R₂₁ + ¼(R₃₁ + R₃₂)²`
fn entropy_slope(r: &Matrix3<f64>) -> Matrix3<f64> {
    let t = 0.5 * (r.m31 + r.m32);
    r.tr_mul(&Matrix3::new(0.0, 0.0, 1.0, -0.5, 0.0, 0.0, t, t, 0.0))
}

/// The differential in the body frame, twice the skew part of `A = Rᵀ ∂f/∂R`.
fn differential(a: &Matrix3<f64>) -> Vector3<f64> {
    Vector3::new(a.m32 - a.m23, a.m13 - a.m31, a.m21 - a.m12)
}

/// The derivative of the differential along the body frame, `A − tr A`, without the second
/// derivatives of `f`.
fn turned(a: &Matrix3<f64>) -> Matrix3<f64> {
    a - Matrix3::from_diagonal_element(a.trace())
}

fn hat(a: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0)
}

/// `exp(q̂)` and its left-trivialised derivative.
fn exp(q: &Vector3<f64>) -> (Matrix3<f64>, Matrix3<f64>) {
    let (s, a) = (q.norm_squared(), hat(q));
    let (theta, square) = (s.sqrt(), a * a);
    let (c1, c2, c3) = if s > 1e-8 {
        let (sine, cosine) = (0.5 * theta).sin_cos();
        let c1 = 2.0 * sine * cosine / theta;
        (c1, 2.0 * sine * sine / s, (1.0 - c1) / s)
    } else {
        (1.0 - s / 6.0, 0.5, 1.0 / 6.0)
    };
    let one = Matrix3::identity();
    (one + a * c1 + square * c2, one - a * c2 + square * c3)
}

/// `s × w + |w|² s − (w·s) w`
fn velocity(s: &Vector3<f64>, w: &Vector3<f64>) -> Vector3<f64> {
    s.cross(w) + s * w.norm_squared() - w * w.dot(s)
}

struct Equation {
    x: Matrix3<f64>,
    h: f64,
    energy: f64,
}

impl Equation {
    fn residual(&self, u: &Vector3<f64>) -> Vector3<f64> {
        let (half, _) = exp(&(u * 0.5));
        let z = self.x * half;
        let (dh, end) = (differential(&energy_slope(&z)), energy(&(z * half)));
        let w = dh + u * ((end - self.energy - dh.dot(u)) / u.norm_squared());
        u - velocity(&differential(&entropy_slope(&z)), &w) * self.h
    }

    fn linearise(&self, u: &Vector3<f64>) -> Linearised<3> {
        let (half, dhalf) = exp(&(u * 0.5));
        let z = self.x * half;
        let end = z * half;
        let (energy_slope_z, entropy_slope_z) = (energy_slope(&z), entropy_slope(&z));
        let (dh, s) = (differential(&energy_slope_z), differential(&entropy_slope_z));
        let square = u.norm_squared();
        let value = energy(&end);
        let c = (value - self.energy - dh.dot(u)) / square;
        let w = dh + u * c;

        // The entries R₁₂ and R₂₃ turn by e₂ × R₁ and e₃ × R₂, and R₃₁ + R₃₂ by (e₁ + e₂) × R₃.
        let [r1, r2, r3] = [0, 1, 2].map(|i| z.row(i).transpose());
        let (p, q) = (Vector3::y().cross(&r1), Vector3::z().cross(&r2));
        let t = Vector3::new(1.0, 1.0, 0.0).cross(&r3);
        let dz = dhalf * 0.5;
        let ddh = (turned(&energy_slope_z) + (p * q.transpose() + q * p.transpose()) * 0.5) * dz;
        let ds = (turned(&entropy_slope_z) + t * t.transpose() * 0.5) * dz;
        let (_, dend) = exp(u);
        let rows =
            dend.tr_mul(&differential(&energy_slope(&end))) - ddh.tr_mul(u) - dh - u * (2.0 * c);
        let dw = ddh + Matrix3::from_diagonal_element(c) + u * (rows / square).transpose();

        let (ww, ws) = (w.norm_squared(), w.dot(&s));
        let k = Matrix3::from_diagonal_element(ww) - w * w.transpose();
        let along_w =
            s * w.transpose() * 2.0 - w * s.transpose() - Matrix3::from_diagonal_element(ws);
        let slope = (hat(&s) + along_w) * dw + (k - hat(&w)) * ds;
        let jacobian = Matrix3::identity() - slope * self.h;

        let (length, pi) = (square.sqrt(), 2.0_f64.sqrt() * s.norm());
        let terms = pi * w.norm() + k.norm() * s.norm();
        let noise = f64::EPSILON * (self.energy.abs() + value.abs() + dh.norm()) / length;
        let floor =
            f64::EPSILON * (4.0 * self.h * terms + length) + self.h * (pi + along_w.norm()) * noise;
        let inverse = jacobian.try_inverse().unwrap_or_else(Matrix3::identity);
        Linearised { residual: u - velocity(&s, &w) * self.h, inverse, floor }
    }
}

impl Step for HandCoded {
    type Point = Matrix3<f64>;

    fn step(&mut self, x: &Matrix3<f64>, h: f64) -> Matrix3<f64> {
        let equation = Equation { x: *x, h, energy: energy(x) };
        let guess = self.displacements.extrapolate().unwrap_or_else(|| {
            velocity(&differential(&entropy_slope(x)), &differential(&energy_slope(x))) * h
        });
        let here = equation.linearise(&guess);
        let (u, iterations) = stable_gradient::solve(guess, &here, |u| equation.residual(u));
        self.iterations += iterations;
        self.displacements.note(u);
        let (turn, _) = exp(&u);
        let end = x * turn;
        // One step of the polar iteration keeps the matrix orthogonal.
        end * (Matrix3::from_diagonal_element(1.5) - end.tr_mul(&end) * 0.5)
    }

    fn iterations(&self) -> usize {
        self.iterations
    }

    fn entries(x: &Matrix3<f64>) -> Vec<f64> {
        x.transpose().as_slice().to_vec()
    }
}
