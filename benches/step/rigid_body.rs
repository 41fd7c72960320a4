//! The relaxing rigid body on so(3)*, a hundred steps from a state in full motion.

use std::cell::Cell;
use std::rc::Rc;

use metriplectic::fields::{Jet1, Jet2};
use metriplectic::prelude::*;

use crate::hand_generic::{Field, Generic};
use crate::stable_gradient::{self, Displacements, Linearised};
use crate::{Row, Step, check};

type V = [f64; 3];

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

/// The two fields on paper, for the step that knows nothing else of them.
#[derive(Clone, Copy)]
struct KineticEnergy(Vector3<f64>);

impl Field for KineticEnergy {
    fn value(&self, p: &Vector3<f64>) -> f64 {
        0.5 * p.component_mul(p).dot(&self.0)
    }

    fn gradient(&self, p: &Vector3<f64>) -> Vector3<f64> {
        p.component_mul(&self.0)
    }
}

#[derive(Clone, Copy)]
struct HalfSquare;

impl Field for HalfSquare {
    fn value(&self, p: &Vector3<f64>) -> f64 {
        0.5 * p.norm_squared()
    }

    fn gradient(&self, p: &Vector3<f64>) -> Vector3<f64> {
        *p
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
    let of_body = || body().build().expect(WELL);
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
    let halves = Vector3::from(INERTIA.map(|moment| 0.5 / moment));
    let by_entries = System::on(LieDual::so3())
        .energy(move |p: &Vector3<Real>| {
            p.x * p.x * halves.x + p.y * p.y * halves.y + p.z * p.z * halves.z
        })
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5);
    let typed = System::on(LieDual::so3()).energy(Energy(INERTIA)).entropy(Entropy);
    let published = body().second_law(SecondLaw::Published).build().expect(WELL);
    let [mean, itoh_abe] = [(); 2].map(|()| of_body());
    let scheme = Scheme::new(WeylMidpoint);
    let rows = vec![
        Row::new("step/rigid_body/closure", of_body(), start, h)
            .counted(&calls, counting, start, h),
        Row::new("step/rigid_body/entries", by_entries.build().expect(WELL), start, h),
        Row::new("step/rigid_body/erased", of_body().erased(), start, h),
        Row::new("step/rigid_body/typed", typed.build().expect(WELL), start, h),
        Row::new("step/rigid_body/analytic", analytic.build().expect(WELL), start, h),
        Row::by_hand("step/rigid_body/hand_coded", HandCoded::new(&INERTIA), start, h),
        Row::by_hand(
            "step/rigid_body/hand_generic",
            Generic::new(KineticEnergy(Vector3::from(INERTIA.map(f64::recip))), HalfSquare),
            start,
            h,
        ),
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
    let stages = [
        Row::by("step/rigid_body/order_5", DormandPrince5, of_body(), start, h),
        Row::by("step/rigid_body/order_8", DormandPrince8, of_body(), start, h),
        Row::by("step/rigid_body/gauss_2", Gauss::<2>, of_body(), start, h),
        Row::by("step/rigid_body/radau_2", Radau::<2>, of_body(), start, h),
    ];
    rows.into_iter().chain(stages).collect()
}

/// By hand: analytic gradients and Jacobian, the same chord-Newton iteration.
#[derive(Clone)]
struct HandCoded {
    inverse_inertia: Vector3<f64>,
    displacements: Displacements<3>,
    iterations: usize,
}

impl HandCoded {
    fn new(inertia: &V) -> Self {
        let inverse_inertia = Vector3::from(inertia.map(f64::recip));
        Self { inverse_inertia, displacements: Displacements::new(), iterations: 0 }
    }

    /// `z × w + |w|² z − (w·z) w` at the midpoint, where `w = I⁻¹z` is the discrete gradient of
    /// the quadratic energy and `z` that of the entropy.
    fn residual(&self, x: &Vector3<f64>, d: &Vector3<f64>, h: f64) -> Vector3<f64> {
        let z = x + d * 0.5;
        let w = self.inverse_inertia.component_mul(&z);
        d - (z.cross(&w) + z * w.norm_squared() - w * w.dot(&z)) * h
    }

    /// The residual with the inverse of `1 − (h/2) ∂v/∂z`.
    fn linearise(&self, x: &Vector3<f64>, d: &Vector3<f64>, h: f64) -> Linearised<3> {
        let (m, z) = (&self.inverse_inertia, x + d * 0.5);
        let w = m.component_mul(&z);
        let (ww, wz) = (w.norm_squared(), w.dot(&z));
        let velocity = z.cross(&w) + z * ww - w * wz;
        let m_diagonal = Matrix3::from_diagonal(m);
        let slope = z.cross_matrix() * m_diagonal - w.cross_matrix()
            + (z * w.component_mul(m).transpose()) * 2.0
            + Matrix3::from_diagonal_element(ww)
            - w * (w + m.component_mul(&z)).transpose()
            - m_diagonal * wz;
        let jacobian = Matrix3::identity() - slope * (0.5 * h);
        let terms = (z.norm() + w.norm()) * w.norm() * z.norm();
        let floor = f64::EPSILON * (4.0 * h * terms + d.norm());
        let inverse = jacobian.try_inverse().unwrap_or_else(Matrix3::identity);
        Linearised { residual: d - velocity * h, inverse, floor }
    }
}

impl Step for HandCoded {
    type Point = Vector3<f64>;

    fn step(&mut self, x: &Vector3<f64>, h: f64) -> Vector3<f64> {
        let guess = self.displacements.extrapolate();
        let guess = guess.unwrap_or_else(|| -self.residual(x, &Vector3::zeros(), h));
        let here = self.linearise(x, &guess, h);
        let (d, iterations) = stable_gradient::solve(guess, &here, |d| self.residual(x, d, h));
        self.iterations += iterations;
        self.displacements.note(d);
        x + d
    }

    fn iterations(&self) -> usize {
        self.iterations
    }

    fn entries(x: &Vector3<f64>) -> Vec<f64> {
        x.as_slice().to_vec()
    }
}
