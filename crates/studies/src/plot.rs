//! Figures as SVG: the same bytes for the same numbers.
//!
//! [`Panels`] draws lines over time and, beside them, curves on a sphere ([`Globe`]); [`LogLog`] draws
//! convergence. All use the colours of Okabe & Ito (2008), which the colour-blind tell apart, and
//! thin long lines out to what can be seen.

use std::{error::Error, fs, io, path::PathBuf};

pub use crate::{
    globe::Globe,
    log_log::LogLog,
    panels::{Panel, Panels},
};

/// Why a figure could not be drawn.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlotError {
    /// The figure, panel or line of this name has nothing in it.
    #[error("there is nothing to draw in `{name}`; give it a line with at least one point")]
    Empty {
        /// Title or label.
        name: String,
    },
    /// A point has no place on the paper.
    #[error("point {index} of `{name}` is ({x}, {y}); leave out what is not finite")]
    NonFinite {
        /// Title of the panel or label of the line.
        name: String,
        /// Index of the point.
        index: usize,
        /// Its abscissa.
        x: f64,
        /// Its ordinate.
        y: f64,
    },
    /// A point has no place on logarithmic axes.
    #[error(
        "point {index} of `{name}` is ({x}, {y}); logarithmic axes need positive numbers: \
         leave it out"
    )]
    NonPositive {
        /// Label of the series.
        name: String,
        /// Index of the point.
        index: usize,
        /// Its abscissa.
        x: f64,
        /// Its ordinate.
        y: f64,
    },
    /// A point is not on the unit sphere.
    #[error("point {index} of `{name}` has the norm {norm}; a globe shows points of norm 1")]
    OffSphere {
        /// Label of the curve.
        name: String,
        /// Index of the point.
        index: usize,
        /// Its norm.
        norm: f64,
    },
    /// The length of an axis is not finite.
    #[error("an axis cannot reach from {low:e} to {high:e}; rescale the numbers")]
    Range {
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// The drawing library failed.
    #[error("the figure could not be drawn; simplify its labels")]
    Backend {
        /// What it says.
        source: Box<dyn Error + Send + Sync>,
    },
    /// The file could not be written.
    #[error("cannot write {}: {source}; does its folder exist?", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}

/// The file of a figure.
pub(crate) fn save(path: PathBuf, svg: &str) -> Result<(), PlotError> {
    fs::write(&path, svg).map_err(|source| PlotError::Io { path, source })
}
