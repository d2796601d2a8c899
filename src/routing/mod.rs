//! Which link gets which frame, and the queues in between.
//!
//! This layer is pure: it knows links by number, takes the time as an argument, and copies frames
//! from the reading side into queues that somebody else empties. Rule numbers refer to the
//! project's routing rules.

mod bucket;
mod change;
mod counters;
mod decision;
mod dedup;
mod explain;
mod filter;
mod foresight;
mod fuzz;
mod fuzz_gate;
mod gate;
mod gate_options;
mod gate_port;
mod group;
mod learning;
mod link_set;
mod local_peer;
mod loops;
mod options;
mod pacer;
mod path_loss;
mod port;
mod queue;
mod queue_age;
mod rate_limit;
mod reminder;
mod route_table;
mod router;
mod sequence;
mod signing;
mod single;
mod tallies;
mod tap;
mod time;

pub use counters::{DropReason, LinkCounters};
pub use dedup::REMEMBERED;
pub use explain::{Explanation, Fate, Missing, Way};
pub use filter::{Filter, FilterLists};
pub use fuzz::fuzz_router;
pub use gate_options::{GateOptions, OldFrames, Sign, Verify};
pub use group::{GroupId, Membership, Quality};
pub use link_set::{LinkId, LinkSet, Links, MAX_LINKS};
pub use local_peer::LocalPeer;
pub use loops::{GROUP_WINDOW, HELD_BACK, RING_WINDOW};
pub use options::{Capacity, LOOP_WINDOW, Learn, LinkOptions, RouterEvent, RouterOptions};
pub use port::Port;
pub use queue::{Frames, Full, Packed, Precedence, Queue, QueueLimits, fuzz_queue};
pub use rate_limit::RateCap;
pub use reminder::Reminder;
pub use route_table::{Heard, Heartbeat, KnownComponent, MAX_COMPONENTS, MAX_HEARD, RouteTable};
pub use router::Router;
pub use sequence::Sequence;
pub use signing::SigningClock;
pub use tallies::{MAX_TALLIES, Tally};
pub use tap::{Sighting, Tap};
pub use time::Time;
