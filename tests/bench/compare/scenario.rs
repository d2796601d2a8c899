//! What is offered, and who is to hear it.

use std::fmt;

use super::router::Candidate;

/// Who sends.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Source {
    /// So many vehicles, each with a UDP socket of its own, to one UDP server.
    Udp(u16),
    /// One vehicle on a serial line with so many baud.
    Serial(u32),
}

/// One load.
#[derive(Clone, Copy)]
pub(crate) struct Scenario {
    pub(crate) letter: char,
    pub(crate) title: &'static str,
    pub(crate) source: Source,
    /// Frames a second, of all sources together.
    pub(crate) rate: u32,
    /// How many TCP clients listen, beside the one UDP peer.
    pub(crate) clients: u16,
    /// Each frame is for one of the TCP clients, in turn, instead of for all.
    pub(crate) directed: bool,
}

const fn telemetry(letter: char, title: &'static str, rate: u32, clients: u16) -> Scenario {
    Scenario { letter, title, source: Source::Udp(1), rate, clients, directed: false }
}

const fn directed(title: &'static str, clients: u16) -> Scenario {
    Scenario { letter: 'E', title, source: Source::Udp(1), rate: 10_000, clients, directed: true }
}

/// Where the search for the highest rate begins.
pub(crate) const HIGHEST: Scenario =
    telemetry('I', "UDP to UDP, as much as the forwarder of batches moves without loss", 50_000, 0);

/// All but the one in which nothing happens, and the one whose rate is to be found.
pub(crate) const SCENARIOS: [Scenario; 10] = [
    telemetry('A', "UDP to UDP, 5,000 frames/s", 5_000, 0),
    telemetry('B', "UDP to UDP, 50,000 frames/s", 50_000, 0),
    telemetry('C', "UDP to 1 UDP and 8 TCP, 2,000 frames/s", 2_000, 8),
    telemetry('D', "UDP to 1 UDP and 8 TCP, 20,000 frames/s", 20_000, 8),
    directed("Directed frames to 10 TCP clients, 10,000 frames/s", 10),
    directed("Directed frames to 100 TCP clients, 10,000 frames/s", 100),
    directed("Directed frames to 230 TCP clients, 10,000 frames/s", 230),
    directed("Directed frames to 900 TCP clients, 10,000 frames/s", 900),
    Scenario {
        source: Source::Serial(921_600),
        // The line carries 92,160 bytes/s: this many frames of 52 bytes, and a little to spare.
        ..telemetry('F', "Serial at 921,600 baud to 1 UDP and 2 TCP, 1,700 frames/s", 1_700, 2)
    },
    Scenario {
        source: Source::Udp(100),
        ..telemetry(
            'G',
            "100 vehicles on one UDP server and a ground station, 500 frames/s",
            500,
            0,
        )
    },
];

impl Scenario {
    /// Whether such a program can do what is asked.
    pub(crate) fn suits(&self, candidate: &Candidate) -> bool {
        candidate.is_router() || self.source != Source::Udp(100)
    }

    /// How many copies of each frame are to arrive.
    pub(crate) fn copies(&self) -> u64 {
        match self.source {
            _ if self.directed => 1,
            // The other vehicles hear it, too.
            Source::Udp(vehicles) => u64::from(vehicles - 1) + u64::from(self.clients) + 1,
            Source::Serial(_) => u64::from(self.clients) + 1,
        }
    }
}

impl fmt::Display for Scenario {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}. {}", self.letter, self.title)
    }
}
