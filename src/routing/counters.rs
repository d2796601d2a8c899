//! What happened on a link, in numbers.

use std::ops::{AddAssign, Index, IndexMut};

/// Why a frame was not delivered. Counts on the link it would have gone to, or on the one it came
/// from where that is said.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum DropReason {
    /// Directed at somebody who was heard on no other link (rules 36-39); counts where it came from.
    NoRoute,
    /// SETUP_SIGNING, which carries a secret key (rule 47); counts where it came from.
    SetupSigning,
    /// The source was just heard on this link (rule 49).
    Loop,
    /// A list of the user's keeps it from coming in; counts where it came from.
    FilteredIn,
    /// A list of the user's keeps it from going out.
    FilteredOut,
    /// The queue had no room for it.
    QueueFull,
    /// The same message of the same source went there a moment ago, and is capped.
    RateCap,
    /// It had come over another link already (rule 49); counts on the link it came from.
    Duplicate,
    /// Nothing is taken from this link (`readonly`); counts on the link it came from.
    ReadOnly,
    /// Too many came in a second (`max_rate`); counts on the link it came from.
    MaxRate,
    /// It is not signed, and must be; like the next four, counts on the link it came from.
    Unsigned,
    /// It was signed with another key, or damaged since (rule 56).
    WrongSignature,
    /// Its signature is not newer than the last of its stream (rule 57).
    Replayed,
    /// Its signature begins a stream, and is more than 60 s behind (rule 57).
    TooOld,
    /// Its signature begins one more stream than are remembered.
    TooManyStreams,
    /// Whoever is there has not yet sent anything with a good signature, and is sent nothing before.
    Unproven,
    /// MAVLink 1, which cannot be signed, on a link that is sent nothing unsigned.
    Unsignable,
    /// It would have to be given other system ids, and its signature does not allow that; counts on
    /// the link that it came from or would have gone to.
    Signed,
    /// It cannot be brought into the layout that is sent here (rule 61).
    NotConverted,
    /// REQUEST_DATA_STREAM, where nobody but this program asks for streams (`block_stream_requests`);
    /// counts on the link it came from.
    StreamRequest,
    /// The system refused to send it: no way to there, too long, no memory.
    Unsendable,
}

impl DropReason {
    /// All of them, in the order of their declaration.
    pub const ALL: [Self; 21] = [
        Self::NoRoute,
        Self::SetupSigning,
        Self::Loop,
        Self::FilteredIn,
        Self::FilteredOut,
        Self::QueueFull,
        Self::RateCap,
        Self::Duplicate,
        Self::ReadOnly,
        Self::MaxRate,
        Self::Unsigned,
        Self::WrongSignature,
        Self::Replayed,
        Self::TooOld,
        Self::TooManyStreams,
        Self::Unproven,
        Self::Unsignable,
        Self::Signed,
        Self::NotConverted,
        Self::StreamRequest,
        Self::Unsendable,
    ];

    /// Whether it is the outcome of a check of signatures.
    pub fn is_refusal(self) -> bool {
        use DropReason::{Replayed, TooManyStreams, TooOld, Unsigned, WrongSignature};
        matches!(self, Unsigned | WrongSignature | Replayed | TooOld | TooManyStreams)
    }

    /// What it is called in status, metrics and logs.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoRoute => "no_route",
            Self::SetupSigning => "setup_signing",
            Self::Loop => "loop",
            Self::FilteredIn => "filtered_in",
            Self::FilteredOut => "filtered_out",
            Self::QueueFull => "queue_full",
            Self::RateCap => "rate_cap",
            Self::Duplicate => "duplicate",
            Self::ReadOnly => "readonly",
            Self::MaxRate => "max_rate",
            Self::Unsigned => "unsigned",
            Self::WrongSignature => "wrong_signature",
            Self::Replayed => "replayed",
            Self::TooOld => "too_old",
            Self::TooManyStreams => "too_many_streams",
            Self::Unproven => "unproven",
            Self::Unsignable => "unsignable",
            Self::Signed => "signed",
            Self::NotConverted => "not_converted",
            Self::StreamRequest => "stream_request",
            Self::Unsendable => "unsendable",
        }
    }
}

/// Counts from the start of a link.
#[derive(Clone, Copy, Default, PartialEq, Eq, Debug)]
pub struct LinkCounters {
    /// Frames that arrived whole.
    pub frames_in: u64,
    /// Their bytes.
    pub bytes_in: u64,
    /// Frames that were queued for sending, but for those that could not be sent then: each frame
    /// that was meant for a link is counted here or as dropped, and once.
    pub frames_out: u64,
    /// Their bytes.
    pub bytes_out: u64,
    /// Frames with system id 0 or component id 0 as their source (rule 8).
    pub invalid_sources: u64,
    /// Frames of a new component when the table of components was full.
    pub unlearned: u64,
    dropped: [u64; DropReason::ALL.len()],
}

impl LinkCounters {
    /// All frames that were dropped, for whatever reason.
    pub fn dropped(&self) -> u64 {
        self.dropped.iter().sum()
    }
}

/// Both links together.
impl AddAssign<&Self> for LinkCounters {
    fn add_assign(&mut self, other: &Self) {
        self.frames_in += other.frames_in;
        self.bytes_in += other.bytes_in;
        self.frames_out += other.frames_out;
        self.bytes_out += other.bytes_out;
        self.invalid_sources += other.invalid_sources;
        self.unlearned += other.unlearned;
        for (sum, count) in self.dropped.iter_mut().zip(other.dropped) {
            *sum += count;
        }
    }
}

impl Index<DropReason> for LinkCounters {
    type Output = u64;

    fn index(&self, reason: DropReason) -> &u64 {
        &self.dropped[reason as usize]
    }
}

impl IndexMut<DropReason> for LinkCounters {
    fn index_mut(&mut self, reason: DropReason) -> &mut u64 {
        &mut self.dropped[reason as usize]
    }
}
