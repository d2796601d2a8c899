//! Configuration files and what is said about them.
//!
//! `wrong/*.toml` are refused with the lines of the `.txt` beside them, `right/*.toml` mean what
//! the `.out` beside them says. After a message was changed on purpose, MAVSWITCH_BLESS=1 writes
//! these files anew; read the difference before it is committed.

// A case that cannot be read fails its test, and a panic is how.
#![allow(clippy::unwrap_used)]

mod example;
mod routerd;

use std::fs;
use std::path::{Path, PathBuf};

use mavswitch::config::{ConfigError, parse_config};

/// The configurations in one directory.
fn cases(dir: &str, extension: &str) -> Vec<PathBuf> {
    let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/config").join(dir);
    let paths = fs::read_dir(dir).unwrap().map(|entry| entry.unwrap().path());
    let is_case = |path: &PathBuf| path.extension().is_some_and(|it| it == extension);
    let mut cases: Vec<PathBuf> = paths.filter(is_case).collect();
    cases.sort();
    cases
}

/// What a file means, in its canonical form.
fn read(path: &Path) -> Result<String, ConfigError> {
    let name = path.file_name().unwrap().to_str().unwrap();
    let config = parse_config(name, &fs::read_to_string(path).unwrap())?;
    Ok(config.to_string())
}

/// Whether the file beside `path` says `text`.
fn is_as_written(path: &Path, extension: &str, text: &str) -> bool {
    let beside = path.with_extension(extension);
    if std::env::var_os("MAVSWITCH_BLESS").is_some() {
        fs::write(&beside, text).unwrap();
    }
    let written = fs::read_to_string(&beside).unwrap_or_default();
    if written != text {
        eprintln!("{}: expected\n{written}\nbut it says\n{text}", path.display());
    }
    written == text
}

#[test]
fn wrong_configurations_are_told_in_plain_words() {
    let cases = cases("wrong", "toml");
    assert!(cases.len() >= 40, "only {}", cases.len());
    let good = cases.iter().filter(|path| match read(path) {
        Ok(text) => panic!("{} is right:\n{text}", path.display()),
        Err(error) => is_as_written(path, "txt", &format!("{error}\n")),
    });
    assert_eq!(good.count(), cases.len());
}

#[test]
fn right_configurations_mean_what_they_say() {
    let cases = cases("right", "toml");
    let good = cases.iter().filter(|path| {
        let text = read(path).unwrap_or_else(|error| panic!("{error}"));
        let again = parse_config("out.toml", &text).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(again.to_string(), text);
        is_as_written(path, "out", &text)
    });
    assert_eq!(good.count(), cases.len());
}
