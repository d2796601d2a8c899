//! A radio that is offered twice what it carries: nothing torn, nothing directed lost, nothing late.

use std::time::Duration;

use crate::harness::*;
use crate::overloaded_line::{Outcome, overload};

const TCP: &str = "tcpin:127.0.0.1:0?name=tcp";

/// How long the radio is offered too much; the bench has more time.
const TIME: Duration = Duration::from_secs(8);

/// On a machine that keeps the test itself waiting for longer, figures say nothing of the router.
const QUIET: Duration = Duration::from_millis(20);

#[test]
fn an_overloaded_radio_at_57600_baud_gives_whole_frames_in_time() {
    let outcome = overloaded(57_600);
    assert_unharmed(&outcome);
    assert_in_time(&outcome, 1);
}

#[test]
fn an_overloaded_radio_at_9600_baud_gives_whole_frames_in_its_time() {
    let outcome = overloaded(9_600);
    assert_unharmed(&outcome);
    assert_in_time(&outcome, 6);
}

fn overloaded(baud: u32) -> Outcome {
    let pty = Pty::new();
    let radio = format!("serial:{}:{baud}?name=radio", pty.device());
    let router = Router::start(&[&radio, TCP]);
    overload(pty.wire, router.address("tcp"), baud, TIME)
}

/// What holds on any machine that drains the line at all: a test that is kept waiting itself makes
/// the line slower than its baud rate, and ends in the middle of a frame.
fn assert_unharmed(outcome: &Outcome) {
    println!("{}\n{}", Outcome::HEAD, outcome.row("mavswitch"));
    assert_eq!(outcome.disordered, 0, "frames out of order");
    assert!(outcome.torn < 280, "{} bytes of torn frames", outcome.torn);
    if outcome.lateness.p99() > QUIET {
        return println!("machine too busy: the line was no line");
    }
    assert_eq!(outcome.torn, 0, "bytes of torn frames");
    assert_eq!(outcome.directed.lost(), 0, "directed frames lost");
    assert_eq!(outcome.heartbeats.lost(), 0, "heartbeats lost");
    assert!(outcome.telemetry.lost() > 0, "nothing was refused: the line was not overloaded");
    assert!(!outcome.telemetry.ages.is_empty(), "no telemetry at all");
}

/// The figures that the design promises, on a line so many times slower than 57,600 baud.
fn assert_in_time(outcome: &Outcome, slower: u32) {
    let lateness = outcome.lateness.p99();
    if lateness > QUIET {
        return println!("machine too busy, figures not judged: {lateness:?} late by itself");
    }
    let limit = |millis| Duration::from_millis(millis) * slower;
    let (directed, telemetry) = (outcome.directed.age(0.99), outcome.telemetry.age(0.99));
    assert!(directed <= limit(400), "directed frames are {directed:?} old");
    assert!(telemetry <= limit(500), "telemetry is {telemetry:?} old");
    assert!(outcome.line_use >= 0.95, "the line was used {:.3} of the time", outcome.line_use);
}
