//! Why there is no fit.

/// Data, options or a model that cannot be fitted.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// There is not one row of data for each time.
    #[error("there are {rows} rows of data for {times} times; give one for each")]
    Rows {
        /// The rows.
        rows: usize,
        /// The times.
        times: usize,
    },
    /// A number of the data is not finite.
    #[error("the data have {value} in row {row}, column {column}; leave such rows out")]
    NotFinite {
        /// The row.
        row: usize,
        /// The column.
        column: usize,
        /// The number.
        value: f64,
    },
    /// A time does not come after the one before it.
    #[error("the times of the data must rise, and row {row} has t = {time}; sort the rows")]
    Times {
        /// The row.
        row: usize,
        /// Its time.
        time: f64,
    },
    /// There are no more data than unknowns.
    #[error(
        "{data} numbers do not determine {unknowns} unknowns and their errors; give more data or fix parameters"
    )]
    TooFewData {
        /// The numbers that were measured.
        data: usize,
        /// The unknowns.
        unknowns: usize,
    },
    /// The noise is not a positive number.
    #[error("the noise of column {column} is {sigma}; it must be a positive number, or left out")]
    Noise {
        /// The column of the data.
        column: usize,
        /// The noise that was given.
        sigma: f64,
    },
    /// There is no parameter of this name.
    #[error("there is no parameter {name:?}; the family has {known:?}")]
    UnknownParameter {
        /// The name that was asked for.
        name: String,
        /// The names of the family.
        known: Vec<&'static str>,
    },
    /// There is no parameter at this place.
    #[error("there is no parameter {index}; the family has {known:?}, counted from 0")]
    UnknownIndex {
        /// The place that was asked for.
        index: usize,
        /// The names of the family.
        known: Vec<&'static str>,
    },
    /// The bounds of a parameter are not an interval.
    #[error(
        "the bounds of {name} are {lower} and {upper}; the first one has to be the smaller number. Infinity stands for no bound, and \
         `free` fixes a parameter"
    )]
    Bounds {
        /// The parameter.
        name: &'static str,
        /// The lower bound.
        lower: f64,
        /// The upper bound.
        upper: f64,
    },
    /// The guess of a parameter is outside of its bounds; it is not moved.
    #[error(
        "the guess of {name} is {value}, and its bounds are {lower} and {upper}; guess a number between them"
    )]
    OutOfBounds {
        /// The parameter.
        name: &'static str,
        /// The guess.
        value: f64,
        /// The lower bound.
        lower: f64,
        /// The upper bound.
        upper: f64,
    },
    /// The scale of a robust loss is not a positive number.
    #[error(
        "the scale of the loss is {scale}; it must be a positive finite number, the residual from which on one counts less"
    )]
    Scale {
        /// The scale that was given.
        scale: f64,
    },
    /// A parameter that is to stay positive has a guess that is not.
    #[error(
        "the guess of {name} is {value}, and it was said to be positive; guess a positive number"
    )]
    NotPositive {
        /// The parameter.
        name: &'static str,
        /// The guess.
        value: f64,
    },
    /// A parameter of no known size, along which no difference can be taken.
    #[error(
        "the guess of {name} is zero, which says nothing of its size; guess another number of the size that it may have"
    )]
    NoSize {
        /// The parameter.
        name: &'static str,
    },
    /// No parameter is free.
    #[error("no parameter is free; name one, or leave `free` out to fit them all")]
    NothingFree,
    /// The model has no run, or no tangent, at the guess.
    #[error("the model cannot be run at the guess: {0}")]
    Guess(#[source] Box<dyn std::error::Error + Send + Sync>),
    /// The model has no run near the best parameters that were found.
    #[error("the solver has failed: {0}")]
    Solver(String),
    /// The minimum was not reached.
    #[error(
        "no minimum after {runs} runs: the residuals still fall, at χ² = {chi_squared:.6e}; start nearer, fix parameters, \
         or allow more runs"
    )]
    NotConverged {
        /// The runs that were made.
        runs: usize,
        /// The least sum of squares so far.
        chi_squared: f64,
        /// The parameters of this sum.
        parameters: Vec<f64>,
    },
}

metriplectic_equations::debug_is_the_sentence!(FitError);

metriplectic_integrators::passed_on_as_error!(FitError);
