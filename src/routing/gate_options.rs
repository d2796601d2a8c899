//! What a user may ask of the frames of a link; the gate does it.

use std::sync::Arc;

use crate::mavlink::{Key, MessageId, Recipes, SystemMap, Version};

/// What is asked of the frames of a link; the default asks nothing.
#[derive(Clone, PartialEq, Eq, Default, Debug)]
pub struct GateOptions {
    /// Nothing that comes from here is taken.
    pub is_readonly: bool,
    /// So many frames are taken in a second at most, 1..=1,000,000.
    pub max_rate: Option<u32>,
    /// REQUEST_DATA_STREAM is not taken from here.
    pub blocks_stream_requests: bool,
    /// What comes must be signed.
    pub verify: Option<Verify>,
    /// What leaves is signed.
    pub sign: Option<Sign>,
    /// Signed frames are sent here only if they were verified where they came in: whoever is here
    /// cannot check them (rule 55).
    pub needs_belief: bool,
    /// What comes and leaves has other system ids on the link than here.
    pub remap: Option<Arc<SystemMap>>,
    /// In which layout frames leave; `None`: as they are.
    pub version: Option<Version>,
    /// What cannot be brought into that layout is sent as it is.
    pub passes_unconverted: bool,
    /// What is known of messages; needed for the three above.
    pub recipes: Option<Arc<Recipes>>,
}

impl GateOptions {
    /// The key that frames which come must have been signed with, if they must.
    pub fn verify_key(&self) -> Option<&Key> {
        self.verify.as_ref().map(|verify| &verify.key)
    }

    /// Whether frames may leave other than they are, or not at all.
    pub(super) fn rewrites(&self) -> bool {
        let is_made_anew = self.sign.is_some() || self.remap.is_some() || self.version.is_some();
        is_made_anew || self.needs_belief
    }
}

/// How signatures are checked.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Verify {
    /// What they must have been made with.
    pub key: Key,
    /// Messages that may come unsigned.
    pub allow_unsigned: Vec<MessageId>,
    /// Whether frames go on without their signature.
    pub strip: bool,
    /// Whether nothing is sent before the first frame with a good signature has come: whoever calls
    /// a server may be anybody.
    pub before_sending: bool,
}

/// How signatures are made.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Sign {
    /// With which key.
    pub key: Key,
    /// What becomes of MAVLink 1, which cannot be signed.
    pub v1: OldFrames,
}

/// What becomes of a frame of MAVLink 1 where frames are signed.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub enum OldFrames {
    /// It leaves as it is.
    #[default]
    Pass,
    /// It is made one of MAVLink 2, and signed.
    Upgrade,
    /// It is dropped.
    Drop,
}
