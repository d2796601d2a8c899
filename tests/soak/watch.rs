//! What the program holds while it runs, and when all trouble is over.

use std::thread;
use std::time::{Duration, Instant};

use crate::Clock;
use crate::harness::*;

/// How often we look.
const PERIOD: Duration = Duration::from_millis(250);

/// How often the log of the run says how it is.
const TOLD: Duration = Duration::from_secs(60);

/// What an allocator keeps, and not what a leak takes.
const SLACK_KIB: usize = 1_024;

/// The most that was held in each third of the run, and what was held before it.
pub(crate) struct Watch {
    descriptors: usize,
    most_kib: [usize; 3],
    most_descriptors: [usize; 3],
}

impl Watch {
    /// Before the trouble, with all whose links are well.
    pub(crate) fn begin(router: &Router) -> Self {
        let descriptors = router.process().descriptors();
        Self { descriptors, most_kib: [0; 3], most_descriptors: [0; 3] }
    }

    pub(crate) fn until_over(&mut self, router: &Router, clock: &Clock) {
        let mut told = Instant::now();
        while !clock.is_over() {
            thread::sleep(PERIOD);
            let (process, third) = (router.process(), clock.third());
            let (kib, descriptors) = (process.resident_kib(), process.descriptors());
            self.most_kib[third] = self.most_kib[third].max(kib);
            self.most_descriptors[third] = self.most_descriptors[third].max(descriptors);
            if told.elapsed() >= TOLD {
                told = Instant::now();
                let seconds = clock.now() / 1_000_000_000;
                println!("after {seconds} s: {kib} KiB, {descriptors} descriptors");
            }
        }
    }

    /// No descriptor more than before, but for those of links that were there then and are gone now;
    /// and no more memory in the last third than in the second, when everything has been done.
    pub(crate) fn judge(&self, router: &Router) {
        println!(
            "most of each third: {:?} KiB resident, {:?} descriptors; {} before",
            self.most_kib, self.most_descriptors, self.descriptors
        );
        let time = router.process().processor_time();
        println!("{time:.1?} of processor time, {} lines of log", router.log.len());
        // The four whose links were well have left.
        router.wait_for_descriptors(self.descriptors - 2);
        let [_, second, last] = self.most_kib;
        assert!(last <= second + SLACK_KIB, "memory grows: from {second} to {last} KiB");
    }
}
