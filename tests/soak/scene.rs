//! The program, and the places around it where trouble comes from.

use std::fs;
use std::net::SocketAddr;
use std::os::unix::fs::symlink;
use std::path::PathBuf;

use rustix::process::Signal;

use crate::harness::*;
use crate::party::dropped_at;

/// What the key of the guarded endpoint is made of.
pub(crate) const PASSPHRASE: &str = "the key of this soak";

/// How many records are kept.
pub(crate) const MAX_RECORDS: usize = 5;

/// A router with a configuration file, a serial port that can be pulled, and a server to call.
pub(crate) struct Scene {
    pub(crate) router: Router,
    dir: TempDir,
    /// Where the router calls, when it is up.
    pub(crate) server: SocketAddr,
    _server: TcpServer,
}

impl Scene {
    pub(crate) fn set() -> Self {
        let (dir, server) = (TempDir::new(), TcpServer::down());
        dir.key_file("radio", PASSPHRASE);
        let file = dir.path("mavswitch.toml");
        let address = server.address();
        fs::write(&file, text(&dir, address, 0)).unwrap();
        let router = Router::launch_in(&["-c", file.to_str().unwrap()], |command| {
            command.env("STATE_DIRECTORY", dir.path(""));
        });
        router.log.wait_for(&["ready"]);
        Self { router, dir, server: address, _server: server }
    }

    /// What the file says in variant `number`; the wrong one is the third.
    pub(crate) fn write(&self, number: usize) {
        fs::write(self.dir.path("mavswitch.toml"), text(&self.dir, self.server, number)).unwrap();
    }

    /// Has the file read again; waits until it was.
    pub(crate) fn reload(&self) {
        let from = self.router.log.len();
        self.router.signal(Signal::HUP);
        self.router.log.wait_from(from, &["reloaded"]);
    }

    /// The serial port's name leads to this terminal now.
    pub(crate) fn plug(&self, pty: &Pty) {
        symlink(&pty.path, self.dir.path("next")).unwrap();
        fs::rename(self.dir.path("next"), self.serial()).unwrap();
    }

    pub(crate) fn unplug(&self) {
        fs::remove_file(self.serial()).unwrap();
    }

    fn serial(&self) -> PathBuf {
        self.dir.path("fc")
    }

    /// What the kernel threw away in front of the router's socket for those whose links are well.
    pub(crate) fn dropped_on_the_way_in(&self) -> u64 {
        dropped_at(self.router.address("udp").port())
    }

    /// How many records there are.
    pub(crate) fn records(&self) -> usize {
        fs::read_dir(self.dir.path("records")).unwrap().count()
    }

    /// As it was in the beginning.
    pub(crate) fn clear_up(&self) {
        self.write(0);
        self.reload();
    }

    pub(crate) fn end(self) {
        self.router.signal(Signal::TERM);
        let (status, _) = self.router.wait_for_end();
        assert!(status.success(), "{status}");
    }
}

fn text(dir: &TempDir, server: SocketAddr, variant: usize) -> String {
    let fc = dir.path("fc");
    let mut text = format!(
        r#"
metrics = "127.0.0.1:0"
keys = {{ radio = "radio.key" }}
record = "records"
record_max_size = "200k"
record_max_files = {MAX_RECORDS}
[endpoint.sim]
address = "sim:?system=50&count=2&rate=10"
[endpoint.guarded]
address = "udpin:127.0.0.1:0"
sign = "radio"
v1 = "drop"
verify = "radio"
peer_timeout = "2s"
[endpoint.tcp]
address = "tcpin:127.0.0.1:0"
[endpoint.udp]
address = "udpin:127.0.0.1:0"
[endpoint.callers]
address = "tcpin:127.0.0.1:0"
stall_timeout = "1s"
[endpoint.strangers]
address = "udpin:127.0.0.1:0"
peer_timeout = "2s"
max_peers = 32
block_messages_out = ["ENCAPSULATED_DATA"]
[endpoint.fc]
address = "serial:{}:115200"
[endpoint.server]
address = "tcpout:{server}"
"#,
        fc.display()
    );
    text.push_str(match variant {
        0 => "",
        1 => "[endpoint.more]\naddress = \"udpin:127.0.0.1:0\"\n",
        2 => "[endpoint.more]\naddress = \"nowhere\"\n",
        _ => "[endpoint.other]\naddress = \"tcpin:127.0.0.1:0\"\ngroup = \"air\"\n",
    });
    text
}
