//! A system in plain numbers.

use metriplectic_equations::judge::coordinate_scales;
use metriplectic_equations::{
    Covectors, ENERGY, ENTROPY, Equations, Evaluated, Jet, Kind, MetricError, Model, Part, Path,
    Paths, PointError, SecondLaw, Sizes,
};
use metriplectic_fields::stack::with_room;
use metriplectic_fields::{
    ChartPoint, Column, Dimension, Matrix, Real, ScalarField, Space, Square, Vector,
};
use metriplectic_manifolds::in_numbers::{
    PathsInNumbers, column, point, put, put_matrix, with_entries, write,
};
use metriplectic_manifolds::{InnerProduct, Manifold, Riemannian};
use num_dual::Dual64;

use crate::bracket::{Bracket, BracketArgs};
use crate::dissipation::Dissipation;
use crate::invariants::{Action, Invariants, Visitor};
use crate::metriplectic::{CountOf, Dim, Metriplectic, Point, evaluated};
use crate::velocity::{self, Gradient, independence, irreversible};

/// A system that answers the questions of [`Equations`] and [`Model`], by reading points and columns from slices.
///
/// ```
/// use metriplectic_dynamics::{InNumbers, System};
/// use metriplectic_equations::{ENERGY, Equations};
/// use metriplectic_fields::Real;
/// use metriplectic_manifolds::LieDual;
/// use nalgebra::Vector3;
/// let body = System::on(LieDual::so3())
///     .energy(|p: &Vector3<Real>| p.x * p.x + p.y * p.y * 0.5 + p.z * p.z * 0.1)
///     .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
///     .build()?;
/// let system: &dyn Equations = &InNumbers(&body);
/// let mut values = [0.0; 2];
/// system.values(0.0, &[1.0, 2.0, 0.0], &mut values);
/// assert_eq!(values[ENERGY], 3.0);
/// # Ok::<(), metriplectic_dynamics::BuildError>(())
/// ```
#[derive(Debug)]
pub struct InNumbers<'a, Y: ?Sized>(pub &'a Y);

/// The manifold of a system.
type Of<Y> = <Y as Metriplectic>::Manifold;

/// Visits fields of a system.
trait WithField<M: Space> {
    fn visit(&mut self, f: &impl ScalarField<M>);
}

/// Passes the further invariant with a number on.
struct Pick<'a, F> {
    with: &'a mut F,
    left: usize,
}

impl<M: Space, F: WithField<M>> Visitor<M> for Pick<'_, F> {
    #[inline]
    fn visit(&mut self, _: Kind, f: &impl ScalarField<M>) {
        if self.left == 0 {
            self.with.visit(f);
        }
        self.left = self.left.wrapping_sub(1);
    }
}

/// Passes all further invariants on.
struct Each<'a, F>(&'a mut F);

impl<M: Space, F: WithField<M>> Visitor<M> for Each<'_, F> {
    #[inline]
    fn visit(&mut self, _: Kind, f: &impl ScalarField<M>) {
        self.0.visit(f);
    }
}

/// The values of fields, one after another.
struct Values<'a, M: Space> {
    x: &'a M::Point<f64>,
    values: std::slice::IterMut<'a, f64>,
}

impl<M: Space> WithField<M> for Values<'_, M> {
    #[inline]
    fn visit(&mut self, f: &impl ScalarField<M>) {
        if let Some(value) = self.values.next() {
            *value = f.at::<f64>(self.x);
        }
    }
}

/// The values and differentials of fields, one after another.
struct Jets<'a, M: Space> {
    x: &'a M::Point<f64>,
    values: std::slice::IterMut<'a, f64>,
    rows: std::slice::ChunksExactMut<'a, f64>,
}

impl<M: Space> WithField<M> for Jets<'_, M> {
    #[inline]
    fn visit(&mut self, f: &impl ScalarField<M>) {
        if let (Some(value), Some(row)) = (self.values.next(), self.rows.next()) {
            let jet = f.jet1(self.x);
            *value = jet.value;
            put(&jet.df, row);
        }
    }
}

/// The parts of a field at a hyper-dual point.
struct Along<'a, M: Space> {
    x: &'a M::Point<Real>,
    found: [f64; 4],
}

impl<M: Space> WithField<M> for Along<'_, M> {
    #[inline]
    fn visit(&mut self, f: &impl ScalarField<M>) {
        let f = f.at_real(self.x);
        self.found = [f.re, f.eps1, f.eps2, f.eps1eps2];
    }
}

/// The derivatives of fields along a curve, one after another.
struct AlongCurve<'a, M: Space> {
    x: &'a M::Point<Real>,
    to: std::slice::IterMut<'a, [f64; 2]>,
}

impl<M: Space> WithField<M> for AlongCurve<'_, M> {
    #[inline]
    fn visit(&mut self, f: &impl ScalarField<M>) {
        if let Some(to) = self.to.next() {
            let f = f.at_real(self.x);
            *to = [f.eps1, f.eps1eps2];
        }
    }
}

/// Value, differential and Hessian of a field.
struct Second<'a, M: Space> {
    x: &'a M::Point<f64>,
    value: f64,
    df: &'a mut [f64],
    hf: &'a mut [f64],
}

impl<M: Space> WithField<M> for Second<'_, M> {
    fn visit(&mut self, f: &impl ScalarField<M>) {
        let jet = f.jet2(self.x);
        self.value = jet.value;
        put(&jet.df, self.df);
        put_matrix(&jet.hf, self.hf);
    }
}

/// The differential of a field at a displacement.
struct Displaced<'a, M: Space> {
    x: &'a M::Point<f64>,
    q: Vector<M>,
    df: &'a mut [f64],
}

impl<M: Space> WithField<M> for Displaced<'_, M> {
    fn visit(&mut self, f: &impl ScalarField<M>) {
        put(&f.differential_at(self.x, &self.q), self.df);
    }
}

/// The Hessian of a field at a displacement.
struct Bent<'a, M: Space> {
    x: &'a M::Point<f64>,
    q: Vector<M>,
    hf: &'a mut [f64],
}

impl<M: Space> WithField<M> for Bent<'_, M> {
    fn visit(&mut self, f: &impl ScalarField<M>) {
        put_matrix(&f.hessian_at(self.x, &self.q), self.hf);
    }
}

/// Calls `act` with the action of the invariant with a number, if it has one.
struct Acting<F> {
    act: F,
    /// Invariants before it, and itself.
    left: usize,
}

impl<M: Space, F: FnMut(&Action<'_, M>)> Visitor<M> for Acting<F> {
    fn visit(&mut self, _: Kind, _: &impl ScalarField<M>) {
        self.left = self.left.wrapping_sub(1);
    }

    fn acts(&mut self, action: &Action<'_, M>) {
        if self.left == 0 {
            (self.act)(action);
        }
    }
}

/// Why each further invariant is conserved.
struct KindOf {
    left: usize,
    kind: Kind,
}

impl<M: Space> Visitor<M> for KindOf {
    fn visit(&mut self, kind: Kind, _: &impl ScalarField<M>) {
        if self.left == 0 {
            self.kind = kind;
        }
        self.left = self.left.wrapping_sub(1);
    }
}

/// The covectors of all laws of a system.
type OfLaws<Y> = velocity::Covectors<CountOf<Y>, Vector<Of<Y>>>;

/// The covectors that another one computed, in the order of the laws.
struct Given<F>(F);

impl<M: Space, F: FnMut() -> Vector<M>> Gradient<M> for Given<F> {
    type Covector = Vector<M>;

    #[inline]
    fn of(&mut self, _: &impl ScalarField<M>) -> Vector<M> {
        (self.0)()
    }
}

/// The differentials at a point, and zero, or NaN if a value or an entry is no number.
struct AtPoint<'a, M: Space> {
    x: &'a M::Point<f64>,
    check: f64,
}

impl<M: Space> Gradient<M> for AtPoint<'_, M> {
    type Covector = Vector<M>;

    #[inline]
    fn of(&mut self, f: &impl ScalarField<M>) -> Vector<M> {
        let jet = f.jet1(self.x);
        self.check += 0.0 * jet.value;
        for i in 0..Vector::<M>::LEN {
            self.check += 0.0 * jet.df[i];
        }
        jet.df
    }
}

impl<Y: Metriplectic + ?Sized> InNumbers<'_, Y> {
    /// Calls `f` with the system and the entries of a state, with room on the stack for its matrices, and without an allocation
    /// where the entries are few.
    pub fn at<T>(&self, x: &Point<Y>, f: impl FnOnce(&dyn Equations, &[f64]) -> T) -> T {
        with_room::<Dim<Y>, T>(|| with_entries::<Of<Y>, T>(x, |x| f(self, x)))
    }

    /// The differentials of all laws at a point; `None` if one of them or a value is no number.
    #[inline]
    fn covectors(&self, x: &Point<Y>) -> Option<OfLaws<Y>> {
        let mut at = AtPoint::<Of<Y>> { x, check: 0.0 };
        let laws = [at.of(self.0.energy()), at.of(self.0.entropy())];
        let w = OfLaws::<Y>::new(laws, self.0.invariants(), &mut at);
        if at.check == 0.0 { Some(w) } else { None }
    }

    /// The velocity and the production at a point with these differentials; `None` where they have no value.
    #[inline(always)]
    fn motion(&self, x: &Point<Y>, w: &OfLaws<Y>) -> Option<(Vector<Of<Y>>, f64)> {
        let centre = ChartPoint::<Of<Y>>::centre(x);
        let g = self.0.metric_at(&centre);
        let args = self.0.bracket_args(&g, &w.entropy);
        let reversible = self.0.bracket().apply(&args, &w.energy).ok()?;
        let friction = irreversible(self.0, &g, w).ok()?;
        let velocity = reversible + friction;
        velocity.is_finite().then(|| (velocity, w.entropy.dot(&friction)))
    }

    /// Calls `with` for one law.
    fn law(&self, law: usize, with: &mut impl WithField<Of<Y>>) {
        match law {
            ENERGY => with.visit(self.0.energy()),
            ENTROPY => with.visit(self.0.entropy()),
            _ => self.0.invariants().each(&mut Pick { with, left: law - ENTROPY - 1 }),
        }
    }

    /// Calls `with` for all laws.
    #[inline]
    fn laws(&self, with: &mut impl WithField<Of<Y>>) {
        with.visit(self.0.energy());
        with.visit(self.0.entropy());
        if const { Y::Invariants::COUNT > 0 } {
            self.0.invariants().each(&mut Each(with));
        }
    }

    /// Evaluates the bracket with a dual number along the direction `u`, and the covector of the entropy along `ds`.
    fn along<T>(
        &self,
        x: &[f64],
        [u, ds]: [&[f64]; 2],
        entropy: &[f64],
        of: impl FnOnce(&BracketArgs<'_, Of<Y>, Y::Metric, Dual64>) -> Result<T, MetricError>,
    ) -> Result<T, MetricError> {
        with_room::<Dim<Y>, _>(|| {
            let dual = |re: f64, eps: f64| Dual64::new(re, eps);
            let q = Vector::<Of<Y>, Dual64>::from_index(|i| dual(0.0, u[i]));
            let s = Vector::<Of<Y>, Dual64>::from_index(|i| dual(entropy[i], ds[i]));
            let moved = ChartPoint { base: point::<Of<Y>>(x), q };
            let g = self.0.metric_at(&moved);
            of(&self.0.bracket_args(&g, &s))
        })
    }
}

impl<Y: Metriplectic + ?Sized> Equations for InNumbers<'_, Y> {
    fn sizes(&self) -> Sizes {
        let mut entries = 0;
        Of::<Y>::assemble(&mut || {
            entries += 1;
            1.0
        });
        let laws = ENTROPY + 1 + Y::Invariants::COUNT;
        Sizes { entries, directions: Dim::<Y>::LEN, laws }
    }

    fn values(&self, _: f64, x: &[f64], values: &mut [f64]) {
        let x = &point::<Of<Y>>(x);
        self.laws(&mut Values { x, values: values.iter_mut() });
    }

    fn differentials(&self, _: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        let x = &point::<Of<Y>>(x);
        let rows = w.chunks_exact_mut(Dim::<Y>::LEN);
        self.laws(&mut Jets { x, values: values.iter_mut(), rows });
    }

    fn velocity(&self, _: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
        with_room::<Dim<Y>, _>(|| {
            let x = point::<Of<Y>>(x);
            let (velocity, production) = self.motion(&x, &self.covectors(&x)?)?;
            put(&velocity, v);
            Some(production)
        })
    }

    fn velocity_with(&self, _: f64, x: &[f64], w: &[f64], v: &mut [f64]) -> Option<f64> {
        with_room::<Dim<Y>, _>(|| {
            let mut rows = w.chunks_exact(Dim::<Y>::LEN).map(column);
            let mut next = || rows.next().expect("a covector for each law");
            let (laws, mut others) = ([next(), next()], Given(next));
            let w = OfLaws::<Y>::new(laws, self.0.invariants(), &mut others);
            let (velocity, production) = self.motion(&point::<Of<Y>>(x), &w)?;
            put(&velocity, v);
            Some(production)
        })
    }

    fn stage(&self, _: f64, x: &[f64], q: &[f64], rates: &mut [f64]) -> Option<f64> {
        with_room::<Dim<Y>, _>(|| {
            let q = column(q);
            if !Of::<Y>::is_stage(&q) {
                return None;
            }
            let x = point::<Of<Y>>(x);
            let y = Of::<Y>::stage(&x, &q);
            if !self.0.manifold().is_inside(&y) {
                return None;
            }
            let (velocity, production) = self.motion(&y, &self.covectors(&y)?)?;
            put(&Of::<Y>::stage_rates(&x, (&q, &y), &velocity), rates);
            Some(production)
        })
    }

    fn second_law(&self) -> SecondLaw {
        self.0.second_law()
    }

    fn is_verified(&self) -> bool {
        self.0.is_verified()
    }

    fn evaluated(&self, x: &[f64]) -> Vec<Evaluated> {
        evaluated(self.0, &point::<Of<Y>>(x))
    }

    fn kind(&self, invariant: usize) -> Kind {
        let mut kind = KindOf { left: invariant, kind: Kind::Casimir };
        self.0.invariants().each(&mut kind);
        kind.kind
    }

    fn check(&self, x: &[f64]) -> Result<(), PointError> {
        self.0.manifold().check(&point::<Of<Y>>(x))
    }

    fn defect(&self, x: &[f64]) -> f64 {
        self.0.manifold().defect(&point::<Of<Y>>(x))
    }

    fn scales(&self, x: &[f64], sizes: &mut [f64]) {
        put(&Of::<Y>::scales(&point::<Of<Y>>(x)), sizes);
    }

    fn is_vector_space(&self) -> bool {
        Of::<Y>::IS_VECTOR_SPACE
    }

    fn chart(&self, x: &[f64], q: &[f64], y: &mut [f64]) {
        write::<Of<Y>>(&Of::<Y>::chart(&point::<Of<Y>>(x), &column(q)), y);
    }

    fn coordinates(&self, x: &[f64], y: &[f64], to: &mut [f64]) -> bool {
        let q: Vector<Of<Y>> = Of::<Y>::coordinates(&point::<Of<Y>>(x), &point::<Of<Y>>(y));
        put(&q, to);
        q.is_finite() && Of::<Y>::is_near(&q)
    }

    fn stage_state(&self, x: &[f64], q: &[f64], y: &mut [f64]) -> bool {
        let q = column(q);
        if !Of::<Y>::is_stage(&q) {
            return false;
        }
        let state = Of::<Y>::stage(&point::<Of<Y>>(x), &q);
        write::<Of<Y>>(&state, y);
        self.0.manifold().is_inside(&state)
    }

    fn stage_coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) {
        put(&Of::<Y>::stage_coordinates(&point::<Of<Y>>(x), &point::<Of<Y>>(y)), q);
    }

    fn stage_rates(&self, x: &[f64], q: &[f64], y: &[f64], v: &[f64], rates: &mut [f64]) {
        if Of::<Y>::RATES_ARE_VELOCITIES {
            return rates.copy_from_slice(v);
        }
        let (x, y) = (point::<Of<Y>>(x), point::<Of<Y>>(y));
        put(&Of::<Y>::stage_rates(&x, (&column(q), &y), &column(v)), rates);
    }

    fn model(&self) -> Option<&dyn Model> {
        Some(self)
    }
}

impl<Y: Metriplectic + ?Sized> Model for InNumbers<'_, Y> {
    fn is_zero(&self, part: Part) -> bool {
        match part {
            Part::Reversible => self.0.bracket().is_zero(),
            Part::Gyroscopic => !self.0.bracket().is_forced(),
            Part::Irreversible => self.0.dissipation().is_none(),
        }
    }

    fn is_poisson(&self) -> bool {
        self.0.bracket().is_poisson()
    }

    fn adapts(&self) -> bool {
        self.0.dissipation().adapts()
    }

    fn value(&self, law: usize, _: f64, x: &[f64]) -> f64 {
        let mut value = [0.0];
        let x = &point::<Of<Y>>(x);
        self.law(law, &mut Values { x, values: value.iter_mut() });
        value[0]
    }

    fn annihilates_entropy(&self) -> bool {
        self.0.bracket().annihilates_entropy()
    }

    fn has_canonical_metric(&self) -> bool {
        Y::Metric::IS_CANONICAL
    }

    fn has_constant_entropy(&self) -> bool {
        Y::Entropy::IS_CONSTANT
    }

    fn paths(&self) -> Option<&dyn Paths> {
        Some(self)
    }

    fn along(&self, law: usize, _: f64, x: &[f64], [u, v]: [&[f64]; 2]) -> [f64; 4] {
        let n = Dim::<Y>::LEN;
        let (u, v) = (&u[..n], &v[..n]);
        // With −0, so that an entry of −0 keeps its sign in the sum.
        let q = Vector::<Of<Y>, Real>::from_index(|i| Real::new(-0.0, u[i], v[i], 0.0));
        let x = Of::<Y>::chart(&point::<Of<Y>>(x), &q);
        let mut along = Along::<Of<Y>> { x: &x, found: [0.0; 4] };
        self.law(law, &mut along);
        along.found
    }

    fn along_curve(
        &self,
        _: f64,
        (_, path): (&dyn Paths, Path),
        start: (&[f64], &[f64], f64),
        to: &mut [[f64; 2]],
    ) -> Result<(), MetricError> {
        let x = self.on_manifold().at_time(path, start)?;
        self.laws(&mut AlongCurve::<Of<Y>> { x: &x, to: to.iter_mut() });
        Ok(())
    }

    fn jet(&self, law: usize, _: f64, x: &[f64], df: &mut [f64]) -> f64 {
        let mut value = [0.0];
        let x = &point::<Of<Y>>(x);
        let rows = df.chunks_exact_mut(Dim::<Y>::LEN);
        self.law(law, &mut Jets { x, values: value.iter_mut(), rows });
        value[0]
    }

    fn hessian(&self, law: usize, _: f64, x: &[f64], df: &mut [f64], hf: &mut [f64]) -> f64 {
        with_room::<Dim<Y>, _>(|| {
            let x = &point::<Of<Y>>(x);
            let mut second = Second { x, value: 0.0, df, hf };
            self.law(law, &mut second);
            second.value
        })
    }

    fn differential_at(&self, law: usize, _: f64, x: &[f64], q: &[f64], df: &mut [f64]) {
        let (x, q) = (&point::<Of<Y>>(x), column(q));
        with_room::<Dim<Y>, _>(|| self.law(law, &mut Displaced { x, q, df }));
    }

    fn hessian_at(&self, law: usize, _: f64, x: &[f64], q: &[f64], hf: &mut [f64]) {
        let (x, q) = (&point::<Of<Y>>(x), column(q));
        with_room::<Dim<Y>, _>(|| self.law(law, &mut Bent { x, q, hf }));
    }

    fn independence(&self, _: f64, x: &[f64], fractions: &mut [f64]) {
        with_room::<Dim<Y>, _>(|| {
            let of_each = independence(self.0, &ChartPoint::centre(&point::<Of<Y>>(x)));
            fractions.copy_from_slice(&of_each);
        });
    }

    fn metric(&self, x: &[f64], q: &[f64], g: &mut [f64]) {
        with_room::<Dim<Y>, _>(|| {
            let at = ChartPoint::<Of<Y>> { base: point::<Of<Y>>(x), q: column(q) };
            put_matrix(&self.0.metric().matrix(&at), g);
        });
    }

    fn check_metric(&self, x: &[f64], geodesics: bool) -> Result<(), MetricError> {
        with_room::<Dim<Y>, _>(|| {
            let centre = ChartPoint::<Of<Y>>::centre(&point::<Of<Y>>(x));
            let metric = self.0.metric();
            metric.at(&centre)?;
            if geodesics {
                metric.exp(&centre, &Vector::<Of<Y>>::zero())?;
            }
            Ok(())
        })
    }

    fn metric_slopes(&self, x: &[f64], slopes: &mut [f64]) -> bool {
        with_room::<Dim<Y>, _>(|| {
            let Some(of_metric) = self.0.metric().slopes(&point::<Of<Y>>(x)) else { return false };
            let n = Dim::<Y>::LEN;
            let tables = slopes.chunks_exact_mut(n * n);
            of_metric.as_ref().iter().zip(tables).for_each(|(slope, to)| put_matrix(slope, to));
            true
        })
    }

    fn flat(&self, x: &[f64], d: &[f64], w: &mut [f64]) -> Result<(), MetricError> {
        with_room::<Dim<Y>, _>(|| {
            let centre = ChartPoint::<Of<Y>>::centre(&point::<Of<Y>>(x));
            put(&self.0.metric().at(&centre)?.flat(&column(d)), w);
            Ok(())
        })
    }

    fn tensor(
        &self,
        part: Part,
        _: f64,
        x: &[f64],
        w: Covectors<'_>,
        tensor: &mut [f64],
    ) -> Result<(), MetricError> {
        with_room::<Dim<Y>, _>(|| {
            let centre = ChartPoint::<Of<Y>>::centre(&point::<Of<Y>>(x));
            let g = self.0.metric_at(&centre);
            let of_part: Matrix<Of<Y>> = match part {
                Part::Reversible => {
                    let s = column(w.entropy);
                    self.0.bracket().tensor(&self.0.bracket_args(&g, &s))?
                }
                Part::Gyroscopic => Matrix::<Of<Y>>::zeros(),
                Part::Irreversible => self.0.dissipation().tensor(&g, &column(w.energy))?,
            };
            put_matrix(&of_part, tensor);
            Ok(())
        })
    }

    fn apply(
        &self,
        part: Part,
        _: f64,
        (x, q): (&[f64], &[f64]),
        w: Covectors<'_>,
        alpha: &[f64],
        v: &mut [f64],
    ) -> Result<(), MetricError> {
        with_room::<Dim<Y>, _>(|| {
            let at = ChartPoint::<Of<Y>> { base: point::<Of<Y>>(x), q: column(q) };
            let (g, s) = (self.0.metric_at(&at), column(w.entropy));
            let args = self.0.bracket_args(&g, &s);
            let of_part = match part {
                Part::Reversible => self.0.bracket().apply(&args, &column(alpha))?,
                Part::Gyroscopic => self.0.bracket().force(&args, &column(w.energy))?,
                Part::Irreversible => {
                    self.0.dissipation().apply(&g, &column(w.energy), &column(alpha))?
                }
            };
            put(&of_part, v);
            Ok(())
        })
    }

    fn linearise(
        &self,
        part: Part,
        _: f64,
        x: &[f64],
        w: Covectors<'_>,
        alpha: &[f64],
        to: &mut Jet<'_>,
    ) -> Result<(), MetricError> {
        with_room::<Dim<Y>, _>(|| {
            let centre = ChartPoint::<Of<Y>>::centre(&point::<Of<Y>>(x));
            let (g, s, energy) = (self.0.metric_at(&centre), column(w.entropy), column(w.energy));
            let args = self.0.bracket_args(&g, &s);
            let (value, matrices) = match part {
                Part::Reversible | Part::Gyroscopic => {
                    let bracket = self.0.bracket();
                    let jet = if part == Part::Reversible {
                        bracket.linearise(&args, &column(alpha))?
                    } else {
                        bracket.linearise_force(&args, &energy)?
                    };
                    (jet.value, [jet.along_z, jet.along_s, jet.tensor])
                }
                Part::Irreversible => {
                    let jet = self.0.dissipation().linearise(&g, &energy, &column(alpha))?;
                    (jet.value, [jet.along_z, jet.along_w, jet.tensor])
                }
            };
            put(&value, to.value);
            put_matrix(&matrices[0], to.along_x);
            put_matrix(&matrices[1], to.along_w);
            put_matrix(&matrices[2], to.tensor);
            Ok(())
        })
    }

    fn bracket_slope(
        &self,
        _: f64,
        x: &[f64],
        along: [&[f64]; 2],
        entropy: &[f64],
        slope: &mut [f64],
    ) -> Result<(), MetricError> {
        let dual = self.along(x, along, entropy, |args| self.0.bracket().tensor(args))?;
        put_matrix(&Matrix::<Of<Y>>::from_entries(|i, j| dual[(i, j)].eps), slope);
        Ok(())
    }

    fn bracket_slope_of(
        &self,
        _: f64,
        x: &[f64],
        along: [&[f64]; 2],
        entropy: &[f64],
        alpha: &[f64],
        slope: &mut [f64],
    ) -> Result<(), MetricError> {
        let alpha = Vector::<Of<Y>, Dual64>::embed(&column::<Vector<Of<Y>>>(alpha));
        let dual = self.along(x, along, entropy, |args| self.0.bracket().apply(args, &alpha))?;
        put(&Vector::<Of<Y>>::from_index(|i| dual[i].eps), slope);
        Ok(())
    }

    fn generator(
        &self,
        invariant: usize,
        x: &[f64],
        moved: &mut [f64],
        at_zero: &mut [f64],
    ) -> bool {
        let (x, mut found) = (point::<Of<Y>>(x), false);
        let act = |action: &Action<'_, Of<Y>>| {
            found = true;
            let here = Of::<Y>::chart(&x, &Vector::<Of<Y>, Real>::zero());
            let along = action(Real::new(0.0, 1.0, 0.0, 0.0), &here);
            let at_rest = Of::<Y>::coordinates(&x, &along);
            put(&Vector::<Of<Y>>::from_index(|i| at_rest[i].eps1), moved);
            put(&Vector::<Of<Y>>::from_index(|i| at_rest[i].re), at_zero);
        };
        self.0.invariants().each(&mut Acting { act, left: invariant + 1 });
        found
    }

    fn action(&self, invariant: usize, x: &[f64], time: f64, y: &mut [f64], tangent: &mut [f64]) {
        let (x, n) = (point::<Of<Y>>(x), Dim::<Y>::LEN);
        let act = |action: &Action<'_, Of<Y>>| {
            let map = |q: &Vector<Of<Y>, Real>| action(Real::from(time), &Of::<Y>::chart(&x, q));
            let image = Of::<Y>::real(&map(&Vector::<Of<Y>, Real>::zero()));
            write::<Of<Y>>(&image, y);
            for k in 0..n {
                let seed = |i| Real::new(0.0, if i == k { 1.0 } else { 0.0 }, 0.0, 0.0);
                let moved = map(&Vector::<Of<Y>, Real>::from_index(seed));
                let moved = Of::<Y>::coordinates(&image, &moved);
                (0..n).for_each(|i| tangent[i * n + k] = moved[i].eps1);
            }
        };
        with_room::<Dim<Y>, _>(|| {
            self.0.invariants().each(&mut Acting { act, left: invariant + 1 });
        });
    }
}

impl<Y: Metriplectic + ?Sized> InNumbers<'_, Y> {
    fn on_manifold(&self) -> PathsInNumbers<'_, Of<Y>, Y::Metric> {
        PathsInNumbers::new(self.0.metric())
    }

    fn with_paths<T>(&self, f: impl FnOnce(&PathsInNumbers<'_, Of<Y>, Y::Metric>) -> T) -> T {
        f(&self.on_manifold())
    }
}

metriplectic_equations::follows_paths! { [Y: Metriplectic + ?Sized] InNumbers<'_, Y>: with_paths }

/// The sizes of the coordinates at a point, all of them positive.
pub(crate) fn units_at<Y: Metriplectic + ?Sized>(system: &Y, x: &Point<Y>) -> Vector<Of<Y>> {
    column(&coordinate_scales(&InNumbers(system), 0.0, &Of::<Y>::entries(x)).units)
}
