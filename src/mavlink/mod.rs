//! The MAVLink protocol as a router needs it: frames, their checksums, and where their targets are.
//!
//! This layer is pure: it sees bytes and gives back frames. It opens nothing, reads no clock, and
//! allocates nothing per frame. Rule numbers in this layer are those of the project's routing
//! rules: each is a fact of the protocol or a decision about it, described where it applies.

mod checker;
mod crc;
mod definitions;
mod dialect;
mod encode;
mod fields;
mod frame;
mod id;
mod payload;
mod rewrite;
mod signing;
mod splitter;
mod timing;
mod unsigned;

pub use checker::{Checker, Evidence, Sighting, Verdict};
pub use crc::{Crc, implied_extra};
pub use definitions::{
    DefinitionError, DefinitionProblem, Definitions, MAX_MESSAGES, fuzz_definitions,
    parse_definitions,
};
pub use dialect::{Definition, Dialect, MAX_DEFINITIONS, Target, TooManyDefinitions};
pub use encode::{FrameSpec, encode, trimmed};
pub use fields::{Element, EnumNames, FieldLayout, Layouts, MessageLayout, Value, fuzz_fields};
pub use frame::{
    Frame, FrameError, Header, MAX_FRAME, SIGNATURE, STX_V1, STX_V2, Version, frame_len_of,
};
pub use id::{Component, MessageId};
pub use payload::{Fields, Layout, Payload};
pub use rewrite::{FrameBuffer, Recipes, SystemMap};
pub use signing::{KEY_LEN, Key, MAX_STREAMS, Refusal, Streams, Timestamp, fuzz_signing};
pub use splitter::{
    CheckedFrame, Cutter, Input, Splitter, SplitterStats, fuzz_splitter,
    fuzz_splitter_with_checksums,
};
pub use timing::Timing;
pub use unsigned::unsigned;
