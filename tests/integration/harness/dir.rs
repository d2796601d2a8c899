//! A directory of its own for each test, gone when the test is over.

use std::fs::{self, Permissions};
use std::io::ErrorKind;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicU32, Ordering};

/// An empty directory below the build directory.
pub(crate) struct TempDir(PathBuf);

impl TempDir {
    /// A new one, with a name that no other test has.
    pub(crate) fn new() -> Self {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let all = Path::new(env!("CARGO_TARGET_TMPDIR"));
        fs::create_dir_all(all).expect("a directory for all tests");
        loop {
            let number = COUNT.fetch_add(1, Ordering::Relaxed);
            let path = all.join(format!("{}-{number}", process::id()));
            match fs::create_dir(&path) {
                Ok(()) => return Self(path),
                // Left behind by one that was killed: numbers of processes come again.
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                Err(error) => panic!("no directory for the test: {error}"),
            }
        }
    }

    /// The path of `name` in it.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// Writes a file and gives its path.
    pub(crate) fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.path(name);
        fs::write(&path, text).expect("a file in the test's directory");
        path
    }

    /// Writes the file of a key that is made of a passphrase, which nobody else can read; gives it as
    /// `--key` wants it: `NAME=PATH`.
    pub(crate) fn key_file(&self, name: &str, passphrase: &str) -> String {
        let path = self.write(&format!("{name}.key"), &format!("passphrase:{passphrase}"));
        fs::set_permissions(&path, Permissions::from_mode(0o600)).expect("a file of ours");
        format!("{name}={}", path.display())
    }
}

impl Drop for TempDir {
    fn drop(&mut self) {
        // What cannot be removed lies below the build directory and does no harm.
        let _ = fs::remove_dir_all(&self.0);
    }
}
