//! A metric from a closure against the canonical one, both with [`ChartMidpoint`].

use std::cell::Cell;
use std::rc::Rc;

use metriplectic::manifolds::rotations;
use metriplectic::prelude::*;

use crate::{Row, STEPS};

const WELL: &str = "energy, entropy and metric are a system";

/// Where a model starts, its step size, and the evaluations of its metric so far.
struct Start<P> {
    x: P,
    h: f64,
    evaluations: Rc<Cell<u64>>,
}

impl<P: Clone> Start<P> {
    fn new(x: P, h: f64) -> Self {
        Self { x, h, evaluations: Rc::default() }
    }

    /// A row with the evaluations of the metric in a step.
    fn row<Y>(&self, name: &str, system: Y) -> Row
    where
        Y: Metriplectic + 'static,
        Y::Manifold: metriplectic::fields::Space<Point<f64> = P>,
    {
        let name = format!("step/chart_midpoint/{name}");
        let scheme = Scheme::new(ChartMidpoint);
        let row = Row::with(name, scheme, system, self.x.clone(), self.h);
        self.evaluations.set(0);
        (row.run)(STEPS);
        let calls = self.evaluations.get() as f64 / STEPS as f64;
        Row { calls: (calls > 0.0).then_some(calls), ..row }
    }

    /// The metric, which counts its evaluations.
    fn counted<Q, A, F: Fn(&Q) -> A>(&self, metric: F) -> impl Fn(&Q) -> A + use<P, Q, A, F> {
        let evaluations = Rc::clone(&self.evaluations);
        move |x| {
            evaluations.set(evaluations.get() + 1);
            metric(x)
        }
    }
}

pub(crate) fn rows() -> Vec<Row> {
    let mut rows = sphere();
    rows.extend(rotation());
    rows.extend(flat());
    rows.extend(product());
    rows
}

/// The spinning top, in the round metric and in `1 + ½ a aᵀ` with `a = (x₂, x₃, x₁)`.
fn sphere() -> Vec<Row> {
    let top = || {
        System::on(Sphere::<2>::round()).bracket(AreaForm).energy(|x: &Vector3<Real>| {
            let term = |i: usize, d| x[i] * x[i] * (x[i] * (2.0 / 3.0) + 1.0) * (0.5 * d);
            term(0, 1.0) + term(1, 0.5) + term(2, 0.25)
        })
    };
    let start = Start::new(Vector3::repeat(3.0_f64.sqrt().recip()), 0.1);
    let round = start.counted(|_: &Vector3<Real>| Matrix3::<Real>::identity());
    let bent = start.counted(|x: &Vector3<Real>| {
        let a = Vector3::new(x.y, x.z, x.x);
        Matrix3::<Real>::identity() + a * a.transpose() * Real::from(0.5)
    });
    vec![
        start.row("sphere/canonical", top().build().expect(WELL)),
        start.row("sphere/round", top().metric(Metric::field(round)).build().expect(WELL)),
        start.row("sphere/bent", top().metric(Metric::field(bent)).build().expect(WELL)),
    ]
}

/// Relaxation on SO(3), in the bi-invariant metric and in `diag(2, 1.5, 1)`.
fn rotation() -> Vec<Row> {
    let frame = || {
        System::on(Rotations::bi_invariant())
            .bracket(Nambu::default())
            .energy(|r: &Matrix3<Real>| r.m11 + r.m22 * 2.0 + r.m33 * 3.0 + r.m12 * r.m23 * 0.5)
            .entropy(|r: &Matrix3<Real>| {
                let tilt = r.m31 + r.m32;
                r.m13 - r.m21 * 0.5 + tilt * tilt * 0.25
            })
    };
    let start = Start::new(rotations::exp(&Vector3::new(0.3, -0.2, 0.5)), 0.005);
    let inertia = start.counted(|_: &Matrix3<Real>| {
        Matrix3::from_diagonal(&Vector3::new(2.0, 1.5, 1.0)).cast::<Real>()
    });
    vec![
        start.row("rotations/canonical", frame().build().expect(WELL)),
        start.row("rotations/closure", frame().metric(Metric::field(inertia)).build().expect(WELL)),
    ]
}

/// The relaxing rigid body, in the canonical metric and in `1 + ¼ a aᵀ` with `a = (p₂, p₃, p₁)`.
fn flat() -> Vec<Row> {
    let body = || {
        System::on(LieDual::so3())
            .energy(|p: &Vector3<Real>| p.x * p.x * 0.05 + p.y * p.y * 0.1 + p.z * p.z * 0.5)
            .entropy(|p: &Vector3<Real>| (p.x * p.x + p.y * p.y + p.z * p.z) * 0.5)
    };
    let start = Start::new(Vector3::new(-0.6, -0.84, 0.15), 0.1);
    let skewed = start.counted(|p: &Vector3<Real>| {
        let a = Vector3::new(p.y, p.z, p.x) * Real::from(0.5);
        Matrix3::<Real>::identity() + a * a.transpose()
    });
    vec![
        start.row("flat/canonical", body().build().expect(WELL)),
        start.row("flat/closure", body().metric(Metric::field(skewed)).build().expect(WELL)),
    ]
}

/// A spin with its heat on S² × R, in the canonical metric and in the sum of one closure on each factor.
fn product() -> Vec<Row> {
    let spin = || {
        System::on(Product(Sphere::<2>::round(), Euclidean::<1>))
            .bracket((AreaForm, Zero))
            .energy(|(m, s): &(Vector3<Real>, Vector1<Real>)| {
                m.x * m.x * 0.5 - m.z + m.y * m.y * 0.2 + s.x * s.x * 0.5 + s.x
            })
            .entropy(|(_, s): &(Vector3<Real>, Vector1<Real>)| s.x)
    };
    let start = Start::new((Vector3::new(0.6, 0.0, 0.8), Vector1::new(0.5)), 0.05);
    let bent = start.counted(|m: &Vector3<Real>| {
        let a = Vector3::new(m.y, m.z, m.x);
        Matrix3::<Real>::identity() + a * a.transpose() * Real::from(0.5)
    });
    // One count for both factors, which are evaluated together.
    let heat = |s: &Vector1<Real>| Matrix1::new(s.x * s.x * 0.5 + 1.0);
    let metric = (Metric::field(bent), Metric::field(heat));
    vec![
        start.row("product/canonical", spin().build().expect(WELL)),
        start.row("product/closure", spin().metric(metric).build().expect(WELL)),
    ]
}
