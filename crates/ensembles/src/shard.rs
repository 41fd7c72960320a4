//! Which of several processes this one is.

use std::env;
use std::path::{Path, PathBuf};

/// One of `count` processes that share the rows of a sweep: it runs the rows `r` with `r mod count = index`.
///
/// No library of message passing is needed. [`Shard::from_environment`] reads what the launcher says:
///
/// | launcher | what is read |
/// |---|---|
/// | any | the argument `--shard 3/16`, counted from 0 |
/// | SLURM, `sbatch --array=0-15` | `SLURM_ARRAY_TASK_ID`, `_COUNT`, `_MIN`, `_MAX`, `_STEP` |
/// | SLURM, `srun -n 16` | `SLURM_PROCID`, `SLURM_STEP_NUM_TASKS` |
/// | OpenMPI, `mpirun -n 16` | `OMPI_COMM_WORLD_RANK`, `OMPI_COMM_WORLD_SIZE` |
/// | MPICH, Intel MPI and others with PMI | `PMI_RANK`, `PMI_SIZE` |
/// | PBS, `qsub -J 0-15`; Torque, `qsub -t 0-15` | `PBS_ARRAY_INDEX`, `PBS_ARRAYID`, with `--shards 16` |
/// | Grid Engine, `qsub -t 1-16` | `SGE_TASK_ID`, `SGE_TASK_FIRST`, `_LAST`, `_STEPSIZE` |
///
/// A process of an array whose tasks are started by `mpirun` is one of all of them: `array index · size + rank`.
///
/// ```
/// use metriplectic_ensembles::Shard;
/// let shard = Shard::new(3, 16)?;
/// assert!(shard.has(19) && !shard.has(20));
/// # Ok::<(), metriplectic_ensembles::ShardError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Shard {
    /// Which one it is, counted from 0.
    pub index: usize,
    /// How many there are.
    pub count: usize,
}

/// A shard that the environment or the command line does not say clearly.
#[derive(Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ShardError {
    /// There is no such shard.
    #[error("there is no shard {index}/{count}: shards are counted from 0, as in 0/16 to 15/16")]
    Range {
        /// The index asked for.
        index: usize,
        /// The number of shards.
        count: usize,
    },
    /// A text is no shard or no number.
    #[error("{name} is {value:?}; it must be {expected}")]
    Text {
        /// The option or the variable.
        name: &'static str,
        /// The value found.
        value: String,
        /// The value expected.
        expected: &'static str,
    },
    /// The scheduler says which task this is, but not how many there are.
    #[error(
        "{variable} says which task this is and not of how many; add `--shards N` to the command, and \
         number the tasks from 0"
    )]
    NoCount {
        /// The variable.
        variable: &'static str,
    },
    /// A variable is missing beside another one.
    #[error("{found} is set and {missing} is not; say the shard by `--shard i/n`")]
    Missing {
        /// The variable that is set.
        found: &'static str,
        /// The variable that is not set.
        missing: &'static str,
    },
    /// The tasks of the array are not at equal distances, so their order is not known.
    #[error(
        "the array has {count} tasks from {first} to {last} in steps of {step}, which leaves gaps; say the \
         shard by `--shard i/n`"
    )]
    Gaps {
        /// The number of tasks.
        count: usize,
        /// The first task.
        first: usize,
        /// The last task.
        last: usize,
        /// The distance of two tasks.
        step: usize,
    },
}

metriplectic_equations::debug_is_the_sentence!(ShardError);

metriplectic_integrators::passed_on_as_error!(ShardError);

/// The values of the variables of an environment.
type Variables<'a> = &'a dyn Fn(&str) -> Option<String>;

impl Shard {
    /// The only one: all rows.
    pub const WHOLE: Self = Self { index: 0, count: 1 };

    /// The shard `index` of `count`.
    ///
    /// # Errors
    ///
    /// [`ShardError::Range`] if `index` is not below `count`.
    pub const fn new(index: usize, count: usize) -> Result<Self, ShardError> {
        if index < count {
            Ok(Self { index, count })
        } else {
            Err(ShardError::Range { index, count })
        }
    }

    /// The shard that the command line or the launcher says; [`WHOLE`](Self::WHOLE) if neither does.
    ///
    /// # Errors
    ///
    /// [`ShardError`] if they say it in part only, rather than running rows twice or never.
    pub fn from_environment() -> Result<Self, ShardError> {
        let line: Vec<String> = env::args_os().map(|a| a.to_string_lossy().into_owned()).collect();
        Self::of(&line, &|name| env::var(name).ok())
    }

    /// Reads the shard from any command line and environment.
    ///
    /// ```
    /// use metriplectic_ensembles::Shard;
    /// let slurm = |name: &str| match name {
    ///     "SLURM_ARRAY_TASK_ID" => Some("14".to_owned()),
    ///     "SLURM_ARRAY_TASK_COUNT" => Some("4".to_owned()),
    ///     "SLURM_ARRAY_TASK_MIN" => Some("10".to_owned()),
    ///     "SLURM_ARRAY_TASK_MAX" => Some("16".to_owned()),
    ///     "SLURM_ARRAY_TASK_STEP" => Some("2".to_owned()),
    ///     _ => None,
    /// };
    /// assert_eq!(Shard::of(&[], &slurm), Shard::new(2, 4));
    /// ```
    ///
    /// # Errors
    ///
    /// The errors of [`from_environment`](Self::from_environment).
    pub fn of(line: &[String], variable: Variables<'_>) -> Result<Self, ShardError> {
        if let Some(text) = option(line, "--shard") {
            return Self::parse(&text);
        }
        let count = option(line, "--shards").map(|text| number("--shards", text)).transpose()?;
        let array = array(variable, count)?.unwrap_or(Self::WHOLE);
        let rank = rank(variable)?.unwrap_or(Self::WHOLE);
        Self::new(array.index * rank.count + rank.index, array.count * rank.count)
    }

    /// The shard of a text like `3/16`.
    ///
    /// # Errors
    ///
    /// [`ShardError::Text`] and [`ShardError::Range`].
    pub fn parse(text: &str) -> Result<Self, ShardError> {
        let expected = "a shard like 3/16";
        let broken = || ShardError::Text { name: "--shard", value: text.to_owned(), expected };
        let (index, count) = text.split_once('/').ok_or_else(broken)?;
        let number = |text: &str| text.trim().parse().map_err(|_| broken());
        Self::new(number(index)?, number(count)?)
    }

    /// Returns whether it runs this row.
    #[must_use]
    pub const fn has(self, row: usize) -> bool {
        row % self.count == self.index
    }
}

impl Default for Shard {
    fn default() -> Self {
        Self::WHOLE
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

/// The value of an option, `--shard 3/16` or `--shard=3/16`.
fn option(line: &[String], name: &str) -> Option<String> {
    let at = line.iter().position(|word| word == name || word.starts_with(&format!("{name}=")))?;
    match line[at].split_once('=') {
        Some((_, value)) => Some(value.to_owned()),
        None => Some(line.get(at + 1).cloned().unwrap_or_default()),
    }
}

fn number(name: &'static str, value: String) -> Result<usize, ShardError> {
    let expected = "a whole number";
    value.trim().parse().map_err(|_| ShardError::Text { name, value, expected })
}

/// A variable that is set to a number.
fn set(variable: Variables<'_>, name: &'static str) -> Result<Option<usize>, ShardError> {
    let value = variable(name).filter(|value| !value.is_empty() && value != "undefined");
    value.map(|value| number(name, value)).transpose()
}

/// A variable that must be set beside another one.
fn beside(
    variable: Variables<'_>,
    found: &'static str,
    missing: &'static str,
) -> Result<usize, ShardError> {
    set(variable, missing)?.ok_or(ShardError::Missing { found, missing })
}

/// The place of a task in a regular array.
fn place(
    task: usize,
    [first, last, step]: [usize; 3],
    count: Option<usize>,
) -> Result<Shard, ShardError> {
    let step = step.max(1);
    let regular = last.saturating_sub(first) / step + 1;
    let count = count.unwrap_or(regular);
    if count != regular || task < first || !(task - first).is_multiple_of(step) {
        return Err(ShardError::Gaps { count, first, last, step });
    }
    Shard::new((task - first) / step, count)
}

/// The task of a job array.
fn array(variable: Variables<'_>, count: Option<usize>) -> Result<Option<Shard>, ShardError> {
    const SLURM: &str = "SLURM_ARRAY_TASK_ID";
    if let Some(task) = set(variable, SLURM)? {
        let first = beside(variable, SLURM, "SLURM_ARRAY_TASK_MIN")?;
        let last = beside(variable, SLURM, "SLURM_ARRAY_TASK_MAX")?;
        let step = set(variable, "SLURM_ARRAY_TASK_STEP")?.unwrap_or(1);
        let tasks = set(variable, "SLURM_ARRAY_TASK_COUNT")?;
        return place(task, [first, last, step], tasks).map(Some);
    }
    const SGE: &str = "SGE_TASK_ID";
    if let Some(task) = set(variable, SGE)? {
        let first = beside(variable, SGE, "SGE_TASK_FIRST")?;
        let last = beside(variable, SGE, "SGE_TASK_LAST")?;
        let step = set(variable, "SGE_TASK_STEPSIZE")?.unwrap_or(1);
        return place(task, [first, last, step], None).map(Some);
    }
    for name in ["PBS_ARRAY_INDEX", "PBS_ARRAYID"] {
        if let Some(task) = set(variable, name)? {
            let count = count.ok_or(ShardError::NoCount { variable: name })?;
            return Shard::new(task, count).map(Some);
        }
    }
    Ok(None)
}

/// The rank of a process that a launcher of parallel programs has started.
fn rank(variable: Variables<'_>) -> Result<Option<Shard>, ShardError> {
    let pairs = [
        ("OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE"),
        ("PMI_RANK", "PMI_SIZE"),
        ("MV2_COMM_WORLD_RANK", "MV2_COMM_WORLD_SIZE"),
    ];
    for (rank, size) in pairs {
        if let Some(index) = set(variable, rank)? {
            return Shard::new(index, beside(variable, rank, size)?).map(Some);
        }
    }
    // A batch script has a rank too, but only `srun` says how many tasks its step has.
    match (set(variable, "SLURM_PROCID")?, set(variable, "SLURM_STEP_NUM_TASKS")?) {
        (Some(index), Some(count)) => Shard::new(index, count).map(Some),
        _ => Ok(None),
    }
}

/// The journal of a shard: `relax.3.journal` beside `relax.journal`.
pub(crate) fn of_shard(path: &Path, index: usize) -> PathBuf {
    match path.extension() {
        Some(ending) => path.with_extension(format!("{index}.{}", ending.to_string_lossy())),
        None => path.with_extension(index.to_string()),
    }
}
