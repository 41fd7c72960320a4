//! Errors as exceptions, whose messages speak of what a user of Python has written.

use metriplectic_dynamics::ModelError as Broken;
use metriplectic_integrators::step::StateSpace;
use metriplectic_integrators::{RunError as NotRun, TangentError};
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyRuntimeError, PyValueError};
use pyo3::prelude::*;

create_exception!(
    metriplectic,
    Error,
    PyException,
    "The exceptions of this package: ModelError, SpanError, RunError and TraceError."
);
create_exception!(
    metriplectic,
    ModelError,
    Error,
    "A model that breaks one of its laws, or a start that is no state of its space. The message names the law, the state and the \
     size of the violation."
);
create_exception!(
    metriplectic,
    SpanError,
    Error,
    "A time, a step size, a tolerance or outputs with which no run can start."
);
create_exception!(
    metriplectic,
    RunError,
    Error,
    "A run that did not reach its end. `partial` is the run up to the step that failed, or None if it had not started."
);
create_exception!(
    metriplectic,
    TraceError,
    Error,
    "A Python function that cannot be recorded. The message has the line, the reason and the remedy."
);

/// Words of Rust, and what a user of Python calls the same.
const WORDS: &[(&str, &str)] = &[
    (", or ask for `SecondLaw::Published`", ""),
    ("ask for `SecondLaw::Published`, which does not promise the second law, or ", ""),
    (
        "; say how many with `Span::steps`",
        "; say how many by `steps=`, or when the run ends by `t=`",
    ),
    ("list it by `.momentum(..)`", "list it in `momenta=`"),
    (", or ask for `ProjectedDissipation`", ""),
    ("is `AlmostPoisson::field(..)`", "is given by `almost_poisson=`"),
    ("`AlmostPoisson::field(..)`", "`almost_poisson=`"),
    (
        "open the system by `.opened()`, which books the work of the time, and answer `Equations::energy_depends_on_time` and `Equations::power`; a closed run asks at the time 0 alone",
        "give the energy an argument `t`, so that the work of the time is booked",
    ),
    (
        "the closure loses a derivative, as `x.re` and `Real::from(f64)` do; compute with `Real` from the arguments to the result, and use `.re` only to choose a branch",
        "the recorded function has a kink there, as `np.where` and `np.abs` make one; start elsewhere",
    ),
    (
        "the closure loses the derivative of `t`, as `t.re` does; compute with `t` as a `Real`. In a system of your own correct `Equations::power`",
        "the recorded function has a kink in `t` there; start elsewhere",
    ),
    ("write `norm_squared()`, or", "write `x @ x`, or"),
    (
        "another value, or a `Family`, whose derivatives are exact",
        "another value, or name its size by `sizes={..}`",
    ),
    ("name its time by `.corners([..])`", "name its time by `corners=[..]`"),
    ("name its `.corners`, or a `.largest_step`", "name its `corners=`, or a `largest_step=`"),
    ("leave `until_rest` out", "leave `rest=` out"),
    (
        "leave out `every` and `at_most`, or the outputs",
        "leave out `each=` and `at_most=`, or the outputs",
    ),
    (
        "`every(0)` records nothing; use `every(1)` to record each step",
        "`each=0` records nothing; `each=1` records each step",
    ),
    ("`at_most`", "`at_most=`"),
    ("`.resolution(dt)`", "`resolution=dt` of the event"),
    ("by `.scale`", "by `scale=`"),
    ("`.backward()`", "`backward=True`"),
    ("`SymmetricItohAbe`", "\"symmetric-itoh-abe\""),
    ("`ItohAbe`", "\"itoh-abe\""),
    ("`MeanValue`", "\"mean-value\""),
    ("`Gonzalez`", "\"gonzalez\""),
    ("`WeylMidpoint`", "method=\"midpoint\""),
    ("`ChartMidpoint`", "method=\"chart-midpoint\""),
    ("`Exponential`", "method=\"exponential\""),
    ("`RungeKuttaChebyshev`", "method=\"chebyshev\""),
    ("`DormandPrince8`", "method=\"dp8\""),
    ("`DormandPrince5`", "method=\"dp5\""),
    ("`Radau`", "method=\"radau2\""),
    ("`Gauss`", "method=\"gauss2\""),
    ("`RandomFlow`", "sampler=\"random-flow\""),
    ("`NinomiyaVictoir`", "sampler=\"ninomiya-victoir\""),
    ("`Equations::values`", "the energy"),
    ("a `Scheme`", "a scheme"),
    ("write the closure", "write the function"),
    ("the closure", "the function"),
];

/// Says the message of an error in words of Python.
pub(crate) fn in_python(message: &str) -> String {
    // Messages are broken into lines in the sources, with blanks between.
    let whole = message.split_whitespace().collect::<Vec<_>>().join(" ");
    WORDS.iter().fold(whole, |text, (from, to)| text.replace(from, to))
}

/// The exception of a model.
pub(crate) fn of_model(error: &Broken) -> PyErr {
    ModelError::new_err(in_python(&error.to_string()))
}

/// The exception of a run that has not started.
pub(crate) fn of_run<M: StateSpace>(error: &NotRun<M>) -> PyErr {
    let message = in_python(&error.to_string());
    match error {
        NotRun::Model(_) | NotRun::Start(_) => ModelError::new_err(message),
        NotRun::Span(_) => SpanError::new_err(message),
        _ => RunError::new_err(message),
    }
}

/// The exception of a tangent.
pub(crate) fn of_tangent<M: StateSpace>(error: &TangentError<M>) -> PyErr {
    match error {
        TangentError::Run(error) => of_run(error),
        error => RunError::new_err(in_python(&error.to_string())),
    }
}

/// The exception of a panic in the library.
pub(crate) fn of_panic(payload: &(dyn std::any::Any + Send)) -> PyErr {
    let text = payload.downcast_ref::<&str>().map(ToString::to_string);
    let text = text.or_else(|| payload.downcast_ref::<String>().cloned());
    let text = text.unwrap_or_else(|| "without a message".to_owned());
    PyRuntimeError::new_err(format!("a fault of the library: {text}"))
}

/// Calls work that may panic.
pub(crate) fn caught<T>(work: impl FnOnce() -> PyResult<T>) -> PyResult<T> {
    let done = std::panic::catch_unwind(std::panic::AssertUnwindSafe(work));
    done.unwrap_or_else(|payload| Err(of_panic(&*payload)))
}

/// The exception of an argument.
pub(crate) fn bad(message: impl Into<String>) -> PyErr {
    PyValueError::new_err(message.into())
}
