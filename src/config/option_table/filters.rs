//! Rows of the table of options: what may pass.

use super::ANY;
use super::row::{flag, id_filter, message_filter};
use crate::config::option_spec::OptionSpec;

pub(super) const FILTERS: &[OptionSpec] = &[
    message_filter!("allow_messages_in", "take only these messages", filter_in, allow_messages),
    message_filter!("block_messages_in", "do not take these messages", filter_in, block_messages),
    id_filter!("allow_systems_in", "take only what these systems sent", filter_in, allow_systems),
    id_filter!("block_systems_in", "do not take what these systems sent", filter_in, block_systems),
    id_filter!(
        "allow_components_in",
        "take only what components with these ids sent",
        filter_in,
        allow_components
    ),
    id_filter!(
        "block_components_in",
        "do not take what components with these ids sent",
        filter_in,
        block_components
    ),
    message_filter!("allow_messages_out", "send only these messages", filter_out, allow_messages),
    message_filter!("block_messages_out", "do not send these messages", filter_out, block_messages),
    id_filter!("allow_systems_out", "send only what these systems sent", filter_out, allow_systems),
    id_filter!(
        "block_systems_out",
        "do not send what these systems sent",
        filter_out,
        block_systems
    ),
    id_filter!(
        "allow_components_out",
        "send only what components with these ids sent",
        filter_out,
        allow_components
    ),
    id_filter!(
        "block_components_out",
        "do not send what components with these ids sent",
        filter_out,
        block_components
    ),
    flag!("sniffer", "false", "send everything here, whoever it is for", ANY, sniffer),
    flag!(
        "forward_setup_signing",
        "false",
        "let SETUP_SIGNING, which carries a secret key, pass to others that allow it too",
        ANY,
        forward_setup_signing
    ),
    flag!("record", "true", "record what comes from here, if anything is recorded", ANY, record),
];
