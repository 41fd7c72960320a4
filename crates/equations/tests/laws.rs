//! A rigid body with friction, `x' = x × dH + |dH|² dS − ⟨dH, dS⟩ dH`, written out by hand, and the laws that each
//! wrong answer of it breaks.

use metriplectic_equations::judge::Judge;
use metriplectic_equations::{
    BrokenLaw, Covectors, ENERGY, ENTROPY, Equations, Jet, MetricError, Model, ModelError, Part,
    PointError, SecondLaw, Sizes, laws,
};

/// What is wrong with an answer.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    None,
    /// One law.
    Sizes,
    /// An entry of a slice that is not filled.
    NotFilled,
    Differential,
    Value,
    Chart,
    Coordinates,
    Velocity,
    Production,
    Negative,
    Stage,
    StageRates,
    /// A size of a vector space.
    Size,
    ValueByItself,
    DifferentialByItself,
    Hessian,
    Asymmetric,
    Vector,
    AlongState,
    AlongCovector,
    AlongEntropy,
    Tensor,
    BracketSlope,
    /// The bracket is not skew.
    NotSkew,
    /// The dissipation does not annihilate the covector of the energy.
    NotKept,
}

/// The body, with `H = Σ x_i²/2I_i` and `S = |x|²/2`.
struct Body(Fault);

const RATES: [f64; 3] = [0.1, 0.2, 1.0];
const N: usize = 3;

fn cross(a: &[f64], b: &[f64]) -> [f64; N] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn unit(k: usize) -> [f64; N] {
    std::array::from_fn(|i| f64::from(u8::from(i == k)))
}

impl Body {
    fn has(&self, fault: Fault) -> f64 {
        f64::from(u8::from(self.0 == fault))
    }

    fn differential(law: usize, x: &[f64]) -> [f64; N] {
        std::array::from_fn(|i| if law == ENERGY { RATES[i] * x[i] } else { x[i] })
    }

    /// A part of a friction that depends on the covector of the entropy.
    fn by_entropy(&self, part: Part, w: Covectors<'_>) -> f64 {
        let is_there = self.0 == Fault::AlongEntropy && part == Part::Irreversible;
        if is_there { 1e-3 * w.entropy[0] } else { 0.0 }
    }

    /// `Π α = α × x` or `K_w α`.
    fn part(&self, part: Part, x: &[f64], w: &[f64], alpha: &[f64]) -> [f64; N] {
        let v = match part {
            Part::Reversible => cross(alpha, x),
            Part::Gyroscopic => [0.0; N],
            Part::Irreversible => {
                let (square, along) = (dot(w, w), dot(w, alpha));
                std::array::from_fn(|i| square * alpha[i] - along * w[i])
            }
        };
        let skew = self.has(Fault::NotSkew) * f64::from(u8::from(part == Part::Reversible));
        let kept = self.has(Fault::NotKept) * f64::from(u8::from(part == Part::Irreversible));
        std::array::from_fn(|i| v[i] + (skew + kept) * alpha[i])
    }
}

impl Equations for Body {
    fn sizes(&self) -> Sizes {
        let laws = if self.0 == Fault::Sizes { 1 } else { 2 };
        Sizes { entries: N, directions: N, laws }
    }

    fn values(&self, _: f64, x: &[f64], values: &mut [f64]) {
        for (law, value) in values.iter_mut().enumerate() {
            *value = 0.5 * dot(&Self::differential(law, x), x);
        }
        values[ENTROPY] += if self.0 == Fault::NotFilled { f64::NAN } else { 0.0 };
    }

    fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        self.values(t, x, values);
        values[ENERGY] += self.has(Fault::Value);
        for (law, row) in w.chunks_exact_mut(N).enumerate() {
            row.copy_from_slice(&Self::differential(law, x));
        }
        w[1] += 1e-3 * self.has(Fault::Differential);
    }

    fn velocity(&self, _: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
        let [w, s] = [ENERGY, ENTROPY].map(|law| Self::differential(law, x));
        let friction = self.part(Part::Irreversible, x, &w, &s);
        let turned = self.part(Part::Reversible, x, &w, &w);
        (0..N).for_each(|i| v[i] = turned[i] + friction[i]);
        v[0] += 1e-3 * self.has(Fault::Velocity);
        let wrong = 0.5 * self.has(Fault::Production) + 2.0 * self.has(Fault::Negative);
        Some(dot(&s, &friction) * (1.0 - wrong))
    }

    fn second_law(&self) -> SecondLaw {
        SecondLaw::Exact
    }

    fn is_vector_space(&self) -> bool {
        true
    }

    fn scales(&self, x: &[f64], sizes: &mut [f64]) {
        (0..N).for_each(|i| sizes[i] = x[i].abs());
        if self.0 == Fault::Size {
            sizes[2] = 1.0;
        }
    }

    fn chart(&self, x: &[f64], q: &[f64], y: &mut [f64]) {
        (0..N).for_each(|i| y[i] = x[i] + q[i]);
        y[2] += 1e-3 * self.has(Fault::Chart);
    }

    fn coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) -> bool {
        (0..N).for_each(|i| q[i] = (y[i] - x[i]) * (1.0 + 1e-3 * self.has(Fault::Coordinates)));
        true
    }

    fn stage_coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) {
        (0..N).for_each(|i| q[i] = (y[i] - x[i]) * (1.0 + 1e-3 * self.has(Fault::Stage)));
    }

    fn stage_rates(&self, _: &[f64], _: &[f64], _: &[f64], v: &[f64], rates: &mut [f64]) {
        rates.copy_from_slice(v);
        rates[1] += 1e-3 * self.has(Fault::StageRates);
    }

    fn model(&self) -> Option<&dyn Model> {
        Some(self)
    }
}

impl Model for Body {
    fn is_zero(&self, part: Part) -> bool {
        part == Part::Gyroscopic
    }

    fn value(&self, law: usize, _: f64, x: &[f64]) -> f64 {
        0.5 * dot(&Self::differential(law, x), x) + self.has(Fault::ValueByItself)
    }

    fn jet(&self, law: usize, t: f64, x: &[f64], df: &mut [f64]) -> f64 {
        df.copy_from_slice(&Self::differential(law, x));
        df[0] += 1e-3 * self.has(Fault::DifferentialByItself);
        self.value(law, t, x)
    }

    fn hessian(&self, law: usize, t: f64, x: &[f64], df: &mut [f64], hf: &mut [f64]) -> f64 {
        hf.fill(0.0);
        (0..N).for_each(|i| hf[i * N + i] = if law == ENERGY { RATES[i] } else { 1.0 });
        hf[0] += 1e-3 * self.has(Fault::Hessian);
        hf[1] += 1e-3 * self.has(Fault::Asymmetric);
        self.jet(law, t, x, df)
    }

    fn differential_at(&self, law: usize, _: f64, x: &[f64], q: &[f64], df: &mut [f64]) {
        let y: [f64; N] = std::array::from_fn(|i| x[i] + q[i]);
        df.copy_from_slice(&Self::differential(law, &y));
    }

    fn independence(&self, _: f64, _: &[f64], _: &mut [f64]) {}

    fn metric(&self, _: &[f64], _: &[f64], g: &mut [f64]) {
        (0..N * N).for_each(|k| g[k] = f64::from(u8::from(k % (N + 1) == 0)));
    }

    fn check_metric(&self, _: &[f64], _: bool) -> Result<(), MetricError> {
        Ok(())
    }

    fn metric_slopes(&self, _: &[f64], _: &mut [f64]) -> bool {
        false
    }

    fn flat(&self, _: &[f64], d: &[f64], w: &mut [f64]) -> Result<(), MetricError> {
        w.copy_from_slice(d);
        Ok(())
    }

    fn tensor(
        &self,
        part: Part,
        _: f64,
        x: &[f64],
        w: Covectors<'_>,
        tensor: &mut [f64],
    ) -> Result<(), MetricError> {
        for j in 0..N {
            let column = self.part(part, x, w.energy, &unit(j));
            (0..N).for_each(|i| tensor[i * N + j] = column[i]);
        }
        tensor[2] += 1e-3 * self.has(Fault::Tensor);
        Ok(())
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
        let y: [f64; N] = std::array::from_fn(|i| x[i] + q[i]);
        v.copy_from_slice(&self.part(part, &y, w.energy, alpha));
        v[1] += 1e-3 * self.has(Fault::Vector) + self.by_entropy(part, w);
        Ok(())
    }

    fn linearise(
        &self,
        part: Part,
        t: f64,
        x: &[f64],
        w: Covectors<'_>,
        alpha: &[f64],
        jet: &mut Jet<'_>,
    ) -> Result<(), MetricError> {
        jet.value.copy_from_slice(&self.part(part, x, w.energy, alpha));
        jet.value[1] += self.by_entropy(part, w);
        self.tensor(part, t, x, w, jet.tensor)?;
        let (w, along) = (w.energy, dot(w.energy, alpha));
        for k in 0..N {
            let turned = if part == Part::Reversible { cross(alpha, &unit(k)) } else { [0.0; N] };
            for i in 0..N {
                jet.along_x[i * N + k] = turned[i];
                let diagonal = if i == k { along } else { 0.0 };
                let turned = 2.0 * w[k] * alpha[i] - diagonal - w[i] * alpha[k];
                jet.along_w[i * N + k] = if part == Part::Reversible { 0.0 } else { turned };
            }
        }
        jet.along_x[3] += 1e-3 * self.has(Fault::AlongState);
        jet.along_w[3] += 1e-3 * self.has(Fault::AlongCovector);
        Ok(())
    }

    fn bracket_slope(
        &self,
        _: f64,
        _: &[f64],
        [u, _]: [&[f64]; 2],
        _: &[f64],
        slope: &mut [f64],
    ) -> Result<(), MetricError> {
        for j in 0..N {
            let column = cross(&unit(j), u);
            (0..N).for_each(|i| slope[i * N + j] = column[i]);
        }
        slope[1] += 1e-3 * self.has(Fault::BracketSlope);
        Ok(())
    }

    fn bracket_slope_of(
        &self,
        t: f64,
        x: &[f64],
        along: [&[f64]; 2],
        entropy: &[f64],
        alpha: &[f64],
        slope: &mut [f64],
    ) -> Result<(), MetricError> {
        let mut tensor = [0.0; N * N];
        self.bracket_slope(t, x, along, entropy, &mut tensor)?;
        (0..N).for_each(|i| slope[i] = dot(&tensor[i * N..][..N], alpha));
        Ok(())
    }

    fn generator(&self, _: usize, _: &[f64], _: &mut [f64], _: &mut [f64]) -> bool {
        false
    }

    fn action(&self, _: usize, _: &[f64], _: f64, _: &mut [f64], _: &mut [f64]) {}
}

const STATE: [f64; N] = [0.8, -0.5, 0.3];
const DIRECTION: [f64; N] = [0.01, 0.02, -0.015];

fn broken(fault: Fault) -> Result<(), BrokenLaw> {
    let body = Body(fault);
    laws::equations(&body, 0.0, &STATE, &DIRECTION)?;
    laws::model(&body, 0.0, &STATE, &DIRECTION)
}

#[test]
fn a_body_by_hand_keeps_the_laws_of_an_implementation() {
    assert_eq!(broken(Fault::None), Ok(()));
}

#[test]
fn each_wrong_answer_breaks_the_law_of_its_name() {
    for (fault, expected) in [
        (Fault::NotFilled, "the values of all laws"),
        (Fault::Differential, "⟨dF, u⟩ is the derivative of F"),
        (Fault::Value, "the differentials come with the values"),
        (Fault::Chart, "φ_x(0) = x"),
        (Fault::Coordinates, "φ_x⁻¹(φ_x(u)) = u"),
        (Fault::Velocity, "the velocity conserves H and L_a"),
        (Fault::Production, "⟨dS, x'⟩ is the production"),
        (Fault::Negative, "the production is not negative"),
        (Fault::Stage, "ψ_x⁻¹(ψ_x(u)) = u"),
        (Fault::StageRates, "the rates at ψ_x(0) are the velocity"),
        (Fault::Size, "the sizes of a vector space are |x_i|"),
        (Fault::ValueByItself, "a law by itself has its value"),
        (Fault::DifferentialByItself, "a law by itself has its differential"),
        (Fault::Hessian, "a Hessian is the derivative of the differential"),
        (Fault::Asymmetric, "a Hessian is symmetric"),
        (Fault::Vector, "derivatives come with the vector of a part"),
        (Fault::AlongState, "along_x is the derivative along the state"),
        (Fault::AlongCovector, "along_w is the derivative along a covector"),
        (Fault::AlongEntropy, "a friction has its derivative along the entropy"),
        (Fault::Tensor, "the columns of a tensor are the vectors of its part"),
        (Fault::BracketSlope, "the slope of the bracket is its derivative"),
    ] {
        let found = broken(fault).expect_err("a law is broken").law;
        assert_eq!(found, expected, "{fault:?}");
    }
}

#[test]
fn the_judge_finds_what_is_wrong_with_a_model_by_hand() {
    let verdict = |fault| Judge::of(&Body(fault), 0.0).verify(&STATE, 0.1);
    assert_eq!(verdict(Fault::None), Ok(()));
    assert!(matches!(verdict(Fault::NotSkew), Err(ModelError::BracketNotSkew { .. })));
    assert!(matches!(verdict(Fault::NotKept), Err(ModelError::EnergyNotKept { .. })));
    assert!(matches!(verdict(Fault::Sizes), Err(ModelError::BadSizes { laws: 1, .. })));
    let short = Judge::of(&Body(Fault::None), 0.0).verify(&STATE[..2], 0.1);
    assert!(matches!(short, Err(ModelError::Start(PointError::Length { found: 2, expected: 3 }))));
    let report = Judge::of(&Body(Fault::None), 0.0).report(&STATE);
    assert!(report.laws.len() >= 6 && report.judged == 17, "{report}");
}
