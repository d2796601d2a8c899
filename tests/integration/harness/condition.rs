//! How a router is before a fault and must be again after it: as many descriptors, no more memory,
//! and at rest.

use std::thread;
use std::time::Duration;

use super::process::Process;
use super::router::Router;

/// What a router holds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Condition {
    descriptors: usize,
    resident_kib: usize,
}

/// By how much resident memory may have grown: what an allocator keeps, not what a leak takes.
const SLACK_MIB: usize = 2;

/// How long a router is watched at rest.
const WATCHED: Duration = Duration::from_millis(500);

impl Condition {
    /// What it holds now.
    pub(crate) fn of(router: &Router) -> Self {
        let process = router.process();
        Self { descriptors: process.descriptors(), resident_kib: process.resident_kib() }
    }

    /// Waits until it holds no more than it did, and sees it rest.
    #[track_caller]
    pub(crate) fn assert_restored(&self, router: &Router) {
        router.wait_for_descriptors(self.descriptors);
        router.assert_grown_less_than(SLACK_MIB, self.resident_kib);
        assert_rests(router.process());
    }
}

/// While there is nothing to do, a router must not be busy: 10 % of the time at most, and few
/// wake-ups. Neither grows on a machine that is busy with something else.
#[track_caller]
pub(crate) fn assert_rests(process: Process) {
    let before = (process.processor_time(), process.wakeups());
    thread::sleep(WATCHED);
    let used = process.processor_time() - before.0;
    let wakeups = process.wakeups() - before.1;
    assert!(used <= WATCHED / 10, "{used:?} of processor time in {WATCHED:?} of rest");
    assert!(wakeups <= 100, "{wakeups} wake-ups in {WATCHED:?} of rest");
}
