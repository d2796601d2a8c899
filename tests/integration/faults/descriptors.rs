//! No descriptors left: those who are there are served, the others wait, and nobody spins.

use crate::harness::*;

const TCP: &str = "tcpin:127.0.0.1:0?name=tcp";
const UDP: &str = "udpin:127.0.0.1:0?name=udp";

/// How many descriptors the router may have.
const LIMIT: usize = 40;

#[test]
fn callers_beyond_the_last_descriptor_wait_until_there_are_some_again() {
    let router = Router::start_limited(LIMIT, &[TCP, UDP]);
    let mut vehicle = router.udp("udp", VEHICLE);
    let mut gcs = router.tcp("tcp", GCS);
    let before = Condition::of(&router);
    let ids = (1..=60).map(|n| Component::new(100 + n, 1));
    let mut callers: Vec<_> = ids.map(|id| router.tcp_unnoticed("tcp", id)).collect();
    eventually("all descriptors are used", || router.process().descriptors() >= LIMIT);
    router.assert_serves(&mut gcs, &mut vehicle);
    assert_rests(router.process());
    assert_rests(router.process());
    // The first half hangs up, and the second half is served.
    let mut waiting = callers.split_off(30);
    drop(callers);
    for caller in &mut waiting[..30 - LIMIT / 4] {
        router.assert_serves(caller, &mut vehicle);
    }
    drop(waiting);
    assert!(router.log.len() < 100, "{} lines", router.log.len());
    router.assert_serves(&mut gcs, &mut vehicle);
    before.assert_restored(&router);
    // Nothing is left of the trouble.
    let mut late = router.tcp_unnoticed("tcp", OTHER);
    router.assert_serves(&mut late, &mut vehicle);
}
