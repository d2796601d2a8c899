//! The program under test: started, listened to, ended.

use std::fs::{self, Permissions};
use std::net::SocketAddr;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Output, Stdio};
use std::thread;

use mavswitch::mavlink::Component;
use rustix::pipe::fcntl_setpipe_size;
use rustix::process::{Pid, Signal, kill_process};

use super::dir::TempDir;
use super::log::Log;
use super::peer::{Peer, Wire};
use super::process::{Process, eventually};
use super::pty::{Pty, PtyWire};
use super::tcp::TcpWire;
use super::udp::UdpWire;

/// A running router. It must still run when the test is over, unless the test saw its end.
pub(crate) struct Router {
    child: Child,
    pub(crate) log: Log,
    ended: bool,
    /// Where it has its control socket, for itself.
    runtime: TempDir,
}

impl Router {
    /// Starts the router and waits until it has opened everything.
    pub(crate) fn start(arguments: &[&str]) -> Self {
        let router = Self::launch(arguments);
        router.log.wait_for(&["ready"]);
        router
    }

    /// The same with no more descriptors than that.
    pub(crate) fn start_limited(descriptors: usize, arguments: &[&str]) -> Self {
        let mut command = Command::new("sh");
        command.args(["-c", &format!("ulimit -n {descriptors} && exec \"$0\" \"$@\""), PROGRAM]);
        without_manager(&mut command);
        let router = Self::spawn(&mut command, false, arguments);
        router.log.wait_for(&["ready"]);
        router
    }

    /// Starts the router, and has all of its system calls that are called `call` and are about
    /// `path` take so many seconds more: a driver that is stuck.
    pub(crate) fn start_delayed(call: &str, path: &str, seconds: u32, arguments: &[&str]) -> Self {
        let delay = format!("inject={call}:delay_enter={seconds}s");
        Self::start_traced(&["-P", path, "-e", &delay], arguments)
    }

    /// The same for the first so many calls of each thread, whatever they are about, and no other
    /// call is slower: a disk that stands still.
    pub(crate) fn start_stuck(call: &str, times: u32, seconds: u32, arguments: &[&str]) -> Self {
        let delay = format!("inject={call}:delay_enter={seconds}s:when=1..{times}");
        let only = format!("trace={call}");
        Self::start_traced(&["--seccomp-bpf", "-e", &only, "-e", &delay], arguments)
    }

    fn start_traced(how: &[&str], arguments: &[&str]) -> Self {
        let mut command = Command::new("strace");
        // As a grandchild, so that the router is our child.
        command.args(["-D", "-f", "-qq", "-o", "/dev/null"]).args(how).arg(PROGRAM);
        Self::start_command(command, arguments)
    }

    /// The same by a command that gives it another name or surroundings.
    pub(crate) fn start_command(mut command: Command, arguments: &[&str]) -> Self {
        let router = Self::spawn(&mut command, false, arguments);
        router.log.wait_for(&["ready"]);
        router
    }

    /// Starts the router and waits for nothing.
    pub(crate) fn launch(arguments: &[&str]) -> Self {
        Self::launch_in(arguments, |_| {})
    }

    /// The same with a log that holds little while nobody reads it.
    pub(crate) fn launch_with_narrow_log(arguments: &[&str]) -> Self {
        let mut command = Command::new(PROGRAM);
        without_manager(&mut command);
        Self::spawn(&mut command, true, arguments)
    }

    /// The same as another user, if one is given.
    pub(crate) fn launch_as(user: Option<u32>, arguments: &[&str]) -> Self {
        Self::launch_in(arguments, |command| {
            user.map(|user| command.uid(user).gid(user));
        })
    }

    /// The same with a terminal as its standard input.
    pub(crate) fn launch_at(terminal: &Path, arguments: &[&str]) -> Self {
        let mut command = Command::new("sh");
        command.args(["-c", "exec \"$0\" \"$@\" <\"$TERMINAL\"", PROGRAM]);
        without_manager(command.env("TERMINAL", terminal));
        Self::spawn(&mut command, false, arguments)
    }

    /// The same in surroundings of which `prepare` says more.
    pub(crate) fn launch_in(arguments: &[&str], prepare: impl FnOnce(&mut Command)) -> Self {
        let mut command = Command::new(PROGRAM);
        without_manager(&mut command);
        prepare(&mut command);
        Self::spawn(&mut command, false, arguments)
    }

    fn spawn(command: &mut Command, narrow: bool, arguments: &[&str]) -> Self {
        command.args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        let runtime = own_runtime(command);
        let mut child = command.spawn().expect("the program starts");
        let errors = child.stderr.take().expect("its standard error");
        if narrow {
            fcntl_setpipe_size(&errors, 4096).expect("a small pipe");
        }
        let log = Log::follow(errors);
        Self { child, log, ended: false, runtime }
    }

    /// The address at which this endpoint listens.
    pub(crate) fn address(&self, endpoint: &str) -> SocketAddr {
        self.address_after(&format!("{endpoint}: listening on "))
    }

    /// The address from which this endpoint sends.
    pub(crate) fn sends_from(&self, endpoint: &str) -> SocketAddr {
        let line = self.log.wait_for(&[&format!("{endpoint}: link #"), " up: ", " from "]);
        first_word(line.split_once(" from ").expect("a source address").1)
    }

    fn address_after(&self, text: &str) -> SocketAddr {
        let line = self.log.wait_for(&[text]);
        first_word(line.split_once(text).expect("the text waited for").1)
    }

    /// Somebody new at a UDP port, already admitted.
    pub(crate) fn udp(&self, endpoint: &str, me: Component) -> Peer<UdpWire> {
        let wire = UdpWire::to(self.address(endpoint));
        let from = wire.address();
        let mut peer = Peer::new(wire, me);
        peer.send_mark();
        self.log.wait_for(&[&format!("{endpoint}: link #"), &format!(" up: {from}")]);
        peer
    }

    /// Somebody new at a TCP port, already known by its component id.
    ///
    /// Unless that component is known already: then only the connection is sure.
    pub(crate) fn tcp(&self, endpoint: &str, me: Component) -> Peer<TcpWire> {
        let known = self.log.has(&[&seen(me)]);
        let mut peer = self.tcp_silent(endpoint, me);
        peer.send_mark();
        if !known {
            self.log.wait_for(&[&seen(me), &format!(" on {endpoint} ")]);
        }
        peer
    }

    /// A new TCP connection on which nothing has been said yet.
    pub(crate) fn tcp_silent(&self, endpoint: &str, me: Component) -> Peer<TcpWire> {
        let wire = TcpWire::to(self.address(endpoint));
        self.wait_for_link(endpoint, &wire);
        Peer::new(wire, me)
    }

    /// A new TCP connection that the router may not have noticed yet.
    pub(crate) fn tcp_unnoticed(&self, endpoint: &str, me: Component) -> Peer<TcpWire> {
        Peer::new(TcpWire::to(self.address(endpoint)), me)
    }

    /// Waits until the router has noticed this connection.
    pub(crate) fn wait_for_link(&self, endpoint: &str, wire: &TcpWire) {
        let from = wire.stream.local_addr().expect("a connected socket");
        self.log.wait_for(&[&format!("{endpoint}: link #"), &format!(" up: {from}")]);
    }

    /// Somebody at a serial port that the router has been told to open.
    pub(crate) fn serial(&self, endpoint: &str, pty: Pty, me: Component) -> Peer<PtyWire> {
        self.log.wait_for(&[&format!("{endpoint}: link #"), " up"]);
        let mut peer = Peer::new(pty.wire, me);
        peer.send_mark();
        self.wait_until_seen(me);
        peer
    }

    /// Waits until the router has heard this component.
    pub(crate) fn wait_until_seen(&self, component: Component) {
        self.log.wait_for(&[&seen(component)]);
    }

    /// Waits until the router has no way to this component any more.
    pub(crate) fn wait_until_lost(&self, component: Component) {
        self.log.wait_for(&[&format!("component {component} lost")]);
    }

    /// Its control socket.
    pub(crate) fn control(&self) -> PathBuf {
        self.runtime.path("control")
    }

    /// What the kernel knows of it.
    pub(crate) fn process(&self) -> Process {
        Process(self.child.id())
    }

    /// Sends a signal.
    pub(crate) fn signal(&self, signal: Signal) {
        let id = self.child.id().try_into().ok().and_then(Pid::from_raw);
        kill_process(id.expect("a process id"), signal).expect("the program runs");
    }

    /// Waits for the end and gives everything it wrote.
    pub(crate) fn wait_for_end(mut self) -> (ExitStatus, String) {
        let text = self.log.wait_for_end();
        self.ended = true;
        (self.child.wait().expect("the program's end"), text)
    }

    /// Waits until it has no more open descriptors than that.
    pub(crate) fn wait_for_descriptors(&self, at_most: usize) {
        eventually(&format!("at most {at_most} descriptors"), || {
            self.process().descriptors() <= at_most
        });
    }

    /// Asserts that resident memory has grown by less than `mib` since it was `before_kib`.
    #[track_caller]
    pub(crate) fn assert_grown_less_than(&self, mib: usize, before_kib: usize) {
        let now = self.process().resident_kib();
        assert!(now < before_kib + mib * 1024, "memory grew from {before_kib} to {now} KiB");
    }

    /// Asserts that a frame gets through both ways.
    pub(crate) fn assert_serves(&self, a: &mut Peer<impl Wire>, b: &mut Peer<impl Wire>) {
        a.meet(b);
        b.meet(a);
    }
}

impl Drop for Router {
    fn drop(&mut self) {
        if self.ended {
            return;
        }
        let early = self.child.try_wait().ok().flatten();
        let _ = self.child.kill();
        let _ = self.child.wait();
        if thread::panicking() {
            eprintln!("the router's log:\n{}", self.log.text());
        } else if let Some(status) = early {
            panic!("the router ended by itself ({status}):\n{}", self.log.text());
        }
    }
}

/// Runs the program to its end, which is to come by itself.
pub(crate) fn run(arguments: &[&str]) -> Output {
    run_command(Command::new(PROGRAM), arguments)
}

/// The same by a command that gives it another name or surroundings.
pub(crate) fn run_command(mut command: Command, arguments: &[&str]) -> Output {
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    without_manager(&mut command);
    let _runtime = own_runtime(&mut command);
    let mut child = Guard(command.spawn().expect("the program starts"));
    let errors = Log::follow(child.0.stderr.take().expect("its standard error"));
    let output = Log::follow(child.0.stdout.take().expect("its standard output"));
    let (stderr, stdout) = (errors.wait_for_end(), output.wait_for_end());
    let status = child.0.wait().expect("the program's end");
    Output { status, stdout: stdout.into_bytes(), stderr: stderr.into_bytes() }
}

/// Whoever runs the tests may be a service, and what its manager told it is not for the program.
fn without_manager(command: &mut Command) {
    ["NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID", "JOURNAL_STREAM"].iter().for_each(|name| {
        command.env_remove(name);
    });
}

/// Whatever runs beside this test has another control socket.
fn own_runtime(command: &mut Command) -> TempDir {
    let runtime = TempDir::new();
    // Also for one that runs as somebody else.
    fs::set_permissions(runtime.path(""), Permissions::from_mode(0o777)).expect("our directory");
    if !command.get_envs().any(|(name, _)| name == "RUNTIME_DIRECTORY") {
        command.env("RUNTIME_DIRECTORY", runtime.path(""));
    }
    runtime
}

/// Nobody outlives the test that started it.
struct Guard(Child);

impl Drop for Guard {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The program as built for this test.
pub(crate) const PROGRAM: &str = env!("CARGO_BIN_EXE_mavswitch");

fn seen(component: Component) -> String {
    format!("component {component} seen on ")
}

/// The address at the start of `text`; a quotation mark of JSON or a path may follow.
pub(super) fn first_word(text: &str) -> SocketAddr {
    let end = text.find(|c: char| c.is_whitespace() || c == '"' || c == '/').unwrap_or(text.len());
    let word = &text[..end];
    word.parse().unwrap_or_else(|_| panic!("{word:?} is no address"))
}
