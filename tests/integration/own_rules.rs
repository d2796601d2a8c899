//! What is for the router as a component is for it alone; what it cannot check, it passes on unheard.

use mavswitch::mavlink::{Frame, Timing};

use super::own::{ALL, OWN, TIMESYNC, next_answer, timesync};
use crate::harness::*;

/// 1/191 says nothing to anybody but in answer.
fn router() -> Router {
    let endpoint = |name: &str| format!("tcpin:127.0.0.1:0?name={name}&own_component=false");
    let router = Router::start(&["--system=1", &endpoint("fc"), &endpoint("gcs")]);
    router.wait_until_seen(OWN);
    router
}

fn assert_answered(gcs: &mut Peer<TcpWire>, ts1: i64) {
    let (from, answer) = next_answer(gcs, GCS);
    let is_it = matches!(answer, Timing::Timesync { ts1: number, .. } if number == ts1);
    assert!(from == OWN && is_it, "{answer:?}");
}

#[test]
fn rule_40_what_is_for_the_own_component_ends_here_and_what_is_for_its_system_goes_on_too() {
    let router = router();
    let mut vehicle = router.tcp("fc", VEHICLE);
    let mut other = router.tcp("fc", OTHER);
    let mut gcs = router.tcp("gcs", GCS);
    // For 1/191: it is consumed, and not even the rest of its system hears of it.
    gcs.send(timesync(GCS, 0, 1, OWN));
    assert_answered(&mut gcs, 1);
    gcs.send(command_long(GCS, OWN));
    vehicle.expect_nothing_from(&mut gcs);
    other.expect_nothing_from(&mut gcs);
    // For all of system 1, of which the vehicle is a part.
    let question = timesync(GCS, 0, 2, Component::new(1, 0));
    gcs.send(&question);
    assert_answered(&mut gcs, 2);
    vehicle.expect(&question);
    other.expect_nothing_from(&mut gcs);
    // For everybody.
    let question = timesync(GCS, 0, 3, ALL);
    gcs.send(&question);
    assert_answered(&mut gcs, 3);
    vehicle.expect(&question);
    other.expect(&question);
    // For another component of its system, for which it does not act.
    let question = timesync(GCS, 0, 4, VEHICLE);
    gcs.send(&question);
    vehicle.expect(&question);
    gcs.expect_nothing_from(&mut vehicle);
}

#[test]
fn rule_55_a_question_that_is_signed_with_a_key_unknown_here_gets_no_answer_and_is_passed_on() {
    let router = router();
    let mut vehicle = router.tcp("fc", VEHICLE);
    let mut gcs = router.tcp("gcs", GCS);
    let plain = timesync(GCS, 0, 1, ALL);
    let payload = Frame::parse(&plain).unwrap().payload().to_vec();
    let signed = Draft::new(GCS, TIMESYNC, payload).signed().build();
    gcs.send(&signed);
    vehicle.expect(&signed);
    // The next answer is to the next question.
    gcs.send(timesync(GCS, 0, 2, ALL));
    assert_answered(&mut gcs, 2);
}
