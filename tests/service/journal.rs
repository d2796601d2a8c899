//! What the journal of systemd gets, and who else gets something else.

use std::io::{self, PipeWriter};
use std::net::TcpListener;
use std::process::{Command, Stdio};
use std::thread;

use rustix::process::Signal;

use crate::harness::*;

const TCP: &str = "tcpin:127.0.0.1:0?name=tcp";

/// Asserts that each line has a priority, one of these, and no time before its text.
#[track_caller]
fn assert_priorities(text: &str, known: &[&str]) {
    assert!(!text.is_empty());
    for line in text.lines() {
        let (priority, text) = line.split_at_checked(3).expect("a priority");
        assert!(known.contains(&priority), "{line}");
        assert!(text.starts_with(char::is_alphabetic), "{line}");
    }
}

#[test]
fn lines_for_the_journal_have_priorities_and_no_time() {
    let absent = TempDir::new().path("absent");
    let absent = format!("serial:{}:57600?name=fc", absent.display());
    let router = Router::start(&["--log-format", "journal", "-v", TCP, &absent]);
    let _vehicle = router.tcp("tcp", VEHICLE);
    router.log.wait_for(&["<6>tcp: link #", " up: "]);
    router.log.wait_for(&["<4>fc: cannot open ", "; waiting for it"]);
    router.signal(Signal::TERM);
    let (_, text) = router.wait_for_end();
    assert_priorities(&text, &["<4>", "<6>", "<7>"]);
    assert!(text.contains("<7>tcp: link #"), "{text}");
    assert!(!text.contains("INFO") && !text.contains("WARN"), "{text}");
}

#[test]
fn the_reason_of_the_end_is_an_error_in_the_journal() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let in_use = format!("tcpin:{}", listener.local_addr().unwrap());
    let output = run(&["--log-format", "journal", &in_use]);
    let text = String::from_utf8(output.stderr).unwrap();
    assert_priorities(&text, &["<3>", "<6>"]);
    assert!(text.lines().last().unwrap().starts_with("<3>tcpin:127.0.0.1:"), "{text}");
}

/// Runs the program to its end, a refused start, with standard error on a pipe that it is told to
/// be the journal, if `stream` says so of the pipe.
fn refused(stream: impl FnOnce(&PipeWriter) -> String) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let in_use = format!("tcpin:{}", listener.local_addr().unwrap());
    let (reader, writer) = io::pipe().unwrap();
    let mut command = Command::new(PROGRAM);
    command.arg(in_use).stdin(Stdio::null()).env("JOURNAL_STREAM", stream(&writer));
    let mut child = command.stderr(writer).spawn().unwrap();
    // It holds the other end of the pipe.
    drop(command);
    let text = thread::spawn(|| io::read_to_string(reader).unwrap());
    child.wait().unwrap();
    text.join().unwrap()
}

#[test]
fn the_journal_is_known_by_its_file() {
    let text = refused(|pipe| {
        let file = rustix::fs::fstat(pipe).unwrap();
        format!("{}:{}", file.st_dev, file.st_ino)
    });
    assert_priorities(&text, &["<3>", "<6>"]);
}

#[test]
fn another_file_than_the_journal_gets_text() {
    for stream in ["1:1", "", "nonsense"] {
        let text = refused(|_| stream.to_owned());
        assert!(text.contains(" INFO ") && text.contains("\nmavswitch: "), "{text}");
    }
}

#[test]
fn in_a_log_of_objects_the_reason_of_the_end_is_one_too() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let in_use = format!("tcpin:{}", listener.local_addr().unwrap());
    let output = run(&["--log-format", "json", &in_use]);
    let text = String::from_utf8(output.stderr).unwrap();
    let last: serde_json::Value = serde_json::from_str(text.lines().last().unwrap()).unwrap();
    assert_eq!(last["level"], "ERROR");
    assert!(last["fields"]["message"].as_str().unwrap().contains("in use"), "{text}");
}
