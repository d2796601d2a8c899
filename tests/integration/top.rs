//! `mavswitch top` on a terminal, driven by tmux as a user would: keys in, the screen out.

use std::path::Path;
use std::process::{Command, Output};

use rustix::process::{Pid, Signal, kill_process};

use crate::harness::*;

/// A terminal of 80 by 24 with a shell in it.
struct Terminal {
    dir: TempDir,
}

impl Terminal {
    /// Without job control, so that it takes no notice of a `top` that is stopped. `None`, and says so, where there is no tmux.
    fn open() -> Option<Self> {
        if Command::new("tmux").arg("-V").output().is_err() {
            println!("skipped: there is no tmux here");
            return None;
        }
        let terminal = Self { dir: TempDir::new() };
        let shell = ["new-session", "-d", "-x", "80", "-y", "24", "env PS1='$ ' sh +m"];
        let output = terminal.tmux(&shell);
        assert!(output.status.success(), "{output:?}");
        terminal.wait_for("$");
        Some(terminal)
    }

    fn tmux(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new("tmux");
        command.arg("-f/dev/null").arg("-S").arg(self.dir.path("tmux")).args(arguments);
        command.output().expect("tmux")
    }

    fn press(&self, keys: &[&str]) {
        self.tmux(&[&["send-keys"], keys].concat());
    }

    /// Runs `top`; what the shell says when it has ended is `top ended: STATUS`.
    fn top(&self, control: &Path) {
        let line = format!("{PROGRAM} top --control {}; echo top ended: $?", control.display());
        self.press(&["-l", &line]);
        self.press(&["Enter"]);
    }

    fn screen(&self) -> String {
        String::from_utf8_lossy(&self.tmux(&["capture-pane", "-p"]).stdout).into_owned()
    }

    fn wait_for(&self, text: &str) {
        let mut screen = String::new();
        let shows = || {
            screen = self.screen();
            screen.contains(text)
        };
        eventually(&format!("`{text}` on the screen"), shows);
    }

    /// The process of `top`, the child of the shell.
    fn process(&self) -> Pid {
        let shell = self.tmux(&["list-panes", "-F", "#{pane_pid}"]);
        let shell = String::from_utf8_lossy(&shell.stdout).trim().to_owned();
        let children = std::fs::read_to_string(format!("/proc/{shell}/task/{shell}/children"));
        let child = children.unwrap().split_whitespace().next().unwrap().parse().unwrap();
        Pid::from_raw(child).unwrap()
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        self.tmux(&["kill-server"]);
    }
}

fn router() -> Router {
    Router::start(&["udpin:127.0.0.1:0?name=ground", "tcpin:127.0.0.1:0?name=vehicles"])
}

#[test]
fn keys_show_links_and_components_and_the_screen_is_given_back() {
    let Some(terminal) = Terminal::open() else { return };
    let router = router();
    let mut vehicle = router.tcp("vehicles", VEHICLE);
    let mut gcs = router.udp("ground", GCS);
    router.assert_serves(&mut gcs, &mut vehicle);
    terminal.top(&router.control());
    terminal.wait_for("LIVE");
    terminal.wait_for("vehicles");
    terminal.press(&["2"]);
    terminal.wait_for("255/190");
    terminal.press(&["/", "1", "/", "1", "Enter"]);
    eventually("other components are left out", || !terminal.screen().contains("255/190"));
    terminal.press(&["?"]);
    terminal.wait_for("pause, and go on");
    terminal.press(&["x", "Space"]);
    terminal.wait_for("PAUSED");
    terminal.tmux(&["resize-window", "-x", "120", "-y", "40"]);
    terminal.wait_for("LAST MINUTE");
    terminal.press(&["q"]);
    terminal.wait_for("top ended: 0");
    assert!(!terminal.screen().contains("PAUSED"), "{}", terminal.screen());
}

#[test]
fn a_signal_gives_the_screen_back_too() {
    let Some(terminal) = Terminal::open() else { return };
    let router = router();
    terminal.top(&router.control());
    terminal.wait_for("LIVE");
    kill_process(terminal.process(), Signal::TERM).unwrap();
    terminal.wait_for("top ended: 0");
    // Whoever types now sees it: the shell echoes, line by line.
    terminal.press(&["echo $((6*7))", "Enter"]);
    terminal.wait_for("42");
}

#[test]
fn a_terminal_that_goes_takes_it_along() {
    let Some(terminal) = Terminal::open() else { return };
    let router = router();
    terminal.top(&router.control());
    terminal.wait_for("LIVE");
    let top = terminal.process();
    drop(terminal);
    eventually("it is gone", || rustix::process::test_kill_process(top).is_err());
}

#[test]
fn a_router_that_goes_and_comes_back_is_followed() {
    let Some(terminal) = Terminal::open() else { return };
    let dir = TempDir::new();
    let control = dir.path("control");
    let arguments = ["--control", control.to_str().unwrap(), "udpin:127.0.0.1:0?name=ground"];
    let router = Router::start(&arguments);
    terminal.top(&control);
    terminal.wait_for("LIVE");
    router.signal(Signal::TERM);
    router.wait_for_end();
    terminal.wait_for("RECONNECTING");
    let _router = Router::start(&arguments);
    terminal.wait_for("LIVE");
    terminal.press(&["C-c"]);
    terminal.wait_for("top ended: 0");
}

#[test]
fn a_top_that_is_stopped_changes_nothing_for_the_traffic() {
    let Some(terminal) = Terminal::open() else { return };
    let router = router();
    let mut vehicle = router.tcp("vehicles", VEHICLE);
    let mut gcs = router.udp("ground", GCS);
    terminal.top(&router.control());
    terminal.wait_for("LIVE");
    let top = terminal.process();
    kill_process(top, Signal::STOP).unwrap();
    let before = router.process().resident_kib();
    let end = std::time::Instant::now() + std::time::Duration::from_secs(5);
    while std::time::Instant::now() < end {
        router.assert_serves(&mut gcs, &mut vehicle);
    }
    router.assert_grown_less_than(2, before);
    kill_process(top, Signal::CONT).unwrap();
    terminal.press(&["q"]);
    terminal.wait_for("top ended: 0");
}
