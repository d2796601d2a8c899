//! Network namespaces that nobody has to clean up.
//!
//! A namespace has a name only while it is made. After that an open descriptor holds it, with all
//! its devices, and the kernel removes it when that is closed and the last process and socket in it
//! are gone, whether the test ends well or panics. No name is left behind, and no device.

use std::fs::{self, File};
use std::io::{self, Write};
use std::os::fd::{AsFd, AsRawFd};
use std::path::Path;
use std::process::{self, Command};
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread;

use rustix::thread::{LinkNameSpaceType, move_into_link_name_space};

/// A network of its own, with a loopback device.
pub(crate) struct Namespace(File);

/// What went over a device.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Traffic {
    pub(crate) received: u64,
    pub(crate) sent: u64,
}

impl Namespace {
    /// A new one; `None`, and a line that says why, if there can be none here.
    pub(crate) fn new() -> Option<Self> {
        let name = free_name();
        let made = if rustix::process::geteuid().is_root() {
            succeed(Command::new("ip").args(["netns", "add", &name]))
        } else {
            Err("only root may make network namespaces".to_owned())
        };
        if let Err(reason) = made {
            say(&format!("SKIPPED: no network namespaces: {reason}"));
            return None;
        }
        let file = File::open(format!("/run/netns/{name}"));
        let removed = succeed(Command::new("ip").args(["netns", "del", &name]));
        let namespace = Self(file.expect("the namespace just made"));
        removed.expect("its name can be removed");
        namespace.ip("link set dev lo up");
        // Nothing but the routers' own packets shall be counted.
        let _ = namespace.run(|| fs::write("/proc/sys/net/ipv6/conf/all/disable_ipv6", "1"));
        Some(namespace)
    }

    /// Does something inside: sockets made and programs started there stay there.
    pub(crate) fn run<T: Send>(&self, action: impl FnOnce() -> T + Send) -> T {
        let inside = || {
            let network = Some(LinkNameSpaceType::Network);
            move_into_link_name_space(self.0.as_fd(), network).expect("a namespace to enter");
            action()
        };
        thread::scope(|scope| match scope.spawn(inside).join() {
            Ok(result) => result,
            Err(panic) => std::panic::resume_unwind(panic),
        })
    }

    /// Runs `ip` with these arguments inside.
    #[track_caller]
    pub(crate) fn ip(&self, arguments: &str) {
        let done = self.try_run("ip", arguments);
        done.unwrap_or_else(|error| panic!("ip {arguments}: {error}"));
    }

    /// Runs a program with these arguments inside; the error is what it said.
    pub(crate) fn try_run(&self, program: &str, arguments: &str) -> Result<(), String> {
        self.run(|| succeed(Command::new(program).args(arguments.split_whitespace())))
    }

    /// How other programs may name it, as long as this one runs.
    pub(crate) fn path(&self) -> String {
        format!("/proc/{}/fd/{}", process::id(), self.0.as_raw_fd())
    }

    /// How many packets went over a device of it so far.
    pub(crate) fn traffic(&self, device: &str) -> Traffic {
        let table = self.run(|| fs::read_to_string("/proc/thread-self/net/dev"));
        let table = table.expect("the table of devices");
        let lines = table.lines().filter_map(|line| line.trim().split_once(':'));
        let mut found = lines.filter(|(name, _)| *name == device);
        let numbers = found.next().expect("the device").1;
        let number = |at| numbers.split_whitespace().nth(at)?.parse().ok();
        let packets = |at| number(at).expect("a number of packets");
        Traffic { received: packets(1), sent: packets(9) }
    }
}

/// A name that no namespace has. One that was killed may have left its own behind, and numbers of
/// processes come again.
fn free_name() -> String {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    loop {
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let name = format!("mavswitch-{}-{number}", process::id());
        if !Path::new("/run/netns").join(&name).exists() {
            return name;
        }
    }
}

/// Runs a program to its end; the error is what it said, or that there is no such program.
fn succeed(command: &mut Command) -> Result<(), String> {
    let program = command.get_program().to_string_lossy().into_owned();
    let output = command.output().map_err(|error| format!("{program}: {error}"))?;
    let said = String::from_utf8_lossy(&output.stderr).trim().to_owned();
    if output.status.success() { Ok(()) } else { Err(said) }
}

/// Writes a line to standard error that is seen even if the test passes.
pub(crate) fn say(text: &str) {
    let test = thread::current().name().unwrap_or("test").to_owned();
    // Around the capture of the test runner, which takes only what the macros print.
    let _ = writeln!(io::stderr(), "{test}: {text}");
}
