//! What routers make of a radio that is offered twice what it carries: one row of a table for each.
//!
//! `cargo bench --bench overload` measures this program. Others are measured beside it if they are
//! named, one a line, in `OVERLOAD_ROUTERS`:
//!
//! ```text
//! some-router=some-routerd -t {port} {pty}:{baud}
//! ```
//!
//! Each is to open the terminal `{pty}` at `{baud}` and to listen on the TCP port `{port}`.
//! `OVERLOAD_BAUDS` (57600,9600) and `OVERLOAD_SECONDS` (15) change what is measured.

#![allow(clippy::unwrap_used)]

use std::env;
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

#[allow(dead_code, unused_imports, unreachable_pub)]
#[path = "../integration/harness/mod.rs"]
mod harness;
#[allow(dead_code)]
#[path = "../integration/overloaded_line.rs"]
mod overloaded_line;

use harness::{PROGRAM, Pty, eventually};
use overloaded_line::{Outcome, overload};

fn main() {
    // `cargo test --all-targets` runs this too, and wants no figures.
    if !env::args().any(|argument| argument == "--bench") {
        return;
    }
    let setting = |name: &str, default: &str| env::var(name).unwrap_or_else(|_| default.to_owned());
    let seconds = setting("OVERLOAD_SECONDS", "15").parse().expect("a number of seconds");
    let ours = format!("mavswitch={PROGRAM} serial:{{pty}}:{{baud}} tcpin:127.0.0.1:{{port}}");
    let routers = format!("{ours}\n{}", setting("OVERLOAD_ROUTERS", ""));
    for baud in setting("OVERLOAD_BAUDS", "57600,9600").split(',') {
        let baud = baud.parse().expect("a baud rate");
        println!("\n{baud} baud, offered twice that for {seconds} s\n\n{}", Outcome::HEAD);
        for line in routers.lines().filter(|line| !line.trim().is_empty()) {
            let (name, template) = line.split_once('=').expect("NAME=COMMAND");
            let outcome = measure(template, baud, Duration::from_secs(seconds));
            println!("{}", outcome.row(name.trim()));
        }
    }
}

fn measure(template: &str, baud: u32, time: Duration) -> Outcome {
    let pty = Pty::new();
    let address = free_address();
    let command = template
        .replace("{pty}", pty.device())
        .replace("{baud}", &baud.to_string())
        .replace("{port}", &address.port().to_string());
    let _router = start(&command);
    eventually("the router listens", || TcpStream::connect(address).is_ok());
    overload(pty.wire, address, baud, time)
}

/// An address at which nobody listens.
fn free_address() -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    listener.local_addr().expect("its address")
}

/// A router, killed when it has been measured.
struct Running(Child);

fn start(command: &str) -> Running {
    let mut shell = Command::new("sh");
    shell.args(["-c", &format!("exec {command}")]);
    let quiet = shell.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    Running(quiet.spawn().expect("a shell"))
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
