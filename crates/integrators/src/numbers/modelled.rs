//! A model in plain numbers as a metriplectic system on a vector space with the canonical metric, of a size that is known at
//! compile time.
//!
//! Implicit methods of it are compiled with this library, one instance for each size, in place of one for each system. The model
//! answers what the closures of a system would, so a step has the same bits.

use metriplectic_dynamics::bracket::{BracketArgs, BracketJet};
use metriplectic_dynamics::dissipation::DissipationJet;
use metriplectic_dynamics::{Bracket, Dissipation, Metriplectic, SecondLaw};
use metriplectic_equations::{Covectors, ENERGY, ENTROPY, Jet, Model, Part};
use metriplectic_fields::{
    ChartPoint, Column, Jet1, Jet2, Matrix, Real, Scalar, ScalarField, Vector,
};
use metriplectic_manifolds::{Canonical, Euclidean, MetricAt, MetricError};
use nalgebra::{SMatrix, SVector};

use crate::system::NO_CLOCK;

/// A law of a model.
#[derive(Clone, Copy)]
pub(crate) struct Law<'a> {
    model: &'a dyn Model,
    law: usize,
}

impl<const N: usize> ScalarField<Euclidean<N>> for Law<'_> {
    /// Evaluates the law by its expansion, which is exact up to order 2.
    fn at<D: Scalar>(&self, x: &SVector<D, N>) -> D {
        const { assert!(D::NDERIV <= 2, "a model has derivatives up to order 2") };
        let real = SVector::<f64, N>::from_index(|i| x[i].re());
        if const { D::NDERIV == 0 } {
            return D::from(self.model.value(self.law, NO_CLOCK, real.as_slice()));
        }
        let Jet2 { value, df, hf } = self.jet2(&real);
        let d = SVector::<D, N>::from_index(|i| x[i] - D::from(real[i]));
        let mut sum = D::from(value);
        for i in 0..N {
            sum += d[i] * df[i];
            for j in 0..N {
                sum += d[i] * d[j] * (0.5 * hf[(i, j)]);
            }
        }
        sum
    }

    /// Evaluates the law on a plane, where `ε₁ε₂` has no part in the point, as on all paths of methods in a vector space.
    fn at_real(&self, x: &SVector<Real, N>) -> Real {
        let is_plane = |x: &Real| x.eps1eps2 == 0.0 || x.eps1eps2.is_nan();
        debug_assert!(x.iter().all(is_plane), "a path in a vector space is a line");
        let u = SVector::<f64, N>::from_index(|i| x[i].eps1);
        let v = SVector::<f64, N>::from_index(|i| x[i].eps2);
        let x = SVector::<f64, N>::from_index(|i| x[i].re);
        let directions = [u.as_slice(), v.as_slice()];
        let [re, eps1, eps2, eps1eps2] =
            self.model.along(self.law, NO_CLOCK, x.as_slice(), directions);
        Real::new(re, eps1, eps2, eps1eps2)
    }

    fn jet1(&self, x: &SVector<f64, N>) -> Jet1<Euclidean<N>> {
        let mut df = SVector::<f64, N>::zeros();
        let value = self.model.jet(self.law, NO_CLOCK, x.as_slice(), df.as_mut_slice());
        Jet1 { value, df }
    }

    fn jet2(&self, x: &SVector<f64, N>) -> Jet2<Euclidean<N>> {
        let mut df = SVector::<f64, N>::zeros();
        let mut hf = SMatrix::<f64, N, N>::zeros();
        let value = self.model.hessian(
            self.law,
            NO_CLOCK,
            x.as_slice(),
            df.as_mut_slice(),
            hf.as_mut_slice(),
        );
        // Row by row, where the matrices here are column by column.
        hf.transpose_mut();
        Jet2 { value, df, hf }
    }
}

/// The tensors of a model.
#[derive(Clone, Copy)]
pub(crate) struct Tensors<'a, const N: usize> {
    model: &'a dyn Model,
}

type At<'a, const N: usize, D> = MetricAt<'a, Euclidean<N>, Canonical, D>;

impl<const N: usize> Tensors<'_, N> {
    /// The vector of a part, with its first derivatives where the scalar asks for them.
    fn apply<D: Scalar>(
        &self,
        part: Part,
        g: &At<'_, N, D>,
        [w, s, alpha]: [&SVector<D, N>; 3],
    ) -> Result<SVector<D, N>, MetricError> {
        const { assert!(D::NDERIV <= 1, "a model gives its vectors with first derivatives") };
        if part == Part::Irreversible && self.model.has_constant_entropy() {
            return Ok(SVector::zeros());
        }
        let real = |v: &SVector<D, N>| SVector::<f64, N>::from_index(|i| v[i].re());
        let [q, w_re, s_re, alpha_re] = [&g.x.q, w, s, alpha].map(real);
        if const { D::NDERIV == 0 } {
            let mut v = SVector::<f64, N>::zeros();
            let w = Covectors { energy: w_re.as_slice(), entropy: s_re.as_slice() };
            let place = (g.x.base.as_slice(), q.as_slice());
            self.model.apply(part, NO_CLOCK, place, w, alpha_re.as_slice(), v.as_mut_slice())?;
            return Ok(SVector::from_index(|i| D::from(v[i])));
        }
        let centre = ChartPoint::<Euclidean<N>>::centre(&(g.x.base + q));
        let at = MetricAt::new(&Canonical, &centre);
        let (value, [along_x, along_w, tensor]) =
            self.linearise(part, &at, [&w_re, &s_re, &alpha_re])?;
        let (along, along_re) = if part == Part::Irreversible { (w, w_re) } else { (s, s_re) };
        Ok(SVector::from_index(|i| {
            let mut sum = D::from(value[i]);
            for j in 0..N {
                sum += (g.x.q[j] - D::from(q[j])) * along_x[(i, j)];
                sum += (along[j] - D::from(along_re[j])) * along_w[(i, j)];
                sum += (alpha[j] - D::from(alpha_re[j])) * tensor[(i, j)];
            }
            sum
        }))
    }

    fn linearise(
        &self,
        part: Part,
        g: &At<'_, N, f64>,
        [w, s, alpha]: [&SVector<f64, N>; 3],
    ) -> Result<(SVector<f64, N>, [SMatrix<f64, N, N>; 3]), MetricError> {
        let mut value = SVector::<f64, N>::zeros();
        let mut m = [SMatrix::<f64, N, N>::zeros(); 3];
        let [along_x, along_w, tensor] = &mut m;
        let mut jet = Jet {
            value: value.as_mut_slice(),
            along_x: along_x.as_mut_slice(),
            along_w: along_w.as_mut_slice(),
            tensor: tensor.as_mut_slice(),
        };
        let w = Covectors { energy: w.as_slice(), entropy: s.as_slice() };
        let x = g.x.base;
        self.model.linearise(part, NO_CLOCK, x.as_slice(), w, alpha.as_slice(), &mut jet)?;
        // Row by row, where the matrices here are column by column.
        m.iter_mut().for_each(SMatrix::transpose_mut);
        Ok((value, m))
    }
}

impl<const N: usize> Bracket<Euclidean<N>, Canonical> for Tensors<'_, N> {
    fn apply<D: Scalar>(
        &self,
        at: &BracketArgs<'_, Euclidean<N>, Canonical, D>,
        alpha: &Vector<Euclidean<N>, D>,
    ) -> Result<Vector<Euclidean<N>, D>, MetricError> {
        self.apply(Part::Reversible, at.g, [alpha, at.s, alpha])
    }

    fn linearise(
        &self,
        at: &BracketArgs<'_, Euclidean<N>, Canonical>,
        alpha: &Vector<Euclidean<N>>,
    ) -> Result<BracketJet<Euclidean<N>>, MetricError> {
        let (value, [along_z, along_s, tensor]) =
            self.linearise(Part::Reversible, at.g, [alpha, at.s, alpha])?;
        Ok(BracketJet { value, along_z, along_s, tensor })
    }

    fn is_poisson(&self) -> bool {
        self.model.is_poisson()
    }

    fn is_forced(&self) -> bool {
        !self.model.is_zero(Part::Gyroscopic)
    }

    fn force<D: Scalar>(
        &self,
        at: &BracketArgs<'_, Euclidean<N>, Canonical, D>,
        w: &Vector<Euclidean<N>, D>,
    ) -> Result<Vector<Euclidean<N>, D>, MetricError> {
        self.apply(Part::Gyroscopic, at.g, [w, at.s, w])
    }

    fn linearise_force(
        &self,
        at: &BracketArgs<'_, Euclidean<N>, Canonical>,
        w: &Vector<Euclidean<N>>,
    ) -> Result<BracketJet<Euclidean<N>>, MetricError> {
        let (value, [along_z, along_s, tensor]) =
            self.linearise(Part::Gyroscopic, at.g, [w, at.s, w])?;
        Ok(BracketJet { value, along_z, along_s, tensor })
    }

    fn is_zero(&self) -> bool {
        self.model.is_zero(Part::Reversible)
    }

    fn annihilates_entropy(&self) -> bool {
        self.model.annihilates_entropy()
    }
}

impl<const N: usize> Dissipation<Euclidean<N>, Canonical> for Tensors<'_, N> {
    fn apply<D: Scalar>(
        &self,
        g: &At<'_, N, D>,
        w: &Vector<Euclidean<N>, D>,
        alpha: &Vector<Euclidean<N>, D>,
    ) -> Result<Vector<Euclidean<N>, D>, MetricError> {
        self.apply(Part::Irreversible, g, [w, w, alpha])
    }

    fn linearise(
        &self,
        g: &At<'_, N, f64>,
        w: &Vector<Euclidean<N>>,
        alpha: &Vector<Euclidean<N>>,
    ) -> Result<DissipationJet<Euclidean<N>>, MetricError> {
        let (value, [along_z, along_w, tensor]) =
            self.linearise(Part::Irreversible, g, [w, w, alpha])?;
        Ok(DissipationJet { value, along_z, along_w, tensor })
    }

    fn tensor(
        &self,
        g: &At<'_, N, f64>,
        w: &Vector<Euclidean<N>>,
    ) -> Result<Matrix<Euclidean<N>>, MetricError> {
        let mut k = SMatrix::<f64, N, N>::zeros();
        let x = g.x.base;
        let w = Covectors { energy: w.as_slice(), entropy: w.as_slice() };
        self.model.tensor(Part::Irreversible, NO_CLOCK, x.as_slice(), w, k.as_mut_slice())?;
        Ok(k.transpose())
    }

    fn is_none(&self) -> bool {
        self.model.is_zero(Part::Irreversible)
    }

    fn adapts(&self) -> bool {
        self.model.adapts()
    }
}

/// A model on a vector space of `N` dimensions with the canonical metric, without further invariants.
pub(crate) struct Modelled<'a, const N: usize> {
    energy: Law<'a>,
    entropy: Law<'a>,
    tensors: Tensors<'a, N>,
}

impl<'a, const N: usize> Modelled<'a, N> {
    pub(crate) fn new(model: &'a dyn Model) -> Self {
        let law = |law| Law { model, law };
        Self { energy: law(ENERGY), entropy: law(ENTROPY), tensors: Tensors { model } }
    }
}

impl<'a, const N: usize> Metriplectic for Modelled<'a, N> {
    type Manifold = Euclidean<N>;
    type Metric = Canonical;
    type Bracket = Tensors<'a, N>;
    type Dissipation = Tensors<'a, N>;
    type Energy = Law<'a>;
    type Entropy = Law<'a>;
    type Invariants = ();

    fn manifold(&self) -> &Euclidean<N> {
        &Euclidean
    }

    fn metric(&self) -> &Canonical {
        &Canonical
    }

    fn bracket(&self) -> &Self::Bracket {
        &self.tensors
    }

    fn dissipation(&self) -> &Self::Dissipation {
        &self.tensors
    }

    fn energy(&self) -> &Law<'a> {
        &self.energy
    }

    fn entropy(&self) -> &Law<'a> {
        &self.entropy
    }

    fn invariants(&self) -> &() {
        &()
    }

    fn second_law(&self) -> SecondLaw {
        self.tensors.model.second_law()
    }
}
