//! The midpoint discrete gradient.

use metriplectic_fields::{
    Column, Jet1, Jet2, Matrix, Real, Scalar, ScalarField, Space, Square, Vector, differential,
};
use metriplectic_manifolds::{Arc, ArcJet, InnerProduct, Manifold};

/// Gonzalez' discrete gradient on a manifold (Gonzalez 1996; Bloch, Farré Puiggalí, Martín de Diego
/// 2024, eq. "gonzalez-m", with the missing step size restored):
///
/// ```math
/// w = dF(z) + \frac{F(x') - F(x) - dF(z)\,d}{G(d, d)}\, \flat d , \qquad d = hv ,
/// ```
///
/// so that `⟨w, d⟩ = F(x') − F(x)`. This is the definition, at any scalar; [`Chord::covector`] is
/// the same covector evaluated safely near equilibrium.
pub fn gonzalez<M: Space, D: Scalar>(
    f: &impl ScalarField<M>,
    g: &impl InnerProduct<Vector<M, D>>,
    arc: &Arc<M, D>,
    start: f64,
) -> Vector<M, D> {
    let df = differential(f, &arc.z);
    let flat = g.flat(&arc.d);
    let defect = f.at(&arc.end) - start - df.dot(&arc.d);
    df + flat * (defect / flat.dot(&arc.d))
}

/// What a field does along one arc: the data of a discrete gradient at `f64`.
///
/// The defect `δ = F(x') − F(x) − dF(z) d` is of third order, so the difference of the two values
/// loses it in round-off as the step gets short: its error `ε|F|` enters the covector as `ε|F|/|d|`.
/// The fundamental theorem of calculus gives the same number without the cancellation,
///
/// ```math
/// \delta = \int_0^1 \bigl( f(s) - dF(z)\,d \bigr) ds, \qquad
/// f(s) = dF(\gamma(s))\,\gamma'(s) ,
/// ```
///
/// here by the three-point Hermite rule with end corrections
/// `∫f = (7f(0) + 16f(½) + 7f(1))/30 − (f'(1) − f'(0))/60`, exact to degree 5. The two are averaged
/// with the inverse squares of their error estimates, which changes over smoothly and switches
/// nothing off.
#[derive(Clone, Copy, Debug)]
pub struct Chord<M: Space> {
    /// `F`, `dF` and Hessian at the base point `z`.
    pub middle: Jet2<M>,
    /// `F` and `dF` at the end `x'`.
    pub end: Jet1<M>,
    /// `F`, `f`, `f'` along the arc at `s = 0, ½, 1`.
    along: [Real; 3],
    /// The size of a rounding error in a difference of two values of `F`.
    rounding: f64,
}

impl<M: Manifold> Chord<M> {
    /// Evaluates `f` along an arc: its jets at `z` and `x'`, and its derivatives along the arc,
    /// whose point at time `s` is `position(s)`.
    pub fn new(
        f: &impl ScalarField<M>,
        arc: &ArcJet<M>,
        position: impl Fn(Real) -> M::Point<Real>,
    ) -> Self {
        let middle = f.jet2(&arc.z);
        let end = f.jet1(&arc.end);
        let along = [0.0, 0.5, 1.0].map(|s| f.at_real(&position(Real::new(s, 1.0, 1.0, 0.0))));
        let point = M::magnitude(&arc.end) * middle.df.magnitude();
        let rounding = f64::EPSILON * (along[0].re.abs() + along[2].re.abs() + point);
        Self { middle, end, along, rounding }
    }

    /// Whether everything is a finite number.
    pub fn is_finite(&self) -> bool {
        let [a, b, c] = &self.along;
        self.middle.is_finite()
            && self.end.is_finite()
            && [a, b, c].iter().all(|f| f.re.is_finite() && f.eps1eps2.is_finite())
    }

    /// The defect `F(x') − F(x) − dF(z) d`, free of cancellation.
    pub fn defect(&self, start: f64, d: &Vector<M>) -> f64 {
        let slope = self.middle.df.dot(d);
        let difference = (self.end.value - start) - slope;
        let [f0, f1, f2] = self.along.map(|f| f.eps1 - slope);
        let ends = self.along[2].eps1eps2 - self.along[0].eps1eps2;
        let hermite = (7.0 * (f0 + f2) + 16.0 * f1) / 30.0 - ends / 60.0;
        let simpson = (f0 + f2 + 4.0 * f1) / 6.0;
        let naive_error = self.rounding.powi(2);
        let size = self.along.iter().map(|f| f.eps1.abs()).sum::<f64>();
        let hermite_error = (hermite - simpson).powi(2) + (f64::EPSILON * size).powi(2);
        let total = naive_error + hermite_error;
        let weight = if total > 0.0 { naive_error / total } else { 0.0 };
        difference + weight * (hermite - difference)
    }

    /// The covector `w` with `⟨w, d⟩ = F(x') − F(x) + recall`, and its derivative along the unknown
    /// of the arc.
    ///
    /// `recall` is what earlier steps have left over; it is zero in the definition.
    pub fn covector(
        &self,
        start: f64,
        recall: f64,
        g: &impl InnerProduct<Vector<M>>,
        arc: &ArcJet<M>,
    ) -> (Vector<M>, Matrix<M>) {
        let df = self.middle.df;
        let mut slope = self.middle.hf * arc.dz;
        let flat = g.flat(&arc.d);
        let square = flat.dot(&arc.d);
        if square <= 0.0 {
            return (df, slope);
        }
        let c = (self.defect(start, &arc.d) + recall) / square;
        // ∂δ = dF(x') ∂x' − ∂(dF(z) d), a difference of nearly equal rows, which counts only as far
        // as it is above its own round-off.
        let rows = arc.dend.transpose_times(&self.end.df)
            - arc.dd.transpose_times(&df)
            - slope.transpose_times(&arc.d);
        let signal = self.middle.df.magnitude() * arc.d.magnitude();
        let trust = signal.powi(2) / (signal.powi(2) + (1e3 * self.rounding).powi(2));
        let dc = (rows * trust - arc.dd.transpose_times(&flat) * (2.0 * c)) * square.recip();
        slope += Matrix::<M>::outer(&flat, &dc);
        for k in 0..Vector::<M>::LEN {
            let column = g.flat(&Vector::<M>::from_index(|i| arc.dd[(i, k)]));
            for i in 0..Vector::<M>::LEN {
                slope[(i, k)] += c * column[i];
            }
        }
        (df + flat * c, slope)
    }
}
