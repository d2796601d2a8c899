//! Which files mavlink-router would read.

use std::io;
use std::iter;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::config::file::visible_files;
use crate::config::place::{ConfigError, ConfigProblem};

/// Where the files are unless somebody names others: `main.conf` and the directory `config.d`.
pub const ROUTERD_DIR: &str = "/etc/mavlink-router";

const MAIN: &str = "main.conf";
const DROP_INS: &str = "config.d";

/// The files of one configuration, in the order in which later ones override earlier ones.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct RouterdFiles {
    /// Those that are there.
    pub paths: Vec<PathBuf>,
    /// Those that were named and are not there.
    pub notes: Vec<ConfigProblem>,
}

impl RouterdFiles {
    /// The file and the files of the directory; without a name, those in [`ROUTERD_DIR`].
    ///
    /// A file that is not there is left out, as mavlink-router does.
    ///
    /// # Errors
    ///
    /// If the directory cannot be read.
    pub fn find(file: Option<&Path>, dir: Option<&Path>) -> Result<Self, ConfigError> {
        let default = Path::new(ROUTERD_DIR);
        let mut files = Self::default();
        let main = file.map_or_else(|| default.join(MAIN), Path::to_owned);
        if is_there(&main) {
            files.paths.push(main);
        } else if file.is_some() {
            let text = "it is not there: going on without it";
            files.notes.push(problem_of(&main, text));
        }
        files.paths.extend(in_dir(&dir.map_or_else(|| default.join(DROP_INS), Path::to_owned))?);
        Ok(files)
    }

    /// A file; or of a directory `main.conf` and the files of `config.d`, and if it has neither, all
    /// files in it.
    ///
    /// # Errors
    ///
    /// If the directory cannot be read or is empty.
    pub fn at(path: &Path) -> Result<Self, ConfigError> {
        if !path.is_dir() {
            return Ok(Self { paths: vec![path.to_owned()], notes: Vec::new() });
        }
        let (main, drop_ins) = (path.join(MAIN), path.join(DROP_INS));
        let paths: Vec<PathBuf> = if is_there(&main) || is_there(&drop_ins) {
            let main = iter::once(main).filter(|main| is_there(main));
            main.chain(in_dir(&drop_ins)?).collect()
        } else {
            in_dir(path)?
        };
        if paths.is_empty() {
            let text = format!("no {MAIN} is in it, no {DROP_INS} and no other file");
            return Err(ConfigError { problems: vec![problem_of(path, &text)] });
        }
        Ok(Self { paths, notes: Vec::new() })
    }
}

/// Whether there is anything of this name. What cannot be looked at is told when it is read.
fn is_there(path: &Path) -> bool {
    !matches!(path.try_exists(), Ok(false))
}

fn problem_of(path: &Path, text: &str) -> ConfigProblem {
    let name: Arc<str> = path.display().to_string().into();
    ConfigProblem::of_file(&name, text)
}

/// All files in a directory, in the order of their names. What editors leave behind is no
/// configuration: hidden files, and those that end in `~`.
fn in_dir(dir: &Path) -> Result<Vec<PathBuf>, ConfigError> {
    let files = list(dir).map_err(|error| {
        let text = format!("cannot read: {error}");
        ConfigError { problems: vec![problem_of(dir, &text)] }
    });
    let mut files = files?;
    files.sort();
    Ok(files)
}

fn list(dir: &Path) -> io::Result<Vec<PathBuf>> {
    let mut files = visible_files(dir, |name| !name.ends_with('~'))?;
    files.retain(|path| path.is_file());
    Ok(files)
}
