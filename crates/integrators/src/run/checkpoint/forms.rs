//! The saved forms of types that are also written for readers. There they have plain numbers, and a type has one
//! form in serde: so each has a second one here, by which the compiler reads and writes the type itself.

use metriplectic_dynamics::SecondLaw;
use metriplectic_dynamics::invariants::Kind;
use metriplectic_equations::Evaluated;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::run::certificate::{
    Certificate, EventCount, InvariantBalance, MisjudgedSize, ProjectedSteps, RestInTime,
    StageBalance, UnsureEvent,
};
use crate::run::ending::Ending;
use crate::run::jump::{Exchanged, JumpBalance};
use crate::step::exact::{self, ExactForm};
use crate::step::{Effort, LedgerErrors, LedgerSummary, LimitingSites, NoiseSummary, Promises};

#[derive(Serialize, Deserialize)]
#[serde(remote = "Certificate", deny_unknown_fields)]
struct CertificateForm {
    #[serde(with = "exact")]
    initial_energy: f64,
    #[serde(with = "exact")]
    max_energy_error: f64,
    #[serde(with = "exact")]
    energy_scale: f64,
    #[serde(with = "exact")]
    initial_entropy: f64,
    #[serde(with = "exact")]
    min_entropy_increment: f64,
    #[serde(with = "exact")]
    entropy_gained: f64,
    entropy_falls: usize,
    #[serde(with = "exact")]
    min_entropy_slope: f64,
    #[serde(with = "exact")]
    invariants: Vec<InvariantBalance>,
    #[serde(with = "exact")]
    max_manifold_defect: f64,
    steps: usize,
    #[serde(with = "exact")]
    smallest_step: f64,
    #[serde(with = "exact")]
    largest_step: f64,
    rejected: usize,
    falls_avoided: usize,
    projected_steps: ProjectedSteps,
    #[serde(with = "exact")]
    stages: Option<StageBalance>,
    effort: Effort,
    worst_iterations: usize,
    #[serde(with = "exact")]
    local_error: Option<f64>,
    #[serde(with = "exact")]
    misjudged_size: Option<MisjudgedSize>,
    #[serde(default, with = "exact")]
    rest_in_time: Option<RestInTime>,
    limiting_sites: LimitingSites,
    checked_states: usize,
    #[serde(default)]
    verified_before: bool,
    promises: Promises,
    #[serde(with = "SecondLawForm")]
    second_law: SecondLaw,
    #[serde(with = "exact")]
    friction: f64,
    // It is that of the point.
    #[serde(skip)]
    exchange: Option<LedgerSummary>,
    #[serde(default, with = "exact")]
    exchange_errors: Option<LedgerErrors>,
    #[serde(with = "exact")]
    jumps: Vec<JumpBalance>,
    #[serde(default)]
    event_counts: Vec<EventCount>,
    #[serde(with = "exact", default)]
    unsure_events: Vec<UnsureEvent>,
    #[serde(default)]
    events_at_start: Vec<String>,
    #[serde(with = "exact")]
    exchanged_in_jumps: Exchanged,
    // It is that of the method.
    #[serde(skip)]
    noise: Option<NoiseSummary>,
    projected: bool,
    #[serde(default, with = "exact")]
    default_friction: Option<f64>,
    // It is that of the system.
    #[serde(skip)]
    evaluated: Vec<Evaluated>,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "InvariantBalance")]
struct InvariantBalanceForm {
    #[serde(with = "KindForm")]
    kind: Kind,
    #[serde(with = "exact")]
    initial: f64,
    #[serde(with = "exact")]
    max_error: f64,
    #[serde(with = "exact")]
    scale: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "JumpBalance")]
struct JumpBalanceForm {
    name: String,
    count: usize,
    #[serde(with = "exact")]
    work: f64,
    #[serde(with = "exact")]
    heat: f64,
    #[serde(with = "exact")]
    least_rise: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "UnsureEvent")]
struct UnsureEventForm {
    name: String,
    steps: usize,
    #[serde(with = "exact")]
    first: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Exchanged")]
struct ExchangedForm {
    #[serde(with = "exact")]
    energy: [f64; 2],
    #[serde(with = "exact")]
    entropy: [f64; 2],
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "StageBalance")]
struct StageBalanceForm {
    #[serde(with = "exact")]
    defect: f64,
    #[serde(with = "exact")]
    surplus: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "LedgerErrors")]
#[non_exhaustive]
struct LedgerErrorsForm {
    #[serde(with = "exact")]
    work: f64,
    #[serde(with = "exact")]
    heat: f64,
    #[serde(with = "exact")]
    entropy: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "MisjudgedSize")]
struct MisjudgedSizeForm {
    direction: usize,
    #[serde(with = "exact")]
    judged: f64,
    #[serde(with = "exact")]
    reached: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "RestInTime")]
struct RestInTimeForm {
    steps: usize,
    #[serde(with = "exact")]
    time: f64,
    #[serde(with = "exact")]
    longest: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Ending")]
enum EndingForm {
    Span,
    Rest {
        #[serde(with = "exact")]
        speed: f64,
        #[serde(with = "exact")]
        largest: f64,
    },
    Event {
        index: usize,
    },
    Stopped,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "SecondLaw")]
#[non_exhaustive]
enum SecondLawForm {
    NoEntropy,
    Exact,
    Published,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Kind")]
#[non_exhaustive]
enum KindForm {
    Casimir,
    Momentum,
}

macro_rules! exact_form {
    ($($form:ident of $type:ty),*) => {$(
        impl ExactForm for $type {
            fn write<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                $form::serialize(self, serializer)
            }

            fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                $form::deserialize(deserializer)
            }
        }
    )*};
}

exact_form! {
    CertificateForm of Certificate,
    InvariantBalanceForm of InvariantBalance,
    JumpBalanceForm of JumpBalance,
    UnsureEventForm of UnsureEvent,
    ExchangedForm of Exchanged,
    StageBalanceForm of StageBalance,
    LedgerErrorsForm of LedgerErrors,
    MisjudgedSizeForm of MisjudgedSize,
    RestInTimeForm of RestInTime,
    EndingForm of Ending
}
