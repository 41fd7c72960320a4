//! The parts of a system apart.

use crate::room::with_numbers;
use crate::{Equations, MetricError, Path, Paths, SecondLaw};

/// A part of the motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// `Π α`, which may depend on the covector of the entropy.
    Reversible,
    /// The gyroscopic force `f(w)`: it does no work, but for that of ports and baths, which are booked.
    Gyroscopic,
    /// `K_w α`, which annihilates the covector `w` of the energy.
    Irreversible,
}

/// The covectors that the parts of a motion depend on: differentials, or discrete gradients.
#[derive(Clone, Copy, Debug)]
pub struct Covectors<'a> {
    /// The covector of the energy: a dissipation annihilates it, and a force acts on it.
    pub energy: &'a [f64],
    /// The covector of the entropy: some brackets are made of it.
    pub entropy: &'a [f64],
}

/// A vector at a state with its derivatives: matrices of `n × n` numbers.
#[derive(Debug)]
pub struct Jet<'a> {
    /// The vector `Π α`, `f(w)` or `K_w α`.
    pub value: &'a mut [f64],
    /// Its derivatives along the state, in the chart there.
    pub along_x: &'a mut [f64],
    /// Its derivatives along the covector that the part depends on: that of the entropy for a bracket and for a force, that of
    /// the energy for a dissipation.
    pub along_w: &'a mut [f64],
    /// Its derivatives along `α`, or along `w` for a force: the tensor.
    pub tensor: &'a mut [f64],
}

/// A system whose parts are known apart: the laws one by one, the metric, and the tensors with their derivatives. The judge of
/// models asks these questions.
///
/// Displacements `q` and covectors are in the frame of the chart at `x`, also where a part is evaluated at `φ_x(q)`.
///
/// Laws ([`laws::model`](crate::laws::model)): 1. the parts add up to the velocity; 2. the columns of a tensor are the vectors of
/// its part; 3. derivatives are those of the values; 4. a Hessian is symmetric, and the derivative of the differential; 5. derivatives
/// along [parameters](Self::parameters) are those of the values ([`Judge::check_parameters`](crate::judge::Judge::check_parameters)).
pub trait Model: Equations {
    /// Returns whether a part is zero by construction.
    fn is_zero(&self, part: Part) -> bool;

    /// Returns whether the bracket is to satisfy the Jacobi identity.
    fn is_poisson(&self) -> bool {
        true
    }

    /// Returns whether the dissipation is defined by the covectors that it annihilates, so that the further invariants are
    /// projected out of it too. Any other dissipation must annihilate them by itself.
    fn adapts(&self) -> bool {
        false
    }

    /// Evaluates one law at a state.
    fn value(&self, law: usize, t: f64, x: &[f64]) -> f64;

    /// Returns whether the bracket annihilates every covector of the entropy by construction: it is made of it, or zero.
    fn annihilates_entropy(&self) -> bool {
        self.is_zero(Part::Reversible)
    }

    /// Returns whether the entropy is constant by construction, so that no friction moves a state.
    fn has_constant_entropy(&self) -> bool {
        self.second_law() == SecondLaw::NoEntropy
    }

    /// Returns whether the metric is that in which the frame of each chart is orthonormal, by construction. On a vector space geodesics
    /// are straight lines then.
    fn has_canonical_metric(&self) -> bool {
        false
    }

    /// Returns the paths of steps, if they are known. Without them steps follow the straight lines of a vector space with the canonical
    /// metric, and the [lines of the charts](crate::ByCharts) elsewhere.
    fn paths(&self) -> Option<&dyn Paths> {
        None
    }

    /// Returns whether derivatives are formed by differences, and so have two thirds of the digits.
    fn has_derivatives_by_differences(&self) -> bool {
        false
    }

    /// Evaluates one law along two vectors in the chart at `x`, at the hyper-dual state `φ_x(u ε₁ + v ε₂)`: `f`, `⟨df, u⟩`, `⟨df, v⟩` and
    /// `f''(u, v)`. The default forms the Hessian.
    fn along(&self, law: usize, t: f64, x: &[f64], [u, v]: [&[f64]; 2]) -> [f64; 4] {
        let n = u.len();
        with_numbers(n * (n + 1), |room| {
            let (df, hf) = room.split_at_mut(n);
            let value = self.hessian(law, t, x, df, hf);
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let rows = hf.chunks_exact(n).zip(u);
            let second = rows.map(|(row, u)| u * dot(row, v)).sum();
            [value, dot(df, u), dot(df, v), second]
        })
    }

    /// Evaluates the first and the second derivative of all laws along the [curve](Paths::curve) of a path, at a fraction of its way. The
    /// default asks for the curve, for each law along its velocity, and for its differential along the acceleration.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the path cannot be followed.
    fn along_curve(
        &self,
        t: f64,
        paths: (&dyn Paths, Path),
        start: (&[f64], &[f64], f64),
        to: &mut [[f64; 2]],
    ) -> Result<(), MetricError> {
        let (x, n) = (start.0, start.1.len());
        with_numbers(x.len() + 3 * n, |room| {
            let (y, room) = room.split_at_mut(x.len());
            let (df, room) = room.split_at_mut(n);
            let (v, a) = room.split_at_mut(n);
            paths.0.curve(paths.1, start, y, [&mut *v, &mut *a])?;
            let turns = a.iter().any(|a| a.abs() > 0.0);
            for (law, to) in to.iter_mut().enumerate() {
                let [_, first, _, second] = self.along(law, t, y, [v, v]);
                let bent = if turns {
                    self.jet(law, t, y, df);
                    df.iter().zip(&*a).map(|(df, a)| df * a).sum()
                } else {
                    0.0
                };
                *to = [first, second + bent];
            }
            Ok(())
        })
    }

    /// Evaluates one law with its differential.
    fn jet(&self, law: usize, t: f64, x: &[f64], df: &mut [f64]) -> f64;

    /// Evaluates one law with its differential and its Hessian in the chart at `x`.
    fn hessian(&self, law: usize, t: f64, x: &[f64], df: &mut [f64], hf: &mut [f64]) -> f64;

    /// Computes the differential of one law at `φ_x(q)`, in the chart at `x`.
    fn differential_at(&self, law: usize, t: f64, x: &[f64], q: &[f64], df: &mut [f64]);

    /// Evaluates the Hessian of one law at `φ_x(q)`, in the chart at `x`. The default is that of differences of
    /// [`differential_at`](Self::differential_at).
    fn hessian_at(&self, law: usize, t: f64, x: &[f64], q: &[f64], hf: &mut [f64]) {
        let n = q.len();
        with_numbers(4 * n, |room| {
            let (sizes, room) = room.split_at_mut(n);
            let (at, room) = room.split_at_mut(n);
            let (before, after) = room.split_at_mut(n);
            self.scales(x, sizes);
            let largest = sizes.iter().fold(f64::MIN_POSITIVE, |most, size| most.max(*size));
            for j in 0..n {
                let h = f64::EPSILON.cbrt() * if sizes[j] > 0.0 { sizes[j] } else { largest };
                at.copy_from_slice(q);
                at[j] = q[j] + h;
                self.differential_at(law, t, x, at, after);
                at[j] = q[j] - h;
                self.differential_at(law, t, x, at, before);
                (0..n).for_each(|i| hf[i * n + j] = (after[i] - before[i]) / (2.0 * h));
            }
        });
    }

    /// Computes for each further invariant the smallest fraction of its differential that is independent of those of the laws
    /// before it.
    fn independence(&self, t: f64, x: &[f64], fractions: &mut [f64]);

    /// Evaluates the matrix of the metric at `φ_x(q)`, without a check.
    fn metric(&self, x: &[f64], q: &[f64], g: &mut [f64]);

    /// Checks that the metric at a state can be used, and with `geodesics` that it has one from there.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if its matrix is not symmetric and positive, or a geodesic cannot be followed.
    fn check_metric(&self, x: &[f64], geodesics: bool) -> Result<(), MetricError>;

    /// Evaluates the derivatives of the metric along the directions of the chart, `n` matrices; returns `false` for a metric that is
    /// constant by construction.
    fn metric_slopes(&self, x: &[f64], slopes: &mut [f64]) -> bool;

    /// Computes the covector `♭d` of a vector at a state.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the metric cannot be used there.
    fn flat(&self, x: &[f64], d: &[f64], w: &mut [f64]) -> Result<(), MetricError>;

    /// Evaluates the tensor of the bracket or of the dissipation at a state.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the metric cannot be used there.
    fn tensor(
        &self,
        part: Part,
        t: f64,
        x: &[f64],
        w: Covectors<'_>,
        tensor: &mut [f64],
    ) -> Result<(), MetricError>;

    /// Evaluates the vector of a part at `φ_x(q)`, of the state and the displacement in `place`. A force has no `α`.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the metric cannot be used there.
    fn apply(
        &self,
        part: Part,
        t: f64,
        place: (&[f64], &[f64]),
        w: Covectors<'_>,
        alpha: &[f64],
        v: &mut [f64],
    ) -> Result<(), MetricError>;

    /// Evaluates the vector of a part at a state with its derivatives, as implicit methods use them.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the metric cannot be used there.
    fn linearise(
        &self,
        part: Part,
        t: f64,
        x: &[f64],
        w: Covectors<'_>,
        alpha: &[f64],
        jet: &mut Jet<'_>,
    ) -> Result<(), MetricError>;

    /// Evaluates the derivatives of `K_w α` along the covector of the entropy, and returns whether a friction may depend on it. The default
    /// is that of one that does not, by construction.
    ///
    /// [`linearise`](Self::linearise) leaves them out, because Newton's method needs no more derivatives than are worth their cost. The
    /// derivative of a step needs all.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the metric cannot be used there.
    fn friction_along_entropy(
        &self,
        t: f64,
        x: &[f64],
        w: Covectors<'_>,
        alpha: &[f64],
        slope: &mut [f64],
    ) -> Result<bool, MetricError> {
        let _ = (t, x, w, alpha, slope);
        Ok(false)
    }

    /// Evaluates the derivative of the tensor of the bracket along the direction `u` at a state, with the covector of
    /// the entropy that changes by `ds`.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the metric cannot be used there.
    fn bracket_slope(
        &self,
        t: f64,
        x: &[f64],
        along: [&[f64]; 2],
        entropy: &[f64],
        slope: &mut [f64],
    ) -> Result<(), MetricError>;

    /// Evaluates the derivative of `Π α` in the same way.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the metric cannot be used there.
    fn bracket_slope_of(
        &self,
        t: f64,
        x: &[f64],
        along: [&[f64]; 2],
        entropy: &[f64],
        alpha: &[f64],
        slope: &mut [f64],
    ) -> Result<(), MetricError>;

    /// Returns the number of parameters `θ` along which the model knows the derivatives of its laws and of its parts; 0 for one that knows
    /// none. Then those of its steps are exact along parameters too, on a vector space with the canonical metric, where a
    /// [derivative by differences](Self::has_derivatives_by_differences) is not.
    ///
    /// The parameters are those of the systems at whose values the model stands, in their order.
    fn parameters(&self) -> usize {
        0
    }

    /// Computes the derivative `∂F/∂θ_k` of one law along a parameter, counted from 0, and that of its differential, `∂dF/∂θ_k`, at a
    /// state. The default is not a number.
    fn law_along_parameter(
        &self,
        law: usize,
        parameter: usize,
        t: f64,
        x: &[f64],
        df: &mut [f64],
    ) -> f64 {
        let _ = (law, parameter, t, x);
        df.fill(f64::NAN);
        f64::NAN
    }

    /// Computes the derivative of the vector `Π α`, `f(w)` or `K_w α` of a part along a parameter, counted from 0, at a state with
    /// covectors that stay as they are. The default is not a number.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the metric cannot be used there.
    fn part_along_parameter(
        &self,
        (part, parameter): (Part, usize),
        t: f64,
        x: &[f64],
        w: Covectors<'_>,
        alpha: &[f64],
        v: &mut [f64],
    ) -> Result<(), MetricError> {
        let _ = (part, parameter, t, x, w, alpha);
        v.fill(f64::NAN);
        Ok(())
    }

    /// Computes the velocity with which the symmetry of a momentum moves a state, in the chart there, and where it moves it at the
    /// time 0; returns `false` if the invariant comes without one.
    fn generator(
        &self,
        invariant: usize,
        x: &[f64],
        moved: &mut [f64],
        at_zero: &mut [f64],
    ) -> bool;

    /// Computes the state to which the symmetry of a momentum leads after a time, and the derivative of this map in the charts
    /// at both states.
    fn action(&self, invariant: usize, x: &[f64], time: f64, y: &mut [f64], tangent: &mut [f64]);
}
