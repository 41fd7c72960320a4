//! The relaxing rigid body on so(3)*, a hundred steps from a state in full motion.

use std::cell::Cell;
use std::rc::Rc;

use metriplectic::fields::{Jet1, Jet2};
use metriplectic::prelude::*;

use crate::{Row, Step, check};

const INERTIA: V = [10.0, 5.0, 1.0];
const START: V = [-0.6, -0.84, 0.15];
const STEP_SIZE: f64 = 0.1;

/// `½ Σ p_i²/I_i` at any scalar.
struct Energy(V);

impl ScalarField<LieDual<3>> for Energy {
    fn at<D: Scalar>(&self, p: &SVector<D, 3>) -> D {
        (p.x * p.x / self.0[0] + p.y * p.y / self.0[1] + p.z * p.z / self.0[2]) * 0.5
    }
}

/// `½|p|²` at any scalar.
struct Entropy;

impl ScalarField<LieDual<3>> for Entropy {
    fn at<D: Scalar>(&self, p: &SVector<D, 3>) -> D {
        p.dot(p) * 0.5
    }
}

/// The energy with its derivatives on paper.
struct Analytic(V);

impl ScalarField<LieDual<3>> for Analytic {
    fn at<D: Scalar>(&self, p: &SVector<D, 3>) -> D {
        Energy(self.0).at(p)
    }

    fn jet1(&self, p: &Vector3<f64>) -> Jet1<LieDual<3>> {
        let df = p.component_div(&Vector3::from(self.0));
        Jet1 { value: p.dot(&df) * 0.5, df }
    }

    fn jet2(&self, p: &Vector3<f64>) -> Jet2<LieDual<3>> {
        let Jet1 { value, df } = self.jet1(p);
        Jet2 { value, df, hf: Matrix3::from_diagonal(&Vector3::from(self.0.map(f64::recip))) }
    }
}

/// The entropy likewise.
struct AnalyticEntropy;

impl ScalarField<LieDual<3>> for AnalyticEntropy {
    fn at<D: Scalar>(&self, p: &SVector<D, 3>) -> D {
        Entropy.at(p)
    }

    fn jet1(&self, p: &Vector3<f64>) -> Jet1<LieDual<3>> {
        Jet1 { value: p.norm_squared() * 0.5, df: *p }
    }

    fn jet2(&self, p: &Vector3<f64>) -> Jet2<LieDual<3>> {
        Jet2 { value: p.norm_squared() * 0.5, df: *p, hf: Matrix3::identity() }
    }
}

pub(crate) fn rows() -> Vec<Row> {
    const WELL: &str = "the rigid body is a metriplectic system";
    let (start, h) = (Vector3::from(START), STEP_SIZE);
    let body = || {
        let inertia = Vector3::from(INERTIA);
        System::on(LieDual::so3())
            .energy(move |p: &Vector3<Real>| {
                p.component_mul(p).component_div(&inertia.cast()).sum() * 0.5
            })
            .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
    };
    let calls = Rc::new(Cell::new(0));
    let count = Rc::clone(&calls);
    let counting = System::on(LieDual::so3())
        .energy(move |p: &Vector3<Real>| {
            count.set(count.get() + 1);
            p.component_mul(p).component_div(&Vector3::from(INERTIA).cast()).sum() * 0.5
        })
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .build()
        .expect(WELL);
    let analytic = System::on(LieDual::so3()).energy(Analytic(INERTIA)).entropy(AnalyticEntropy);
    let typed = System::on(LieDual::so3()).energy(Energy(INERTIA)).entropy(Entropy);
    let published = body().second_law(SecondLaw::Published).build().expect(WELL);
    let [mean, itoh_abe] = [(); 2].map(|()| body().build().expect(WELL));
    let scheme = Scheme::new(WeylMidpoint);
    let rows = vec![
        Row::new("step/rigid_body/closure", body().build().expect(WELL), start, h)
            .counted(&calls, counting, start, h),
        Row::new("step/rigid_body/typed", typed.build().expect(WELL), start, h),
        Row::new("step/rigid_body/analytic", analytic.build().expect(WELL), start, h),
        Row::by_hand("step/rigid_body/hand_coded", HandCoded::new(&INERTIA), START, h),
        Row::new("step/rigid_body/published", published, start, h),
        Row::with("step/rigid_body/mean_value", scheme.gradient(MeanValue), mean, start, h),
        Row::with(
            "step/rigid_body/itoh_abe",
            scheme.gradient(SymmetricItohAbe),
            itoh_abe,
            start,
            h,
        ),
    ];
    // For quadratic fields on a flat space all of these are the midpoint rule.
    check(&rows, 1e-12);
    rows
}

/// By hand: analytic gradients and Jacobian, the same chord-Newton iteration.
#[derive(Clone, Copy)]
struct HandCoded {
    inverse_inertia: [f64; 3],
    displacements: [Option<[f64; 3]>; 3],
}

type V = [f64; 3];

fn dot(a: &V, b: &V) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: &V, b: &V) -> V {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

impl HandCoded {
    fn new(inertia: &V) -> Self {
        Self { inverse_inertia: inertia.map(f64::recip), displacements: [None; 3] }
    }

    /// `z × w + |w|² z − (w·z) w` at the midpoint, where `w = I⁻¹z` is the discrete gradient of
    /// the quadratic energy and `z` that of the entropy.
    fn residual(&self, x: &V, d: &V, h: f64) -> (V, V, V) {
        let z: V = std::array::from_fn(|i| x[i] + 0.5 * d[i]);
        let w: V = std::array::from_fn(|i| self.inverse_inertia[i] * z[i]);
        let (c, (ww, wz)) = (cross(&z, &w), (dot(&w, &w), dot(&w, &z)));
        let r = std::array::from_fn(|i| d[i] - h * (c[i] + ww * z[i] - wz * w[i]));
        (r, z, w)
    }

    /// The inverse of `1 − (h/2) ∂v/∂z` by cofactors.
    fn inverse_jacobian(&self, z: &V, w: &V, h: f64) -> [V; 3] {
        let m = &self.inverse_inertia;
        let (ww, wz) = (dot(w, w), dot(w, z));
        let skew = |a: &V| [[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]];
        let (zx, wx) = (skew(z), skew(w));
        let mut j = [[0.0; 3]; 3];
        for i in 0..3 {
            for k in 0..3 {
                let delta = if i == k { 1.0 } else { 0.0 };
                let slope = zx[i][k] * m[k] - wx[i][k] + 2.0 * z[i] * w[k] * m[k] + ww * delta
                    - w[i] * (w[k] + m[k] * z[k])
                    - wz * m[i] * delta;
                j[i][k] = delta - 0.5 * h * slope;
            }
        }
        let [a, b, c] =
            [[j[0][0], j[1][0], j[2][0]], [j[0][1], j[1][1], j[2][1]], [j[0][2], j[1][2], j[2][2]]];
        let rows = [cross(&b, &c), cross(&c, &a), cross(&a, &b)];
        let scale = dot(&a, &rows[0]).recip();
        rows.map(|row| row.map(|entry| entry * scale))
    }

    fn guess(&self, x: &V, h: f64) -> V {
        match self.displacements {
            [Some(a), Some(b), Some(c)] => std::array::from_fn(|i| 3.0 * (a[i] - b[i]) + c[i]),
            [Some(a), Some(b), None] => std::array::from_fn(|i| 2.0 * a[i] - b[i]),
            _ => {
                let (r, _, _) = self.residual(x, &[0.0; 3], h);
                r.map(|r| -r)
            }
        }
    }
}

impl Step for HandCoded {
    type Point = V;

    fn step(&mut self, x: &V, h: f64) -> V {
        let mut d = self.guess(x, h);
        let (mut r, z, w) = self.residual(x, &d, h);
        let inverse = self.inverse_jacobian(&z, &w, h);
        let pw = dot(&z, &z).sqrt() * dot(&w, &w).sqrt();
        let kz = dot(&w, &w) * dot(&z, &z).sqrt();
        let floor = f64::EPSILON * (4.0 * h * (pw + kz) + dot(&d, &d).sqrt());
        for _ in 0..30 {
            if dot(&r, &r) <= floor * floor {
                break;
            }
            for i in 0..3 {
                d[i] -= dot(&inverse[i], &r);
            }
            (r, _, _) = self.residual(x, &d, h);
        }
        self.displacements = [Some(d), self.displacements[0], self.displacements[1]];
        std::array::from_fn(|i| x[i] + d[i])
    }

    fn entries(x: &V) -> Vec<f64> {
        x.to_vec()
    }
}
