//! Routers that tests set up in the same way: one with a configuration file, and one that records.

use std::fs;
use std::path::{Path, PathBuf};

use super::{Router, TempDir};

/// A router with a configuration file of its own.
pub(crate) struct Scene {
    pub(crate) router: Router,
    pub(crate) file: PathBuf,
    _dir: TempDir,
}

impl Scene {
    pub(crate) fn start(text: &str, arguments: &[&str]) -> Self {
        let dir = TempDir::new();
        let file = dir.write("mavswitch.toml", text);
        let mut all = vec!["-c", path(&file)];
        all.extend(arguments);
        Self { router: Router::start(&all), file, _dir: dir }
    }

    /// Writes another configuration, of which the router does not know yet.
    pub(crate) fn write(&self, text: &str) {
        fs::write(&self.file, text).expect("a file of ours");
    }
}

/// A path as an argument.
pub(crate) fn path(file: &Path) -> &str {
    file.to_str().expect("a path of text")
}

/// An endpoint in the file.
pub(crate) fn endpoint(name: &str, address: &str, options: &str) -> String {
    format!("[endpoint.{name}]\naddress = \"{address}\"\n{options}\n")
}

/// The arguments of a router that records to `records`, however full the disk is, what the TCP
/// servers `fc` and `gcs` bring; and `more`.
pub(crate) fn recording<'a>(records: &'a Path, more: &[&'a str]) -> Vec<&'a str> {
    let mut all = vec!["--record", path(records), "--record-min-free=0"];
    all.extend(["tcpin:127.0.0.1:0?name=fc", "tcpin:127.0.0.1:0?name=gcs"]);
    all.extend(more);
    all
}
