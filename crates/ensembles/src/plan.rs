//! Which rows a sweep has, and the parameters of each.

use std::fmt;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use crate::draw::{Draw, mixed, permuted, within};
use crate::error::PlanError;
use crate::figures::reserved;
use crate::fingerprint::Fingerprint;
use crate::row::Row;
use crate::rows_file;

/// A plan of rows: products of grids, of samples and of listed rows. [`run`](Self::run) says what a row does.
///
/// Rows are numbered from 0, and the factor that was given last varies fastest. The parameters of a row depend on its
/// number and on the seed alone.
///
/// ```
/// use metriplectic_ensembles::{Sweep, linspace};
/// let sweep = Sweep::new("relax")
///     .grid("friction", linspace(0.05, 1.0, 20))
///     .samples(50)
///     .random("spin", |draw| draw.uniform(-1.0..1.0));
/// assert_eq!(sweep.rows()?, 1000);
/// let row = sweep.row(999)?;
/// assert_eq!(row["friction"], 1.0);
/// assert!(row["spin"].abs() < 1.0);
/// # Ok::<(), metriplectic_ensembles::PlanError>(())
/// ```
#[derive(Clone)]
pub struct Sweep {
    name: String,
    tag: String,
    seed: u64,
    factors: Vec<Factor>,
    drawn: Vec<Drawn>,
    /// Samples that were added.
    more: usize,
}

/// A factor of the product of all rows.
#[derive(Clone, Debug)]
enum Factor {
    Grid { name: String, values: Vec<f64> },
    Listed { names: Vec<String>, rows: Vec<Vec<f64>> },
    Samples(usize),
    Hypercube { samples: usize, columns: Vec<(String, Range<f64>)> },
}

/// A column that is drawn anew in each row.
#[derive(Clone)]
struct Drawn {
    name: String,
    draw: Arc<dyn Fn(&mut Draw) -> f64 + Send + Sync>,
}

/// The first of the columns of a hypercube.
const OF_A_HYPERCUBE: u64 = 1 << 32;

impl Factor {
    const fn len(&self) -> usize {
        match self {
            Self::Grid { values, .. } => values.len(),
            Self::Listed { rows, .. } => rows.len(),
            Self::Samples(count) | Self::Hypercube { samples: count, .. } => *count,
        }
    }

    fn names(&self) -> Vec<&str> {
        match self {
            Self::Grid { name, .. } => vec![name],
            Self::Listed { names, .. } => names.iter().map(String::as_str).collect(),
            Self::Samples(_) => Vec::new(),
            Self::Hypercube { columns, .. } => columns.iter().map(|(n, _)| n.as_str()).collect(),
        }
    }

    fn check(&self) -> Result<(), PlanError> {
        if self.len() == 0 {
            let column = self.names().first().map_or("samples", |name| name).to_owned();
            return Err(PlanError::Empty { column });
        }
        let Self::Hypercube { columns, .. } = self else { return Ok(()) };
        for (column, Range { start, end }) in columns {
            if !(start.is_finite() && end.is_finite() && start < end) {
                let (column, start, end) = (column.clone(), *start, *end);
                return Err(PlanError::Range { column, start, end });
            }
        }
        Ok(())
    }
}

impl Sweep {
    /// A plan of one row without parameters. The name is that of the journal's sweep.
    #[must_use]
    pub fn new(name: impl Into<String>) -> Self {
        let (tag, factors, drawn) = (String::new(), Vec::new(), Vec::new());
        Self { name: name.into(), tag, seed: 0, factors, drawn, more: 0 }
    }

    /// Multiplies the rows by the values of a parameter.
    #[must_use]
    pub fn grid(self, name: impl Into<String>, values: impl IntoIterator<Item = f64>) -> Self {
        let (name, values) = (name.into(), values.into_iter().collect());
        self.times(Factor::Grid { name, values })
    }

    /// Multiplies the rows by a number of samples, in which the columns of [`random`](Self::random) differ.
    #[must_use]
    pub fn samples(self, count: usize) -> Self {
        self.times(Factor::Samples(count))
    }

    /// Adds samples to a sweep that has run: so many further rows for each combination of the other factors, in which the
    /// columns of [`random`](Self::random) differ.
    ///
    /// The rows so far keep their numbers, their parameters and their bytes, and the journal keeps them. The new rows have the
    /// numbers behind, one sample after the other, so that samples may be added again.
    ///
    /// ```
    /// use metriplectic_ensembles::Sweep;
    /// let plan = || Sweep::new("spins").samples(50).random("spin", |draw| draw.uniform(-1.0..1.0));
    /// let more = plan().more_samples(150);
    /// assert_eq!((plan().rows()?, more.rows()?), (50, 200));
    /// assert_eq!(plan().row(49)?["spin"], more.row(49)?["spin"]);
    /// # Ok::<(), metriplectic_ensembles::PlanError>(())
    /// ```
    #[must_use]
    pub fn more_samples(mut self, count: usize) -> Self {
        self.more = self.more.saturating_add(count);
        self
    }

    /// Draws a parameter anew in each row.
    #[must_use]
    pub fn random(
        mut self,
        name: impl Into<String>,
        draw: impl Fn(&mut Draw) -> f64 + Send + Sync + 'static,
    ) -> Self {
        self.drawn.push(Drawn { name: name.into(), draw: Arc::new(draw) });
        self
    }

    /// Multiplies the rows by so many samples of a Latin hypercube (McKay, Beckman, Conover 1979). Each
    /// parameter has one value in each of `samples` strata of equal length. Each combination of the other factors has a
    /// hypercube of its own.
    ///
    /// ```
    /// use metriplectic_ensembles::Sweep;
    /// let sweep = Sweep::new("cube").latin_hypercube(4, [("x", 0.0..4.0), ("y", -1.0..1.0)]);
    /// let mut strata: Vec<i32> = (0..4).map(|row| sweep.row(row).unwrap()["x"] as i32).collect();
    /// strata.sort();
    /// assert_eq!(strata, [0, 1, 2, 3]);
    /// ```
    #[must_use]
    pub fn latin_hypercube<N: Into<String>>(
        self,
        samples: usize,
        columns: impl IntoIterator<Item = (N, Range<f64>)>,
    ) -> Self {
        let columns = columns.into_iter().map(|(name, range)| (name.into(), range)).collect();
        self.times(Factor::Hypercube { samples, columns })
    }

    /// Multiplies the rows by those of a file of comma-separated numbers, under a line of names.
    ///
    /// # Errors
    ///
    /// [`PlanError::Read`] and [`PlanError::Cell`].
    pub fn rows_of(self, path: impl AsRef<Path>) -> Result<Self, PlanError> {
        let (names, rows) = rows_file::read(path.as_ref())?;
        Ok(self.times(Factor::Listed { names, rows }))
    }

    /// Multiplies the rows by listed ones.
    ///
    /// ```
    /// use metriplectic_ensembles::Sweep;
    /// let sweep = Sweep::new("bodies").listed(["mass", "size"], [[1.0, 0.1], [5.0, 0.2]]);
    /// assert_eq!(sweep.row(1)?["size"], 0.2);
    /// # Ok::<(), metriplectic_ensembles::PlanError>(())
    /// ```
    #[must_use]
    pub fn listed<const N: usize>(
        self,
        names: [&str; N],
        rows: impl IntoIterator<Item = [f64; N]>,
    ) -> Self {
        let names = names.map(str::to_owned).to_vec();
        let rows = rows.into_iter().map(Vec::from).collect();
        self.times(Factor::Listed { names, rows })
    }

    /// The seed of all drawn parameters; 0 unless given.
    #[must_use]
    pub fn seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    /// A text that belongs to the plan, such as the version of the model. A journal with another text is refused:
    /// the library cannot see what is in a closure.
    #[must_use]
    pub fn tag(self, tag: impl Into<String>) -> Self {
        Self { tag: tag.into(), ..self }
    }

    fn times(mut self, factor: Factor) -> Self {
        self.factors.push(factor);
        self
    }

    /// The number of rows.
    ///
    /// # Errors
    ///
    /// [`PlanError`] of a plan without rows, or with too many.
    pub fn rows(&self) -> Result<usize, PlanError> {
        if self.name.is_empty() {
            return Err(PlanError::NoName);
        }
        self.factors.iter().try_for_each(Factor::check)?;
        if self.more > 0 && self.factors.iter().any(|f| matches!(f, Factor::Hypercube { .. })) {
            return Err(PlanError::MoreOfAHypercube);
        }
        let product = |all: bool| {
            let factors = self.factors.iter().filter(|f| all || !matches!(f, Factor::Samples(_)));
            factors.map(Factor::len).try_fold(1, usize::checked_mul)
        };
        let more = product(false).and_then(|each| each.checked_mul(self.more));
        product(true).zip(more).and_then(|(a, b)| a.checked_add(b)).ok_or(PlanError::TooManyRows)
    }

    /// The number of rows without the samples that were added.
    pub(crate) fn first_rows(&self) -> usize {
        self.factors.iter().map(Factor::len).product()
    }

    /// A row with its parameters.
    ///
    /// # Errors
    ///
    /// [`PlanError`] if there is no such row.
    pub fn row(&self, number: usize) -> Result<Row, PlanError> {
        let rows = self.rows()?;
        if number >= rows {
            return Err(PlanError::NoSuchRow { row: number, rows });
        }
        Ok(self.known_row(number, &self.names().into()))
    }

    /// The row of an index that is known to exist, with the names of the columns.
    pub(crate) fn known_row(&self, number: usize, names: &Arc<[String]>) -> Row {
        Row::new(number, Arc::clone(names), self.values(number), self.seed)
    }

    fn draw(&self, column: u64, row: usize) -> Draw {
        Draw::of(self.seed, column, row)
    }

    /// The names of the parameters.
    pub(crate) fn names(&self) -> Vec<String> {
        let factors = self.factors.iter().flat_map(Factor::names);
        let drawn = self.drawn.iter().map(|drawn| drawn.name.as_str());
        factors.chain(drawn).map(str::to_owned).collect()
    }

    /// The parameters of a row.
    pub(crate) fn values(&self, number: usize) -> Box<[f64]> {
        // The last factor varies fastest. A sample that was added has all other factors in a row.
        let added = number.checked_sub(self.first_rows());
        let len = |factor: &Factor| match factor {
            Factor::Samples(_) if added.is_some() => 1,
            factor => factor.len(),
        };
        let mut stride = self.factors.iter().map(len).product::<usize>();
        let place = added.unwrap_or(number);
        let mut values = Vec::new();
        for (at, factor) in self.factors.iter().enumerate() {
            stride /= len(factor);
            let index = place / stride % len(factor);
            match factor {
                Factor::Grid { values: grid, .. } => values.push(grid[index]),
                Factor::Listed { rows, .. } => values.extend_from_slice(&rows[index]),
                Factor::Samples(_) => {}
                Factor::Hypercube { samples, columns } => {
                    let cell = number - index * stride;
                    values.extend(columns.iter().enumerate().map(|(k, (_, range))| {
                        let column = OF_A_HYPERCUBE + ((at as u64) << 16) + k as u64;
                        let key = mixed(self.seed ^ mixed(column ^ mixed(cell as u64)));
                        let stratum = permuted(index, *samples, key) as f64;
                        let u = self.draw(column, number).unit();
                        within(range, (stratum + u) / *samples as f64)
                    }));
                }
            }
        }
        let drawn = self.drawn.iter().enumerate();
        values.extend(drawn.map(|(k, drawn)| (drawn.draw)(&mut self.draw(k as u64, number))));
        values.into()
    }

    /// The name of the sweep.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Checks that no two columns of the table have one name.
    pub(crate) fn check_names(&self, others: &[String]) -> Result<(), PlanError> {
        let mut seen: Vec<String> = Vec::new();
        for name in self.names().iter().chain(others) {
            if seen.contains(name) || reserved(name) {
                return Err(PlanError::SameName { name: name.clone() });
            }
            seen.push(name.clone());
        }
        Ok(())
    }

    /// The plan in one line.
    pub(crate) fn about(&self) -> String {
        let factor = |factor: &Factor| match factor {
            Factor::Grid { name, values } => format!("{name} ({})", values.len()),
            Factor::Listed { names, rows } => format!("{} ({} rows)", names.join("+"), rows.len()),
            Factor::Samples(count) => format!("{count} samples"),
            Factor::Hypercube { samples, .. } => {
                format!("{samples} of a hypercube of {}", factor.names().join("+"))
            }
        };
        let factors: Vec<_> = self.factors.iter().map(factor).collect();
        let drawn: Vec<_> = self.drawn.iter().map(|drawn| format!(", {}", drawn.name)).collect();
        let tag = if self.tag.is_empty() { String::new() } else { format!(", {}", self.tag) };
        let more =
            if self.more > 0 { format!(" and {} more samples", self.more) } else { String::new() };
        format!(
            "{}: {}{more}{}, seed {}{tag}",
            self.name,
            factors.join(" × "),
            drawn.concat(),
            self.seed
        )
    }

    /// A hash of everything that the numbers of the rows depend on, but for the closures. Those that draw parameters
    /// are known by the values that they draw in a few rows. Samples that were added change no row.
    pub(crate) fn fingerprint(&self, others: &[String]) -> u64 {
        let (rows, mut hash) = (self.first_rows(), Fingerprint::default());
        hash.text(&self.name);
        hash.text(&self.tag);
        hash.word(self.seed);
        hash.word(rows as u64);
        for name in self.names().iter().chain(others) {
            hash.text(name);
        }
        for factor in &self.factors {
            hash.word(factor.len() as u64);
            match factor {
                Factor::Grid { values, .. } => values.iter().for_each(|x| hash.word(x.to_bits())),
                Factor::Listed { rows, .. } => {
                    rows.iter().flatten().for_each(|x| hash.word(x.to_bits()));
                }
                Factor::Samples(_) => hash.word(0),
                Factor::Hypercube { columns, .. } => {
                    let ends = columns.iter().flat_map(|(_, range)| [range.start, range.end]);
                    ends.for_each(|x| hash.word(x.to_bits()));
                }
            }
        }
        for number in [0, 1, 2, rows - 1] {
            let row = self.values(number.min(rows - 1));
            row.iter().for_each(|x| hash.word(x.to_bits()));
        }
        hash.finish()
    }
}

impl fmt::Debug for Sweep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Sweep({})", self.about())
    }
}

/// So many numbers at equal distances, both ends among them.
///
/// ```
/// assert_eq!(metriplectic_ensembles::linspace(0.0, 1.0, 5), [0.0, 0.25, 0.5, 0.75, 1.0]);
/// ```
#[must_use]
pub fn linspace(start: f64, end: f64, count: usize) -> Vec<f64> {
    let last = count.saturating_sub(1);
    let at = |k: usize| match k {
        0 => start,
        k if k == last => end,
        k => start + (end - start) * (k as f64 / last as f64),
    };
    (0..count).map(at).collect()
}

/// So many positive numbers at equal ratios, both ends among them.
///
/// ```
/// let grid = metriplectic_ensembles::geomspace(1e-3, 1e3, 7);
/// assert!(grid.iter().zip(-3..).all(|(x, k)| (x / 10_f64.powi(k) - 1.0).abs() < 1e-14));
/// ```
#[must_use]
pub fn geomspace(start: f64, end: f64, count: usize) -> Vec<f64> {
    let last = count.saturating_sub(1);
    let at = |k: usize| match k {
        0 => start,
        k if k == last => end,
        k => start * (end / start).powf(k as f64 / last as f64),
    };
    (0..count).map(at).collect()
}
