//! The folder of the pictures, data files, lines on standard output, and a bar for long runs.

use std::{
    env,
    ffi::OsString,
    fmt, fs,
    io::{self, BufWriter, IsTerminal, Write},
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressStyle};

/// How long a run stays silent.
const PATIENCE: Duration = Duration::from_secs(1);
/// How often a bar looks at the clock, at most.
const GLANCE: Duration = Duration::from_millis(50);

/// The folder the examples draw into, `target/gallery` of the workspace.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Gallery {
    folder: PathBuf,
}

/// A file or folder of the gallery that could not be written.
#[derive(thiserror::Error)]
#[error("cannot write {}: {source}; is there a place left, and may one write to it?", path.display())]
pub struct GalleryError {
    /// The file or folder.
    pub path: PathBuf,
    /// The error of the system.
    pub source: io::Error,
}

metriplectic_equations::debug_is_the_sentence!(GalleryError);

impl Gallery {
    /// Opens the gallery, creating its folder where needed: `$CARGO_TARGET_DIR/gallery`, or else
    /// `target/gallery` of the workspace around `$CARGO_MANIFEST_DIR` (set by `cargo run`) or
    /// around the current directory.
    ///
    /// # Errors
    ///
    /// [`GalleryError`] if the folder cannot be created.
    pub fn open() -> Result<Self, GalleryError> {
        let here = || env::current_dir().unwrap_or_default();
        let start = env::var_os("CARGO_MANIFEST_DIR").map_or_else(here, PathBuf::from);
        Self::within(target(env::var_os("CARGO_TARGET_DIR"), &start).join("gallery"))
    }

    /// A gallery in this folder, created where needed.
    ///
    /// # Errors
    ///
    /// [`GalleryError`] if the folder cannot be created.
    pub fn within(folder: impl Into<PathBuf>) -> Result<Self, GalleryError> {
        let folder = folder.into();
        match fs::create_dir_all(&folder) {
            Ok(()) => Ok(Self { folder }),
            Err(source) => Err(GalleryError { path: folder, source }),
        }
    }

    /// The path of a file in the gallery.
    #[must_use]
    pub fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.folder.join(name)
    }
}

/// The build folder: the one asked for, or the one of the workspace around `start`.
fn target(asked: Option<OsString>, start: &Path) -> PathBuf {
    let is_root = |folder: &&Path| {
        fs::read_to_string(folder.join("Cargo.toml"))
            .is_ok_and(|manifest| manifest.lines().any(|line| line.trim() == "[workspace]"))
    };
    let root = || start.ancestors().find(is_root).unwrap_or(start);
    asked.map_or_else(|| root().join("target"), PathBuf::from)
}

/// Writes a table of numbers, one row a line under a line of names. A number read back is the
/// number written: each has the digits that tell it from its neighbours.
///
/// # Examples
///
/// ```
/// use metriplectic_studies::{Gallery, write_csv};
///
/// let gallery = Gallery::within(std::env::temp_dir().join("metriplectic-doc"))?;
/// let path = gallery.path("parabola.csv");
/// let rows = (0..3).map(f64::from).map(|t| [t, 0.1 * t * t]);
/// write_csv(&path, ["t", "q"], rows)?;
/// assert_eq!(std::fs::read_to_string(&path)?, "t,q\n0.0,0.0\n1.0,0.1\n2.0,0.4\n");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
///
/// [`GalleryError`] if the file cannot be written.
pub fn write_csv<const N: usize>(
    path: impl AsRef<Path>,
    header: [&str; N],
    rows: impl IntoIterator<Item = [f64; N]>,
) -> Result<(), GalleryError> {
    let path = path.as_ref();
    let named = |source| GalleryError { path: path.into(), source };
    let write = || {
        let mut file = BufWriter::new(fs::File::create(path)?);
        writeln!(file, "{}", header.map(quoted).join(","))?;
        for row in rows {
            writeln!(file, "{}", row.map(|x| format!("{x:?}")).join(","))?;
        }
        file.flush()
    };
    write().map_err(named)
}

/// Prints a line to standard output. A reader that has left, as `head` does, is no error.
///
/// ```
/// # fn main() -> std::io::Result<()> {
/// metriplectic_studies::print(format_args!("{:.3}", std::f64::consts::PI))
/// # }
/// ```
///
/// # Errors
///
/// The errors of writing to standard output, but for a pipe that nobody reads any more.
pub fn print(text: impl fmt::Display) -> io::Result<()> {
    write_line(io::stdout().lock(), text)
}

fn write_line(mut out: impl Write, text: impl fmt::Display) -> io::Result<()> {
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        written => written,
    }
}

/// A name as RFC 4180 wants it.
fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.into()
    }
}

/// A bar on the terminal for a long run.
///
/// It appears once the run has taken a second, disappears at the end, and says nothing at all where
/// standard error is no terminal. A step costs a comparison: the clock is read about twenty times a
/// second, whatever a step takes.
///
/// # Examples
///
/// ```
/// let mut progress = metriplectic_studies::Progress::over(1000);
/// for _ in 0..1000 {
///     progress.step();
/// }
/// ```
pub struct Progress {
    total: usize,
    done: usize,
    /// The step at which the clock is read next.
    glance: usize,
    /// Steps between two readings.
    stride: usize,
    started: Instant,
    read: Instant,
    shown: bool,
    bar: ProgressBar,
}

impl Progress {
    /// Progress of a run of so many steps; `usize::MAX` if their number is not known.
    #[must_use]
    pub fn over(total: usize) -> Self {
        Self::starting(total, io::stderr().is_terminal())
    }

    fn starting(total: usize, terminal: bool) -> Self {
        let now = Instant::now();
        // Without a terminal the clock is never read.
        let glance = if terminal { 1 } else { usize::MAX };
        let (stride, bar) = (1, ProgressBar::hidden());
        Self { total, done: 0, glance, stride, started: now, read: now, shown: false, bar }
    }

    /// One step is done.
    #[inline]
    pub fn step(&mut self) {
        self.done += 1;
        if self.done >= self.glance {
            self.look(Instant::now());
        }
    }

    /// Draws what is due, and reads the clock again in twice or half as many steps.
    #[cold]
    fn look(&mut self, now: Instant) {
        let quick = now.duration_since(self.read) < GLANCE;
        self.stride = if quick { self.stride.saturating_mul(2) } else { (self.stride / 2).max(1) };
        self.glance = self.done.saturating_add(self.stride);
        self.read = now;
        if now.duration_since(self.started) >= PATIENCE {
            self.draw();
        }
    }

    fn draw(&mut self) {
        if !self.shown {
            self.shown = true;
            self.bar =
                ProgressBar::new(self.total as u64).with_style(style(self.total < usize::MAX));
        }
        self.bar.set_position(self.done as u64);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

impl fmt::Debug for Progress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Progress {{ {} of {} }}", self.done, self.total)
    }
}

fn style(bounded: bool) -> ProgressStyle {
    let template = if bounded {
        "{bar:40} {percent:>3} %  {human_pos} steps  {eta} left"
    } else {
        "{spinner} {human_pos} steps in {elapsed}"
    };
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scratch(name: &str) -> PathBuf {
        env::temp_dir().join(format!("metriplectic-{name}-{}", std::process::id()))
    }

    #[test]
    fn the_gallery_is_in_the_target_of_the_workspace() {
        let root = scratch("root");
        let member = root.join("crates/one");
        fs::create_dir_all(&member).unwrap();
        fs::write(root.join("Cargo.toml"), "[workspace]\nmembers = []\n").unwrap();
        fs::write(member.join("Cargo.toml"), "[package]\n[workspace.lints]\n").unwrap();
        assert_eq!(target(None, &member), root.join("target"));
        assert_eq!(target(Some("/elsewhere".into()), &member), Path::new("/elsewhere"));
        let gallery = Gallery::within(root.join("target/gallery")).unwrap();
        assert!(root.join("target/gallery").is_dir());
        assert_eq!(gallery.path("a.svg"), root.join("target/gallery/a.svg"));
        fs::remove_dir_all(root).unwrap();
    }

    #[test]
    fn numbers_survive_a_csv() {
        let folder = scratch("csv");
        let path = Gallery::within(&folder).unwrap().path("numbers.csv");
        let rows = [[0.1 + 0.2, f64::MIN_POSITIVE], [1e300 / 3.0, -0.0], [1.0, 5e-324]];
        write_csv(&path, ["t", "a, \"b\""], rows).unwrap();
        let text = fs::read_to_string(&path).unwrap();
        let mut lines = text.lines();
        assert_eq!(lines.next(), Some("t,\"a, \"\"b\"\"\""));
        let read = lines.map(|line| line.split(',').map(|x| x.parse::<f64>().unwrap().to_bits()));
        let bits = rows.iter().flatten().map(|x| x.to_bits());
        assert_eq!(read.flatten().collect::<Vec<_>>(), bits.collect::<Vec<_>>());
        fs::remove_dir_all(folder).unwrap();
    }

    /// A writer that fails in this way.
    struct Failing(io::ErrorKind);

    impl Write for Failing {
        fn write(&mut self, _: &[u8]) -> io::Result<usize> {
            Err(self.0.into())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_reader_may_leave() {
        assert!(write_line(Failing(io::ErrorKind::BrokenPipe), "text").is_ok());
        assert!(write_line(Failing(io::ErrorKind::StorageFull), "text").is_err());
        let mut text = Vec::new();
        write_line(&mut text, 1.5).unwrap();
        assert_eq!(text, b"1.5\n");
    }

    #[test]
    fn a_missing_folder_is_named() {
        let path = scratch("missing").join("a.csv");
        let error = write_csv(&path, ["t"], [[0.0]]).unwrap_err();
        assert_eq!(error.path, path);
        assert!(error.to_string().contains("a.csv"), "{error}");
    }

    #[test]
    fn a_bar_waits_a_second_and_for_a_terminal() {
        let mut progress = Progress::starting(10, true);
        // Its own start: the clock goes on between two readings.
        let started = progress.started;
        progress.look(started + PATIENCE / 2);
        assert!(!progress.shown);
        progress.look(started + PATIENCE);
        assert!(progress.shown);
        let mut silent = Progress::starting(10, false);
        silent.started = started - 2 * PATIENCE;
        (0..10).for_each(|_| silent.step());
        assert!(!silent.shown);
    }

    #[test]
    fn the_clock_is_read_rarely_in_quick_runs_and_always_in_slow_ones() {
        let mut quick = Progress::starting(1 << 20, true);
        let start = quick.read;
        (0..10).for_each(|_| quick.look(start));
        assert_eq!(quick.stride, 1 << 10);
        (1..=20).for_each(|k| quick.look(start + k * GLANCE * 2 / 100));
        let slow = quick.stride;
        quick.look(start + 2 * GLANCE);
        assert_eq!(quick.stride, slow / 2);
    }
}
