//! The command line of an example.

use std::collections::BTreeMap;

/// An option: its name, what its value is, and its help.
type Choice = (&'static str, Option<&'static str>, String);

/// The options that an example has.
#[derive(Clone, Debug)]
pub(crate) struct Options {
    about: &'static str,
    choices: Vec<Choice>,
    after: &'static str,
}

/// The end of a program that does not run.
#[derive(Clone, Debug)]
pub(crate) enum Answer {
    /// The help that was asked for.
    Help(String),
    /// A mistake in the command line.
    Mistake(String),
}

impl Answer {
    /// The text of an answer.
    #[cfg(test)]
    pub(crate) fn text(&self) -> &str {
        match self {
            Self::Help(text) | Self::Mistake(text) => text,
        }
    }

    /// Prints the answer and ends the program.
    pub(crate) fn exit(self) -> ! {
        match self {
            Self::Help(text) => {
                println!("{text}");
                std::process::exit(0)
            }
            Self::Mistake(text) => {
                eprintln!("error: {text}\n\nFor more information, try '--help'.");
                std::process::exit(2)
            }
        }
    }
}

impl Options {
    /// The option `--json` alone.
    pub(crate) fn new(about: &'static str) -> Self {
        let json = ("json", None, "Print one JSON value, in the place of text".to_owned());
        Self { about, choices: vec![json], after: "" }
    }

    /// The options of a run, with the help of the number and the size of its steps.
    pub(crate) fn of_a_run(about: &'static str, [steps, size]: [String; 2]) -> Self {
        Self::new(about).with("steps", Some("N"), steps).with("step-size", Some("h"), size)
    }

    /// The options of a sweep. Its shard is read by `Shard::from_environment`.
    pub(crate) fn of_a_sweep(about: &'static str) -> Self {
        let shard = "Run the rows of one of n shards, counted from 0, into a journal";
        let shards = "The number of shards, where the scheduler does not say it (PBS)";
        let merge = "Put the journals of all shards together, and draw";
        let options = Self::new(about)
            .with("shard", Some("i/n"), shard.to_owned())
            .with("shards", Some("n"), shards.to_owned())
            .with("merge", None, merge.to_owned());
        Self { after: SHARDS, ..options }
    }

    fn with(mut self, name: &'static str, value: Option<&'static str>, help: String) -> Self {
        self.choices.push((name, value, help));
        self
    }

    /// Reads the options that are given: `--name`, `--name value` or `--name=value`.
    pub(crate) fn parse(
        &self,
        line: impl IntoIterator<Item = String>,
    ) -> Result<BTreeMap<&'static str, String>, Answer> {
        let (mut line, mut given) = (line.into_iter(), BTreeMap::new());
        while let Some(word) = line.next() {
            if word == "--help" || word == "-h" {
                return Err(Answer::Help(self.help()));
            }
            let (name, value) = match word.split_once('=') {
                Some((name, value)) => (name, Some(value.to_owned())),
                None => (&*word, None),
            };
            let known = |choice: &&Choice| name.strip_prefix("--") == Some(choice.0);
            let value = match (self.choices.iter().find(known), value) {
                (Some((name, Some(_), _)), Some(value)) => (*name, Some(value)),
                (Some((name, Some(_), _)), None) => (*name, line.next()),
                (Some((name, None, _)), None) => (*name, Some(String::new())),
                _ => return Err(Answer::Mistake(format!("unexpected argument '{word}'"))),
            };
            let (name, Some(value)) = value else {
                return Err(Answer::Mistake(format!("a value is required for '{word}'")));
            };
            given.insert(name, value);
        }
        Ok(given)
    }

    fn help(&self) -> String {
        let mut text = format!("{}\n\nOptions:\n", self.about);
        for (name, value, help) in &self.choices {
            let left = value.map_or(format!("--{name}"), |value| format!("--{name} <{value}>"));
            text += &format!("  {left:<18}  {help}\n");
        }
        text + &format!("  {:<18}  Print help\n{}", "-h, --help", self.after)
    }
}

/// How a sweep is run on many machines.
const SHARDS: &str = "
Shards share the rows of a sweep. Each one writes a journal into the current folder, and goes on from it when
it is started again. All of these run four shards of the program:

  mpirun -n 4 ./sweep                            OpenMPI or MPICH say the rank and the size
  sbatch --array=0-3 job.sh                      SLURM says the task of the array; job.sh runs ./sweep
  qsub -t 1-4 job.sh                             Grid Engine
  qsub -J 0-3 job.sh                             PBS; job.sh runs ./sweep --shards 4
  seq 0 3 | parallel ./sweep --shard {}/4        GNU parallel, on one machine or many
  ./sweep --shard 0/4                            any other way, in four places

Then ./sweep --merge reads the journals, names rows that are missing, and draws the table of all rows.";
