//! The same test once more in a process of its own: in namespaces where it may break the network,
//! or as a peer that can be stopped and killed.

use std::any::type_name;
use std::env;
use std::path::Path;
use std::process::{Child, Command, Stdio};

use rustix::process::{Pid, Signal, geteuid, kill_process};

/// Set in the process that has namespaces of its own.
const NAMESPACES: &str = "MAVSWITCH_TEST_NAMESPACES";
/// Set in the process that plays a part: which.
const PART: &str = "MAVSWITCH_TEST_PART";

/// Whether the caller, the test function `test`, has a network and mounts of its own, and may do
/// with them what it likes. If not, it has been run there meanwhile, or cannot be: it is over.
#[track_caller]
pub(crate) fn in_own_namespaces<T: Fn()>(test: T, tools: &[&str]) -> bool {
    if env::var_os(NAMESPACES).is_some() {
        sh("ip link set lo up");
        return true;
    }
    let missing = ["ip", "unshare"].iter().chain(tools).find(|tool| !is_there(tool));
    let able = || unshare().arg("true").output().is_ok_and(|output| output.status.success());
    if let Some(tool) = missing {
        println!("skipped: there is no `{tool}` here");
    } else if !able() {
        println!("skipped: this needs root, or a kernel that lets users have namespaces");
    } else {
        let command = &mut unshare();
        let output = same_test(command.arg(program()), test).env(NAMESPACES, "1").output();
        let output = output.expect("the test starts once more");
        print!("{}", String::from_utf8_lossy(&output.stdout));
        eprint!("{}", String::from_utf8_lossy(&output.stderr));
        assert!(output.status.success(), "it failed in namespaces of its own");
    }
    false
}

fn unshare() -> Command {
    let mut command = Command::new("unshare");
    command.args(["--net", "--mount"]);
    if !geteuid().is_root() {
        command.arg("--map-root-user");
    }
    command
}

/// Whether there is such a program.
pub(crate) fn is_there(tool: &str) -> bool {
    let path = env::var_os("PATH").unwrap_or_default();
    env::split_paths(&path)
        .chain([Path::new("/usr/sbin").to_owned()])
        .any(|dir| dir.join(tool).is_file())
}

/// Whether system calls can be made to take long here.
pub(crate) fn can_delay() -> bool {
    let able = is_there("strace");
    if !able {
        println!("skipped: there is no `strace` here");
    }
    able
}

/// Runs a line of shell that must succeed.
#[track_caller]
pub(crate) fn sh(line: &str) {
    let output = Command::new("sh").args(["-c", line]).output().expect("a shell");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "`{line}` failed: {errors}");
}

fn program() -> std::path::PathBuf {
    env::current_exe().expect("the path of this program")
}

/// Adds what makes this program run `test` alone.
fn same_test<T: Fn()>(command: &mut Command, _test: T) -> &mut Command {
    let name = type_name::<T>();
    // The name begins with that of the program.
    let name = name.split_once("::").expect("a path").1;
    command.args(["--exact", name, "--nocapture"])
}

/// The part that this process is to play, if it is there for that.
pub(crate) fn part() -> Option<String> {
    env::var(PART).ok()
}

/// Somebody in a process of its own, killed when it is not needed any more.
pub(crate) struct Actor(Child);

impl Actor {
    /// Runs the test `test` in another process, where [`part`] then is `part`.
    pub(crate) fn start<T: Fn()>(test: T, part: &str) -> Self {
        let command = &mut Command::new(program());
        same_test(command, test).env(PART, part);
        let child = command.stdin(Stdio::null()).stdout(Stdio::null()).spawn();
        Self(child.expect("somebody to play a part"))
    }

    /// Stops it as it stands; nothing of it is closed.
    pub(crate) fn stop(&self) {
        self.signal(Signal::STOP);
    }

    /// Lets it go on.
    pub(crate) fn go_on(&self) {
        self.signal(Signal::CONT);
    }

    /// Waits until it has played its part, and nothing in it has failed.
    pub(crate) fn wait(mut self) {
        let status = self.0.wait().expect("its end");
        assert!(status.success(), "it failed in its part");
    }

    fn signal(&self, signal: Signal) {
        let id = self.0.id().try_into().ok().and_then(Pid::from_raw);
        kill_process(id.expect("a process id"), signal).expect("it runs");
    }
}

impl Drop for Actor {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
