//! Configuration files: which ones there are, and what they say together.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::layer;
use super::merge::{self, Config};
use super::place::{ConfigError, ConfigProblem};
use super::source::Source;
use super::write;

/// Where the files are unless `--config` names another: `mavswitch.toml`, and `conf.d` beside it.
pub const CONFIG_DIR: &str = "/etc/mavswitch";

/// The files in `dir`: `mavswitch.toml`, then `conf.d/*.toml` in the order of their names, as far
/// as they are there. Hidden files are left out.
///
/// # Errors
///
/// If `conf.d` cannot be read.
pub fn default_files(dir: &Path) -> Result<Vec<PathBuf>, ConfigError> {
    let main = dir.join("mavswitch.toml");
    let drop_ins = dir.join("conf.d");
    let mut files = toml_files(&drop_ins).map_err(|error| {
        let file: Arc<str> = drop_ins.display().to_string().into();
        ConfigError {
            problems: vec![ConfigProblem::of_file(&file, format!("cannot read: {error}"))],
        }
    })?;
    files.sort();
    // One that is there and cannot be opened is told when it is read.
    if !matches!(main.try_exists(), Ok(false)) {
        files.insert(0, main);
    }
    Ok(files)
}

fn toml_files(dir: &Path) -> io::Result<Vec<PathBuf>> {
    visible_files(dir, |name| name.ends_with(".toml"))
}

/// The entries of a directory that are not hidden and have such a name, in no order; none if there
/// is no such directory.
pub(super) fn visible_files(
    dir: &Path,
    is_wanted: impl Fn(&str) -> bool,
) -> io::Result<Vec<PathBuf>> {
    let entries = match fs::read_dir(dir) {
        Ok(entries) => entries,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(error),
    };
    let mut files = Vec::new();
    for entry in entries {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if is_wanted(&name) && !name.starts_with('.') {
            files.push(path);
        }
    }
    Ok(files)
}

/// Reads configuration files; later ones override earlier ones key by key, and an endpoint that
/// an earlier one has too is the same endpoint.
///
/// # Errors
///
/// If a file cannot be read, or anything in it is wrong: all that was found, each with its place.
pub fn load_config(files: &[PathBuf]) -> Result<Config, ConfigError> {
    let mut layers = Vec::new();
    let mut problems = Vec::new();
    for file in files {
        let layer = Source::read(file).map_err(|problem| vec![problem]);
        match layer.and_then(|source| layer::read(&source)) {
            Ok(layer) => layers.push(layer),
            Err(found) => problems.extend(found),
        }
    }
    ConfigError::unless_none((), problems)?;
    merge::merge(layers)
}

/// Reads a configuration from its text; `name` is for errors.
///
/// # Errors
///
/// As [`load_config`].
pub fn parse_config(name: &str, text: &str) -> Result<Config, ConfigError> {
    let source = Source::new(name, text.to_owned());
    match layer::read(&source) {
        Ok(layer) => merge::merge(vec![layer]),
        Err(problems) => ConfigError::unless_none(Config::default(), problems),
    }
}

/// For a fuzzer: reads a configuration, and if it is one, holds that it is the same when it was
/// written out and read back.
///
/// # Panics
///
/// If it reads back as anything else, or if an error has control characters.
pub fn fuzz_config(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    match parse_config("fuzz.toml", text) {
        Ok(config) => write::assert_reads_back(&config),
        Err(error) => {
            assert!(!error.problems.is_empty());
            let is_clean =
                |problem: &ConfigProblem| !problem.to_string().contains(char::is_control);
            assert!(error.problems.iter().all(is_clean), "{error}");
        }
    }
}

#[cfg(test)]
mod tests;
