//! Looking into a running router: why frames go where they go, and frames as they pass.

use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};

use mavswitch::control::{Answer, Request};
use mavswitch::status::{FrameFate, Why};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

use crate::harness::*;

const UDP_AND_TCP: [&str; 2] = ["udpin:127.0.0.1:0?name=radio", "tcpin:127.0.0.1:0?name=gcs"];

fn why(router: &Router, from: &str, to: &str, message: &str) -> Why {
    let mut client = router.client();
    let (from, to, message) = (from.to_owned(), to.to_owned(), Some(message.to_owned()));
    match client.ask(Request::Why { from, to, message, mavlink: None, signed: None }).unwrap() {
        Answer::Why(why) => *why,
        other => panic!("{other:?}"),
    }
}

/// `mavswitch COMMAND...`, asking this router.
fn ask(router: &Router, arguments: &[&str]) -> String {
    let output = router.ask(arguments);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    text + &String::from_utf8_lossy(&output.stderr)
}

/// Somebody who listens.
struct Listener {
    child: Child,
    lines: BufReader<ChildStdout>,
}

impl Listener {
    fn start(router: &Router, arguments: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_mavswitch"));
        command.arg("listen").args(arguments).arg("--control").arg(router.control());
        let mut child = command.stdout(Stdio::piped()).spawn().expect("the program starts");
        let lines = BufReader::new(child.stdout.take().expect("its standard output"));
        router.log.wait_for(&["somebody listens"]);
        Self { child, lines }
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.lines.read_line(&mut line).expect("a line");
        line
    }

    fn signal(&self, signal: Signal) {
        let id = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw);
        kill_process(id.expect("a process id"), signal).expect("the program runs");
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn why_says_on_which_link_the_target_is_and_why_the_others_get_nothing() {
    let router = Router::start(&UDP_AND_TCP);
    let mut vehicle = router.udp("radio", VEHICLE);
    let mut gcs = router.tcp("gcs", GCS);
    let mut other = router.tcp("gcs", GCS_2);
    let answer = why(&router, "255/190", "1/1", "COMMAND_LONG");
    let [frame] = &answer.frames[..] else { panic!("{answer:?}") };
    assert!(frame.arrives() && answer.from_is_known && answer.to_is_known);
    let fates: Vec<_> = frame.links.iter().map(|it| (&*it.endpoint, &*it.reason)).collect();
    assert_eq!(fates, [("radio", "route"), ("gcs", "own_link"), ("gcs", "unheard")]);
    gcs.send(command_long(GCS, VEHICLE));
    vehicle.expect(command_long(GCS, VEHICLE));
    other.expect_nothing_from(&mut gcs);
    let text = ask(&router, &["why", "255/190", "1/1", "command_long"]);
    let head = "255/190 -> 1/1 COMMAND_LONG: from gcs (127.0.0.1:";
    assert!(text.starts_with(head) && text.contains(") to radio (127.0.0.1:"), "{text}");
    assert!(text.contains("not to gcs") && text.contains("was never heard there"), "{text}");
}

#[test]
fn why_knows_a_vehicle_by_the_id_that_it_has_here_and_what_cannot_be_converted() {
    let two = "udpin:127.0.0.1:0?name=two&remap=1:7";
    let router = Router::start(&[two, "tcpin:127.0.0.1:0?name=old&version=1"]);
    let seven = Component::new(7, 1);
    let mut vehicle = router.udp("two", VEHICLE);
    router.wait_until_seen(seven);
    let mut gcs = router.tcp("old", GCS);
    vehicle.meet(&mut gcs);
    let fates = |from: &str, to: &str, message: &str| {
        let answer = why(&router, from, to, message);
        let [frame] = &answer.frames[..] else { panic!("{answer:?}") };
        let fates = frame.links.iter().map(|it| format!("{} {}", it.endpoint, it.reason));
        fates.collect::<Vec<_>>()
    };
    assert_eq!(fates("255/190", "7/1", "COMMAND_LONG"), ["two route", "old own_link"]);
    assert_eq!(fates("7/1", "255/190", "COMMAND_LONG"), ["two own_link", "old route"]);
    // Its id is above 255.
    let fate = fates("7/1", "all", "OPEN_DRONE_ID_BASIC_ID");
    assert_eq!(fate, ["two own_link", "old not_converted"]);
}

#[test]
fn why_finds_the_list_that_keeps_a_message_from_the_ground_station() {
    let router = Router::start(&[
        "udpin:127.0.0.1:0?name=radio",
        "tcpin:127.0.0.1:0?name=gcs&allow_messages_out=ATTITUDE",
    ]);
    let _vehicle = router.udp("radio", VEHICLE);
    let _gcs = router.tcp("gcs", GCS);
    let answer = why(&router, "1/1", "255/190", "HEARTBEAT");
    assert!(!answer.frames.iter().any(FrameFate::arrives), "{answer:?}");
    let text = ask(&router, &["why", "1/1", "gcs"]);
    assert!(text.contains("its lists of what goes out do not let it"), "{text}");
}

#[test]
fn why_of_somebody_who_was_never_heard_says_who_was() {
    let router = Router::start(&UDP_AND_TCP);
    let _vehicle = router.udp("radio", VEHICLE);
    let text = ask(&router, &["why", "1/1", "2/1"]);
    assert!(text.contains("2/1 was never heard; heard were 1/1 on radio"), "{text}");
    assert!(text.contains("gcs: nobody has come yet"), "{text}");
    let text = ask(&router, &["why"]);
    assert!(text.contains("gcs: nobody has come yet"), "{text}");
    let text = ask(&router, &["why", "0/190", "1/1"]);
    assert!(text.contains("0/190 has system 0") && text.contains("source_system"), "{text}");
    let text = ask(&router, &["why", "1/1", "nowhere"]);
    assert!(text.contains("nowhere is nobody") && text.contains("radio, gcs"), "{text}");
}

#[test]
fn listen_shows_frames_with_their_fields_and_where_they_went() {
    let router = Router::start(&UDP_AND_TCP);
    let mut vehicle = router.udp("radio", VEHICLE);
    let mut gcs = router.tcp("gcs", GCS);
    let mut listener = Listener::start(&router, &["1/1", "HEARTBEAT,COMMAND_ACK", "-n", "2"]);
    vehicle.send(attitude(VEHICLE, 1));
    vehicle.send(heartbeat(VEHICLE));
    gcs.send(heartbeat(GCS));
    vehicle.send(command_ack(VEHICLE, Component::new(9, 9)));
    let first = listener.line();
    assert!(first.contains("radio > gcs") && first.contains("1/1 -> all"), "{first}");
    assert!(first.contains("HEARTBEAT") && first.contains("mavlink_version="), "{first}");
    let second = listener.line();
    assert!(second.contains("(no_route)") && second.contains("1/1 -> 9/9"), "{second}");
    assert_eq!(listener.line(), "", "after so many it ends");
    assert!(listener.child.wait().unwrap().success());
}

#[test]
fn listen_as_json_has_the_bytes_and_shows_no_secret_key() {
    let router = Router::start(&UDP_AND_TCP);
    let mut vehicle = router.udp("radio", VEHICLE);
    let _gcs = router.tcp("gcs", GCS);
    let mut listener = Listener::start(&router, &["--json", "from=radio"]);
    vehicle.send(setup_signing(VEHICLE, GCS));
    vehicle.send(attitude(VEHICLE, 7));
    let line: Value = serde_json::from_str(&listener.line()).unwrap();
    assert_eq!((&line["name"], &line["system"]), (&"ATTITUDE".into(), &1.into()));
    assert_eq!(line["to"], serde_json::json!(["gcs"]));
    assert!(line["fields"]["time_boot_ms"].is_u64(), "{line}");
    let digits: String = attitude(VEHICLE, 7).iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(line["bytes"], digits.as_str());
}

#[test]
fn a_wrong_filter_says_what_is_meant() {
    let router = Router::start(&UDP_AND_TCP);
    let text = ask(&router, &["listen", "HEARTBEET"]);
    assert!(text.contains("HEARTBEET is no message") && text.contains("HEARTBEAT"), "{text}");
}

#[test]
fn a_listener_that_is_stopped_keeps_nobody_waiting_and_is_told_what_it_missed() {
    let router = Router::start(&UDP_AND_TCP);
    let mut vehicle = router.tcp("gcs", VEHICLE);
    let mut gcs = router.tcp("gcs", GCS);
    let mut listener = Listener::start(&router, &[]);
    listener.signal(Signal::STOP);
    let before = router.process().resident_kib();
    // More than its connection, its pipe and what may wait for it hold together.
    const FRAMES: u32 = 20_000;
    for block in 0..FRAMES / 200 {
        let frames = (0..200).map(|n| attitude(VEHICLE, block * 200 + n)).collect::<Vec<_>>();
        vehicle.send(frames.concat());
        gcs.expect_each(&frames);
    }
    router.assert_grown_less_than(8, before);
    listener.signal(Signal::CONT);
    let mut shown = 0;
    let missed = loop {
        let line = listener.line();
        assert!(!line.is_empty(), "it ended after {shown} frames");
        if let Some(rest) = line.strip_prefix("... up to ") {
            break rest.split(' ').next().unwrap().parse::<u32>().unwrap();
        }
        shown += 1;
        // So that there is something to tell of what was missed with.
        if shown % 500 == 0 {
            vehicle.send(attitude(VEHICLE, FRAMES));
        }
    };
    assert!(missed > 0 && shown + missed >= 1_000, "{shown} shown, {missed} missed");
    router.assert_serves(&mut gcs, &mut vehicle);
}

#[test]
fn a_listener_whose_reader_has_read_enough_ends() {
    let router = Router::start(&UDP_AND_TCP);
    let mut vehicle = router.udp("radio", VEHICLE);
    let mut listener = Listener::start(&router, &[]);
    let mut one = [0];
    vehicle.send(heartbeat(VEHICLE));
    listener.lines.read_exact(&mut one).unwrap();
    // As `head` does.
    drop(std::mem::replace(&mut listener.lines, nothing()));
    let mut status = None;
    eventually("the end of the listener", || {
        vehicle.send(heartbeat(VEHICLE));
        status = listener.child.try_wait().unwrap();
        status.is_some()
    });
    assert!(status.unwrap().success());
}

#[test]
fn on_a_terminal_an_interrupt_ends_it_and_leaves_a_clean_screen() {
    if !is_there("tmux") {
        return eprintln!("skipped: there is no tmux");
    }
    let router = Router::start(&UDP_AND_TCP);
    let mut vehicle = router.udp("radio", VEHICLE);
    let _gcs = router.tcp("gcs", GCS);
    let control = router.control();
    let (program, control) = (quoted(PROGRAM), quoted(control.to_str().expect("a path")));
    let line = format!("{program} listen 1/1 --control {control}; echo ended with $?");
    let terminal = Terminal::start(200, 24, &line);
    router.log.wait_for(&["somebody listens"]);
    vehicle.send(heartbeat(VEHICLE));
    let screen = terminal.wait_for("mavlink_version=");
    assert!(screen.contains("radio > gcs") && screen.contains("HEARTBEAT"), "{screen}");
    terminal.press(&["C-c"]);
    let screen = terminal.wait_for("ended with 0");
    assert!(!screen.contains("panicked"), "{screen}");
}

/// A pipe with nothing in it.
fn nothing() -> BufReader<ChildStdout> {
    let mut child = Command::new(Path::new("true")).stdout(Stdio::piped()).spawn().unwrap();
    let stdout = child.stdout.take().unwrap();
    child.wait().unwrap();
    BufReader::new(stdout)
}
