//! `systemctl reload`: the unit's own command, beside the program that it is about.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use crate::harness::*;
use crate::unit::values;

const RIGHT: &str = "[endpoint.tcp]\naddress = \"tcpin:127.0.0.1:0\"\n";

/// A running service, and its file.
struct Service {
    router: Router,
    file: PathBuf,
    _dir: TempDir,
}

impl Service {
    fn start(general: &str) -> Self {
        let dir = TempDir::new();
        let file = dir.write("mavswitch.toml", &format!("{general}{RIGHT}"));
        let router = Router::start(&["-c", file.to_str().unwrap()]);
        Self { router, file, _dir: dir }
    }

    /// Writes another file, and runs the command of the unit as systemd does; says whether it is
    /// content.
    fn reload(&self, text: &str) -> bool {
        fs::write(&self.file, text).unwrap();
        let [line] = &values("ExecReload")[..] else { panic!("one command") };
        let script = line.strip_prefix("/bin/sh -c '").unwrap().strip_suffix('\'').unwrap();
        assert_eq!(script.matches("/usr/bin/mavswitch ").count(), 1, "{script}");
        let script = script.replace("/usr/bin/mavswitch", &quoted(PROGRAM));
        let mut command = Command::new("/bin/sh");
        command.args(["-c", &script]).env("MAINPID", self.router.process().0.to_string());
        command.env("RUNTIME_DIRECTORY", self.router.control().parent().unwrap());
        let output = command.output().unwrap();
        // The log of the service has it already.
        assert!(output.stdout.is_empty() && output.stderr.is_empty(), "{output:?}");
        output.status.success()
    }
}

#[test]
fn a_reload_fails_while_the_file_is_wrong_and_the_log_says_why() {
    let service = Service::start("");
    assert!(service.reload(&format!("strict = true\n{RIGHT}")));
    service.router.log.wait_for(&["configuration reloaded; ", "1 as before"]);
    assert!(!service.reload("[endpoint.tcp]\nadress = \"tcpin:127.0.0.1:0\"\n"));
    service.router.log.wait_for(&["mavswitch.toml:2:1: ", "did you mean `address`?"]);
    assert!(!service.reload("# Nothing is left.\n"));
    service.router.log.wait_for(&["nothing to join: no endpoint is configured any more"]);
    service.router.address("tcp");
    assert!(service.reload(RIGHT));
}

#[test]
fn without_a_control_socket_the_signal_has_to_do() {
    let service = Service::start("control = \"off\"\n");
    assert!(service.reload(&format!("control = \"off\"\nstrict = true\n{RIGHT}")));
    service.router.log.wait_for(&["configuration reloaded; "]);
    assert!(service.reload("wrong"), "nobody tells");
    service.router.log.wait_for(&["cannot be reloaded: everything stays as it was"]);
}
