//! Why a frame goes where it goes, as the daemon tells it: one entry for each link.
//!
//! Its JSON is an interface, as that of the snapshot is. The words are put to it by whoever shows it.

use serde::{Deserialize, Serialize};

/// What was asked, and what the router would do.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct Why {
    /// Who would send it, as it was asked: `255/190`, or the name of an endpoint.
    pub from: String,
    /// Whom it would be for, likewise: `1/1`, `1`, `all`, or the name of an endpoint.
    pub to: String,
    /// Whether the one it comes from was ever heard, or there is no such thing to be heard.
    pub from_is_known: bool,
    /// The same of the one it is for.
    pub to_is_known: bool,
    /// Each frame that was thought of, from each link that it could come from.
    pub frames: Vec<FrameFate>,
}

/// What would become of one frame.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct FrameFate {
    /// Its source: `255/190`.
    pub source: String,
    /// The target that it would name: `1/1`, `1`; or `all` if its message names none.
    pub target: String,
    /// Its message: `COMMAND_LONG`.
    pub message: String,
    /// The endpoint that it would come from, and which link.
    pub endpoint: String,
    /// The number of that link.
    pub link: u16,
    /// Who is at the other end of that link.
    pub peer: String,
    /// Why it would not be taken at all: `filtered_in`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
    /// Whether it would be taken only if its signature is good and newer than the last: then all else
    /// here holds for one that is.
    #[serde(default, skip_serializing_if = "is_false")]
    pub if_signature_is_good: bool,
    /// What it would be to each link.
    pub links: Vec<LinkFate>,
}

/// What a frame would be to a link.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct LinkFate {
    /// The link's endpoint.
    pub endpoint: String,
    /// The link's number.
    pub link: u16,
    /// Who is at the other end.
    pub peer: String,
    /// Whether the one that was asked about is there; nobody is, if it was asked about all.
    pub is_wanted: bool,
    /// Whether it would be sent there.
    pub is_sent: bool,
    /// Why, or why not: `broadcast`, `route`, `same_group`, `sniffer`; `own_link`, `own_group`,
    /// `unheard`, `stale`, `not_learned`, `others_only`, `other_path`, `loop`; or a reason of
    /// refusal that is counted under this name, as `filtered_out` or `queue_full`.
    pub reason: String,
    /// The endpoint that brought the like just now, for `loop`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub by: Option<String>,
}

/// What is left out of the JSON.
fn is_false(flag: &bool) -> bool {
    !flag
}

impl FrameFate {
    /// Whether it gets to the one that was asked about; if that was all, whether to anybody.
    pub fn arrives(&self) -> bool {
        let is_asked = |link: &&LinkFate| link.is_wanted || !self.has_wanted();
        self.refused.is_none() && self.links.iter().filter(is_asked).any(|link| link.is_sent)
    }

    /// Whether anybody was asked about who is on a link.
    pub fn has_wanted(&self) -> bool {
        self.links.iter().any(|link| link.is_wanted)
    }
}
