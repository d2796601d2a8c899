//! What host names mean, decided by the test: for tests that have namespaces of their own.

use std::path::Path;

use super::again::sh;
use super::dir::TempDir;

/// What every name of this computer means, for a test in namespaces of its own.
pub(crate) struct Names {
    dir: TempDir,
}

impl Names {
    /// No name means anything, and nobody can be asked.
    pub(crate) fn none() -> Self {
        let names = Self { dir: TempDir::new() };
        let hosts = names.dir.write("hosts", "127.0.0.1 localhost\n");
        let servers = "nameserver 127.0.0.1\noptions timeout:5 attempts:2\n";
        let servers = names.dir.write("resolv.conf", servers);
        names.put(&hosts, "/etc/hosts");
        names.put(&servers, "/etc/resolv.conf");
        names
    }

    fn put(&self, file: &Path, over: &str) {
        sh(&format!("mount --bind {} {over}", file.display()));
    }

    /// From now on `name` means `address`, and no other name means anything.
    pub(crate) fn set(&self, name: &str, address: &str) {
        self.set_all(name, &[address]);
    }

    /// The same with several addresses, of which the first is to be preferred.
    pub(crate) fn set_all(&self, name: &str, addresses: &[&str]) {
        let lines: String = addresses.iter().map(|at| format!("{at} {name}\n")).collect();
        self.dir.write("hosts", &format!("127.0.0.1 localhost\n{lines}"));
    }
}
