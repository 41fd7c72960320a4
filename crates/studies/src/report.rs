//! What an example says to other programs.

use std::io;

use metriplectic_integrators::{Certificate, State};
use metriplectic_manifolds::Manifold;
use serde_json::{Map, Value};

use crate::print;

/// One JSON object: the fields of a certificate, `max_relative_energy_error`, `final_state` with the
/// entries of the last point, and what an example adds.
#[derive(Clone, Debug)]
pub struct Report(Map<String, Value>);

impl Report {
    /// The report of a run that ended in this state.
    ///
    /// # Errors
    ///
    /// [`serde_json::Error`] if the certificate has no JSON form.
    pub fn new<M: Manifold>(
        certificate: &Certificate,
        end: &State<M>,
    ) -> Result<Self, serde_json::Error> {
        let Value::Object(fields) = serde_json::to_value(certificate)? else {
            return Err(serde::ser::Error::custom("a certificate is not an object"));
        };
        let error = certificate.max_relative_energy_error();
        let report = Self(fields).with("max_relative_energy_error", error);
        Ok(report.with("final_state", M::entries(&end.point)))
    }

    /// The report with one entry more, or another value of it.
    #[must_use]
    pub fn with(mut self, key: &str, value: impl Into<Value>) -> Self {
        self.0.insert(key.to_owned(), value.into());
        self
    }

    /// Prints it in one line to standard output.
    ///
    /// # Errors
    ///
    /// Those of [`print()`].
    pub fn print(self) -> io::Result<()> {
        print(Value::Object(self.0))
    }
}
