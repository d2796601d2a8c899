//! A program that moves frames, started for one measurement, and what the kernel says about it.

use std::fs;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::str::FromStr;
use std::time::Duration;
use std::{env, process, thread};

use super::layout::Layout;

/// A program to measure.
#[derive(Clone)]
pub(crate) struct Candidate {
    pub(crate) name: String,
    template: String,
}

impl Candidate {
    /// This program, and the forwarders that are the floor.
    pub(crate) fn built_in() -> [Self; 3] {
        let me = env::current_exe().expect("the path of this program");
        let blind = |how| format!("'{}' {how} {{blind}}", me.display());
        let new = |name: &str, template| Self { name: name.to_owned(), template };
        [
            new("mavswitch", format!("{} -q {{endpoints}}", env!("CARGO_BIN_EXE_mavswitch"))),
            new(Self::FLOOR, blind("batch")),
            new("blind single", blind("single")),
        ]
    }

    /// What the kernel asks for at least.
    pub(crate) const FLOOR: &str = "blind batch";

    /// Whether it knows where a frame belongs.
    pub(crate) fn is_router(&self) -> bool {
        !self.template.contains("{blind}")
    }

    /// Starts it, quietly.
    pub(crate) fn start(&self, layout: &Layout) -> Running {
        let conf = env::temp_dir().join(format!("compare-{}.conf", process::id()));
        fs::write(&conf, layout.conf()).expect("a configuration file");
        let command = self
            .template
            .replace("{endpoints}", &layout.endpoints())
            .replace("{mavp2p}", &layout.mavp2p())
            .replace("{blind}", &layout.blind())
            .replace("{conf}", &conf.display().to_string());
        let mut shell = Command::new("sh");
        shell.args(["-c", &format!("exec {command}")]);
        shell.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        Running { child: shell.spawn().expect("a shell"), conf }
    }
}

impl FromStr for Candidate {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, template) = text.split_once('=').ok_or("NAME=COMMAND is expected")?;
        Ok(Self { name: name.trim().to_owned(), template: template.trim().to_owned() })
    }
}

/// A running program, killed when it has been measured.
pub(crate) struct Running {
    child: Child,
    conf: PathBuf,
}

/// What a program has used so far.
#[derive(Clone, Copy)]
pub(crate) struct Usage {
    /// Processor time of all its threads.
    pub(crate) cpu: Duration,
    /// Context switches of all its threads.
    pub(crate) switches: u64,
}

impl Running {
    /// What it has used since it was started.
    ///
    /// # Panics
    ///
    /// If it has ended.
    pub(crate) fn usage(&self) -> Usage {
        let mut usage = Usage { cpu: Duration::ZERO, switches: 0 };
        let tasks = fs::read_dir(self.file("task")).expect("a program that still runs");
        for task in tasks.filter_map(Result::ok) {
            // A thread may end while it is looked at.
            let Ok(times) = fs::read_to_string(task.path().join("schedstat")) else { continue };
            let Ok(status) = fs::read_to_string(task.path().join("status")) else { continue };
            let nanoseconds = times.split(' ').next().expect("nanoseconds");
            usage.cpu += Duration::from_nanos(nanoseconds.parse().expect("a number"));
            usage.switches += number_after(&status, "\nvoluntary_ctxt_switches:");
            usage.switches += number_after(&status, "\nnonvoluntary_ctxt_switches:");
        }
        usage
    }

    /// The most memory that it has had, in KiB.
    pub(crate) fn peak_kib(&self) -> u64 {
        number_after(&self.status(), "\nVmHWM:")
    }

    /// The memory that it has, in KiB.
    pub(crate) fn resident_kib(&self) -> u64 {
        number_after(&self.status(), "\nVmRSS:")
    }

    fn status(&self) -> String {
        fs::read_to_string(self.file("status")).expect("a program that still runs")
    }

    fn file(&self, name: &str) -> PathBuf {
        PathBuf::from(format!("/proc/{}/{name}", self.child.id()))
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        let _ = fs::remove_file(&self.conf);
        // What the kernel has still to clean up shall not burden the next one.
        thread::sleep(Duration::from_millis(100));
    }
}

fn number_after(text: &str, key: &str) -> u64 {
    let rest = text.split_once(key).map_or("", |(_, rest)| rest);
    rest.split_whitespace().next().and_then(|word| word.parse().ok()).unwrap_or(0)
}
