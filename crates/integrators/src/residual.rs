//! The implicit equation of one step.

use metriplectic_dynamics::{Bracket, Dissipation, Metriplectic, system::Point};
use metriplectic_fields::{
    ChartPoint, Column, Scalar, ScalarField, Space, Square, Vector, differential,
};
use metriplectic_manifolds::{Arc, Manifold, MetricError, Nodes, Retraction, Riemannian};

use crate::gonzalez::{Chord, gonzalez};
use crate::root_finder::{Equation, Linearised, Root};

/// The equation of one step (Bloch, Farré Puiggalí, Martín de Diego 2024, §4.4), as a function of
/// the initial displacement `u ∈ T_xM` of the arc:
///
/// ```math
/// F(u) = d - h \bigl( \Pi(z)\, w + K_w(z)\, dS(z) \bigr) = 0 ,
/// ```
///
/// with `(z, d) = R_h⁻¹(x, x')` the base point and displacement of the arc, and `w` the Gonzalez
/// discrete gradient of `H` along it. Both brackets kill `w`, so a root keeps `H`. No logarithm is
/// taken: the arc is shot from `x`.
#[derive(Debug)]
pub struct Residual<'a, Y: Metriplectic, R> {
    /// The system.
    pub system: &'a Y,
    /// The retraction of the scheme.
    pub retraction: &'a R,
    /// Where the step starts.
    pub x: &'a Point<Y>,
    /// The step size `h`.
    pub h: f64,
    /// The energy `H(x)`.
    pub energy: f64,
    /// The part of the energy error of earlier steps that this step takes back.
    pub recall: f64,
}

/// The residual with its Jacobian, and the discrete gradient `w` in it.
struct Jet<M: Space> {
    at: Linearised<M>,
    w: Vector<M>,
}

impl<Y, R> Residual<'_, Y, R>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
{
    /// The residual by its definition, at any scalar.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the arc cannot be followed.
    pub fn at<D: Scalar>(
        &self,
        u: &Vector<Y::Manifold, D>,
    ) -> Result<Vector<Y::Manifold, D>, MetricError> {
        let metric = self.system.metric();
        let arc = self.retraction.arc(metric, self.x, u)?;
        let g = metric.at(&arc.z)?;
        let w = gonzalez(self.system.energy(), &g, &arc, self.energy);
        let s = differential(self.system.entropy(), &arc.z);
        let reversible = self.system.bracket().apply(&self.system.site(&arc.z, &s), &w)?;
        let irreversible = self.system.dissipation().apply(metric, &arc.z, &w, &s)?;
        Ok(arc.d - (reversible + irreversible) * D::from(self.h))
    }

    /// The error `e = H(x') − H(x) + recall` of the energy at the end of an arc.
    #[inline]
    fn imbalance(&self, end: &Point<Y>) -> f64 {
        self.system.energy_at(end) - self.energy + self.recall
    }

    /// One more correction for a root with the end `x'` at which the energy is not kept to round-off:
    /// the corrected root, and its end.
    ///
    /// Both brackets kill `w`, so `⟨w, F(u)⟩ = e` for every `u`. Once `h|Π|` is large the sum
    /// `d − h(Πw + K dS)` has lost digits of this number that the difference `H(x') − H(x)` has. So
    /// the last correction is that of the residual whose part along `w` is exact,
    /// `F + (e − ⟨w, F⟩) w/|w|²`, as long as this changes `F` within its round-off and reduces `e`.
    #[inline]
    pub(crate) fn last_correction(
        &self,
        root: &Root<Y::Manifold>,
        end: &Point<Y>,
    ) -> Option<(Vector<Y::Manifold>, Point<Y>)> {
        // A floor near the rounding of the entries of x' needs no correction.
        let coarse = root.floor > 8.0 * f64::EPSILON * Y::Manifold::magnitude(self.x);
        let e = if coarse { self.imbalance(end) } else { 0.0 };
        if e.abs() <= 4.0 * f64::EPSILON * self.energy.abs() {
            None
        } else {
            self.balance(&root.u, e)
        }
    }

    /// The last correction, for an error `e` of the energy.
    #[cold]
    fn balance(&self, u: &Vector<Y::Manifold>, e: f64) -> Option<(Vector<Y::Manifold>, Point<Y>)> {
        let Jet { at, w } = self.jet(u)?;
        let lost = w * ((e - w.dot(&at.residual)) / w.dot(&w));
        let u = *u - at.jacobian.solve(&(at.residual + lost))?;
        let end = self.retraction.end(self.system.metric(), self.x, &u).ok()?;
        let better = self.imbalance(&end).abs() < e.abs();
        (lost.magnitude() <= at.floor && better).then_some((u, end))
    }

    /// The data of the discrete gradient of `H` along the arc of `u`.
    #[inline]
    fn chord(
        &self,
        u: &Vector<Y::Manifold>,
        df: &Vector<Y::Manifold>,
        d: &Vector<Y::Manifold>,
        end: (&Point<Y>, f64),
    ) -> Chord<Y::Manifold> {
        Chord::new(self.system.energy(), df, d, self.energy, end, || {
            // The same arc has been followed to its end, so the alternative is not reached.
            let along = self.retraction.along(self.system.metric(), self.x, u);
            along.unwrap_or_else(|_| Nodes {
                ends: [self.x, end.0].map(Y::Manifold::constant),
                middle: None,
            })
        })
    }

    /// The residual with its Jacobian, and `w`, from the jets `(f, df, Hf)` of the fields: no nested
    /// dual number is formed.
    #[inline]
    fn jet(&self, u: &Vector<Y::Manifold>) -> Option<Jet<Y::Manifold>> {
        let (system, metric, h) = (self.system, self.system.metric(), self.h);
        let arc = self.retraction.arc_jet(metric, self.x, u).ok()?;
        let centre = ChartPoint::<Y::Manifold>::centre(&arc.z);
        let g = metric.at(&centre).ok()?;
        let energy = system.energy().jet2(&arc.z);
        let end = system.energy().jet1(&arc.end);
        let entropy = system.entropy().jet2(&arc.z);
        let chord = self.chord(u, &energy.df, &arc.d, (&arc.end, end.value));
        let w = chord.covector(self.recall, &g, &arc.d);
        let slopes = metric.slopes(&arc.z);
        let metric_jet = (&g, slopes.as_ref());
        let dw = chord.slope(self.recall, metric_jet, &arc, &energy.hf, &end.df);
        let pi = system.bracket().linearise(&system.site(&centre, &entropy.df), &w).ok()?;
        let k = system.dissipation().linearise(metric, &arc.z, &w, &entropy.df).ok()?;

        let residual = arc.d - (pi.value + k.value) * h;
        let slope = (pi.along_z + k.along_z) * arc.dz
            + (pi.tensor + k.along_w) * dw
            + (pi.along_s + k.tensor) * (entropy.hf * arc.dz);
        let jacobian = arc.dd - slope * h;
        // The terms of Πw and K dS are rounded, and so are w and d.
        let length = arc.d.magnitude();
        let pi_size = pi.tensor.magnitude();
        let terms = pi_size * w.magnitude() + k.tensor.magnitude() * entropy.df.magnitude();
        let gain = pi_size + k.along_w.magnitude();
        let floor =
            f64::EPSILON * (4.0 * h.abs() * terms + length) + h.abs() * gain * chord.noise(length);
        let usable = residual.is_finite() && jacobian.magnitude().is_finite();
        usable.then_some(Jet { at: Linearised { residual, jacobian, floor }, w })
    }
}

impl<Y, R> Equation<Y::Manifold> for Residual<'_, Y, R>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
{
    /// The residual, safe against round-off.
    #[inline]
    fn value(&self, u: &Vector<Y::Manifold>) -> Option<Vector<Y::Manifold>> {
        let (system, metric) = (self.system, self.system.metric());
        let Arc { z, d, end: point } = self.retraction.real_arc(metric, self.x, u).ok()?;
        let g = metric.at(&z).ok()?;
        let df = system.energy().jet1(&z.base).df;
        let end = system.energy_at(&point);
        let w = self.chord(u, &df, &d, (&point, end)).covector(self.recall, &g, &d);
        let s = system.entropy().jet1(&z.base).df;
        let reversible = system.bracket().apply(&system.site(&z, &s), &w).ok()?;
        let irreversible = system.dissipation().apply(metric, &z, &w, &s).ok()?;
        let residual = d - (reversible + irreversible) * self.h;
        residual.is_finite().then_some(residual)
    }

    #[inline]
    fn linearise(&self, u: &Vector<Y::Manifold>) -> Option<Linearised<Y::Manifold>> {
        self.jet(u).map(|jet| jet.at)
    }
}
