//! A bracket with the velocities of an exchange.

use metriplectic_fields::{ChartPoint, Column, Dimension, Matrix, Real, Scalar, Square, Vector};
use metriplectic_manifolds::{Manifold, MetricAt, MetricError, Riemannian};

use super::lift::{Arguments, Seeded};
use super::list::{Entries, Exchange, ExchangeArgs, Part, PartKind, Visitor};
use crate::bracket::{Bracket, BracketArgs, BracketJet};

/// A bracket whose [force](Bracket::force) has the velocities of ports and baths at one time.
///
/// This force changes the energy by the work and the heat, so verification looks at the bracket without it.
#[derive(Debug)]
pub struct Driven<'a, B, X> {
    bracket: &'a B,
    exchange: &'a X,
    time: f64,
}

impl<B, X> Clone for Driven<'_, B, X> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<B, X> Copy for Driven<'_, B, X> {}

impl<'a, B, X> Driven<'a, B, X> {
    /// This bracket and this exchange at the time.
    pub const fn new(bracket: &'a B, exchange: &'a X, time: f64) -> Self {
        Self { bracket, exchange, time }
    }
}

/// The sum of the velocities of all parts.
struct Sum<M: Manifold>(Vector<M, Real>);

impl<M: Manifold> Visitor<M> for Sum<M> {
    fn visit(&mut self, _: Part<'_>, velocity: &Vector<M, Real>, _: &Vector<M, Real>) {
        self.0 += *velocity;
    }
}

/// The rates of an exchange at one place, per unit of time.
#[derive(Clone, Copy, Debug)]
pub struct Rates<M: Manifold, E> {
    /// The sum of all velocities, in the frame there.
    pub velocity: Vector<M>,
    /// The work of each port, the heat and the entropy of each bath.
    pub entries: E,
    /// The entropy `Σ_b ⟨A, R A⟩/T` that the baths and the system produce together.
    pub production: f64,
    /// The sum of all work and heat.
    pub energy: f64,
}

/// Computes what an exchange does at a point with the covectors `w` and `s` of energy and entropy.
///
/// # Errors
///
/// [`MetricError`] if the metric or the chart cannot be used there.
pub fn rates<M: Manifold, G: Riemannian<M>, X: Exchange<M, G>>(
    exchange: &X,
    (metric, x): (&G, &M::Point<f64>),
    t: f64,
    [w, s]: [&Vector<M>; 2],
) -> Result<Rates<M, X::Entries>, MetricError> {
    struct Collected<M: Manifold> {
        sum: Vector<M>,
        w: Vector<M>,
        s: Vector<M>,
        numbers: Vec<f64>,
        production: f64,
        energy: f64,
    }
    impl<M: Manifold> Visitor<M> for Collected<M> {
        fn visit(&mut self, part: Part<'_>, velocity: &Vector<M, Real>, _: &Vector<M, Real>) {
            let v: Vector<M> = velocity.real();
            let power = self.w.dot(&v);
            self.sum += v;
            self.energy += power;
            self.numbers.push(power);
            if let PartKind::Bath { temperature, .. } = part.kind {
                // A bath at zero takes no entropy.
                let per_energy = if temperature > 0.0 { temperature.recip() } else { 0.0 };
                let a = self.s * temperature - self.w;
                self.numbers.push(-power * per_energy);
                self.production += a.dot(&v) * per_energy;
            }
        }
    }
    let centre = ChartPoint::<M, Real>::centre(x);
    let g = MetricAt::new(metric, &centre);
    let [real_w, real_s] = [w, s].map(Vector::<M, Real>::embed);
    let mut collected = Collected::<M> {
        sum: Vector::<M>::zero(),
        w: *w,
        s: *s,
        numbers: Vec::with_capacity(X::Entries::LEN),
        production: 0.0,
        energy: 0.0,
    };
    exchange.each(&ExchangeArgs { t, g: &g, w: &real_w, s: &real_s }, &mut collected)?;
    let Collected { sum, numbers, production, energy, .. } = collected;
    Ok(Rates { velocity: sum, entries: X::Entries::from_index(|i| numbers[i]), production, energy })
}

impl<B, X> Driven<'_, B, X> {
    /// The sum of all velocities at the scalar of closures.
    fn sum<M, G>(&self, metric: &G, (x, w, s): &Seeded<M>) -> Result<Vector<M, Real>, MetricError>
    where
        M: Manifold,
        G: Riemannian<M>,
        X: Exchange<M, G>,
    {
        let g = MetricAt::new(metric, x);
        let mut sum = Sum::<M>(Vector::<M, Real>::zero());
        self.exchange.each(&ExchangeArgs { t: self.time, g: &g, w, s }, &mut sum)?;
        Ok(sum.0)
    }
}

impl<M, G, B, X> Bracket<M, G> for Driven<'_, B, X>
where
    M: Manifold,
    G: Riemannian<M>,
    B: Bracket<M, G>,
    X: Exchange<M, G>,
{
    #[inline]
    fn apply<D: Scalar>(
        &self,
        at: &BracketArgs<'_, M, G, D>,
        alpha: &Vector<M, D>,
    ) -> Result<Vector<M, D>, MetricError> {
        self.bracket.apply(at, alpha)
    }

    #[inline]
    fn linearise(
        &self,
        at: &BracketArgs<'_, M, G>,
        alpha: &Vector<M>,
    ) -> Result<BracketJet<M>, MetricError> {
        self.bracket.linearise(at, alpha)
    }

    fn tensor<D: Scalar>(
        &self,
        at: &BracketArgs<'_, M, G, D>,
    ) -> Result<Matrix<M, D>, MetricError> {
        self.bracket.tensor(at)
    }

    fn is_poisson(&self) -> bool {
        self.bracket.is_poisson()
    }

    #[inline]
    fn is_forced(&self) -> bool {
        X::PORTS + X::BATHS > 0 || self.bracket.is_forced()
    }

    fn force<D: Scalar>(
        &self,
        at: &BracketArgs<'_, M, G, D>,
        w: &Vector<M, D>,
    ) -> Result<Vector<M, D>, MetricError> {
        let arguments = Arguments { x: at.g.x, w, s: at.s };
        let exchanged = arguments.lift(|seeded| self.sum(at.g.metric, seeded))?;
        Ok(self.bracket.force(at, w)? + exchanged)
    }

    fn linearise_force(
        &self,
        at: &BracketArgs<'_, M, G>,
        w: &Vector<M>,
    ) -> Result<BracketJet<M>, MetricError> {
        let mut jet = if self.bracket.is_forced() {
            self.bracket.linearise_force(at, w)?
        } else {
            let zero = Matrix::<M>::zeros();
            BracketJet { value: Vector::<M>::zero(), along_z: zero, along_s: zero, tensor: zero }
        };
        let arguments = Arguments { x: at.g.x, w, s: at.s };
        let n = M::Dim::LEN;
        for k in 0..n {
            let v = self.sum(at.g.metric, &arguments.seeded(k, n + k))?;
            let along_s = self.sum(at.g.metric, &arguments.seeded(2 * n + k, 3 * n))?;
            for i in 0..n {
                jet.along_z[(i, k)] += v[i].eps1;
                jet.tensor[(i, k)] += v[i].eps2;
                jet.along_s[(i, k)] += along_s[i].eps1;
                if k == 0 {
                    jet.value[i] += v[i].re;
                }
            }
        }
        Ok(jet)
    }

    fn is_zero(&self) -> bool {
        self.bracket.is_zero()
    }

    fn annihilates_entropy(&self) -> bool {
        self.bracket.annihilates_entropy()
    }
}
