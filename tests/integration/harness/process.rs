//! What the kernel says about a running program: memory, descriptors, processor time.

use std::fs;
use std::path::PathBuf;
use std::thread;
use std::time::{Duration, Instant};

use super::PATIENCE;

/// A process, by its id.
#[derive(Clone, Copy)]
pub(crate) struct Process(pub(crate) u32);

impl Process {
    /// Resident memory in KiB.
    pub(crate) fn resident_kib(self) -> usize {
        let status = self.read("status");
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
        let number = line.and_then(|line| line.trim().strip_suffix(" kB"));
        number.expect("VmRSS").trim().parse().expect("a number")
    }

    /// The number of open descriptors.
    pub(crate) fn descriptors(self) -> usize {
        let entries = fs::read_dir(format!("/proc/{}/fd", self.0));
        entries.expect("the process runs").count()
    }

    /// Processor time used so far.
    pub(crate) fn processor_time(self) -> Duration {
        let stat = self.read("stat");
        let (_, after_name) = stat.rsplit_once(')').expect("a name in parentheses");
        let mut fields = after_name.split_whitespace().skip(11);
        let mut ticks = || -> u64 { fields.next().expect("ticks").parse().expect("a number") };
        let ticks = ticks() + ticks();
        Duration::from_millis(ticks * 1000 / rustix::param::clock_ticks_per_second())
    }

    /// How often it, all its threads together, has gone to sleep of its own will.
    pub(crate) fn wakeups(self) -> u64 {
        let threads = fs::read_dir(format!("/proc/{}/task", self.0)).expect("the process runs");
        let of_thread = |path: PathBuf| {
            // A thread may end while we look.
            let status = fs::read_to_string(path.join("status")).unwrap_or_default();
            let count =
                status.lines().find_map(|line| line.strip_prefix("voluntary_ctxt_switches:"));
            count.map_or(0, |count| count.trim().parse().expect("a number"))
        };
        threads.flatten().map(|thread| of_thread(thread.path())).sum()
    }

    fn read(self, file: &str) -> String {
        fs::read_to_string(format!("/proc/{}/{file}", self.0)).expect("the process runs")
    }
}

/// Looks again and again until `holds` is true: for what gives no event to wait for.
pub(crate) fn eventually(what: &str, mut holds: impl FnMut() -> bool) {
    let deadline = Instant::now() + PATIENCE;
    while !holds() {
        assert!(Instant::now() < deadline, "still not: {what}");
        thread::sleep(Duration::from_millis(10));
    }
}
