//! Where the control socket is, for the one who makes it and for those who look for it.

use std::env;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// The place of a daemon that root runs, and of the service.
const SYSTEM: &str = "/run/mavswitch/control";

/// Where a daemon has its socket if nobody says otherwise: in the directory that its manager made for
/// it, else in that of its user, else, for root alone, in `/run`. `None`: there is no place for it.
pub fn default_place(is_root: bool) -> Option<PathBuf> {
    let own = of_manager().or_else(of_user);
    own.or_else(|| is_root.then(|| PathBuf::from(SYSTEM)))
}

/// Where to look for a daemon that may have been started by anybody.
pub fn places_to_ask() -> Vec<PathBuf> {
    let places = [of_manager(), of_user(), Some(PathBuf::from(SYSTEM))];
    let mut places: Vec<PathBuf> = places.into_iter().flatten().collect();
    places.dedup();
    places
}

/// systemd may have made several, with colons between.
fn of_manager() -> Option<PathBuf> {
    let list = env::var_os("RUNTIME_DIRECTORY")?;
    let first = env::split_paths(&list).next()?;
    usable(&first).then(|| first.join("control"))
}

fn of_user() -> Option<PathBuf> {
    let directory = PathBuf::from(env::var_os("XDG_RUNTIME_DIR")?);
    usable(&directory).then(|| directory.join("mavswitch").join("control"))
}

fn usable(directory: &Path) -> bool {
    directory.is_absolute() && directory.as_os_str() != OsStr::new("/")
}
