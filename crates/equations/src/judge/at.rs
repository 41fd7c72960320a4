//! A state at which laws are checked.

pub(super) use super::numbers::{all_finite, dot, max_abs};
use super::table::{Row, Table, zeros};
use crate::{Covectors, ENERGY, ENTROPY, MetricError, Model, ModelError, Part};

/// A model at a state and a time.
#[derive(Clone, Copy)]
pub(crate) struct At<'a> {
    pub(crate) model: &'a dyn Model,
    pub(crate) t: f64,
    pub(crate) x: &'a [f64],
}

/// Value, differential and Hessian of a law.
#[derive(Clone, Debug)]
pub(crate) struct Jet2 {
    pub(crate) value: f64,
    pub(crate) df: Row,
    pub(crate) hf: Table,
}

impl Jet2 {
    pub(crate) fn is_finite(&self) -> bool {
        let all = self.df.iter().chain(self.hf.entries());
        self.value.is_finite() && all.into_iter().all(|number| number.is_finite())
    }
}

/// The name of a law in errors.
pub(super) const fn name(law: usize) -> &'static str {
    match law {
        ENERGY => "energy",
        ENTROPY => "entropy",
        _ => "invariant",
    }
}

impl<'a> At<'a> {
    /// The number of directions.
    pub(crate) fn n(&self) -> usize {
        self.model.sizes().directions
    }

    /// The numbers of all laws.
    pub(super) fn laws(&self) -> std::ops::Range<usize> {
        0..self.model.sizes().laws
    }

    /// The numbers of the further invariants.
    pub(super) fn invariants(&self) -> std::ops::Range<usize> {
        ENTROPY + 1..self.laws().end
    }

    /// Moves the model to another state.
    pub(super) const fn moved_to<'b>(&self, x: &'b [f64]) -> At<'b>
    where
        'a: 'b,
    {
        At { model: self.model, t: self.t, x }
    }

    /// The state `φ_x(q)`.
    pub(crate) fn chart(&self, q: &[f64]) -> Row {
        let mut y = zeros(self.x.len());
        self.model.chart(self.x, q, &mut y);
        y
    }

    pub(crate) fn scales(&self) -> Row {
        let mut sizes = zeros(self.n());
        self.model.scales(self.x, &mut sizes);
        sizes
    }

    pub(super) fn value(&self, law: usize) -> f64 {
        self.model.value(law, self.t, self.x)
    }

    /// The value and the differential of a law.
    pub(super) fn jet(&self, law: usize) -> (f64, Row) {
        let mut df = zeros(self.n());
        (self.model.jet(law, self.t, self.x, &mut df), df)
    }

    pub(crate) fn jet2(&self, law: usize) -> Jet2 {
        let n = self.n();
        let (mut df, mut hf) = (zeros(n), Table::zeros(n));
        let value = self.model.hessian(law, self.t, self.x, &mut df, hf.entries_mut());
        Jet2 { value, df, hf }
    }

    /// Value, differential and Hessian of a law, which must be finite.
    pub(super) fn finite_jet2(&self, law: usize) -> Result<Jet2, ModelError> {
        let jet = self.jet2(law);
        if jet.is_finite() {
            Ok(jet)
        } else {
            Err(ModelError::DerivativeNotFinite { field: name(law), point: self.point() })
        }
    }

    /// The tensor of a part.
    pub(super) fn tensor(&self, part: Part, w: Covectors<'_>) -> Result<Table, MetricError> {
        let mut tensor = Table::zeros(self.n());
        self.model.tensor(part, self.t, self.x, w, tensor.entries_mut())?;
        Ok(tensor)
    }

    /// The vector of a part.
    pub(super) fn apply(
        &self,
        part: Part,
        w: Covectors<'_>,
        alpha: &[f64],
    ) -> Result<Row, MetricError> {
        let zero = zeros(self.n());
        let mut v = zeros(self.n());
        self.model.apply(part, self.t, (self.x, &zero), w, alpha, &mut v)?;
        Ok(v)
    }

    /// A part with its derivatives.
    pub(super) fn linearise(
        &self,
        part: Part,
        w: Covectors<'_>,
        alpha: &[f64],
    ) -> Result<PartJet, MetricError> {
        let n = self.n();
        let [mut along_x, mut along_w, mut tensor] = [0; 3].map(|_| Table::zeros(n));
        let mut value = zeros(n);
        let mut jet = crate::Jet {
            value: &mut value,
            along_x: along_x.entries_mut(),
            along_w: along_w.entries_mut(),
            tensor: tensor.entries_mut(),
        };
        self.model.linearise(part, self.t, self.x, w, alpha, &mut jet)?;
        Ok(PartJet { value, along_x, along_w, tensor })
    }

    /// The entries of the state.
    pub(super) fn point(&self) -> Vec<f64> {
        self.x.to_vec()
    }

    /// The error of a metric that cannot be used here.
    pub(super) fn unusable(&self, source: MetricError) -> ModelError {
        ModelError::Metric { source, point: self.point() }
    }
}

/// A vector with its derivatives.
pub(super) struct PartJet {
    pub(super) value: Row,
    pub(super) along_x: Table,
    pub(super) along_w: Table,
    pub(super) tensor: Table,
}

/// A state at which laws are judged, with the differentials of the two fields there.
pub(super) struct Place<'a> {
    pub(super) at: At<'a>,
    /// The sizes of the coordinates.
    pub(super) units: &'a [f64],
    pub(super) energy: Jet2,
    pub(super) entropy: Jet2,
}

impl Place<'_> {
    /// The differentials of energy and entropy.
    pub(super) fn differentials(&self) -> Covectors<'_> {
        Covectors { energy: &self.energy.df, entropy: &self.entropy.df }
    }
}
