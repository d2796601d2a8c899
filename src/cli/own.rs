//! The options of the command line about who the program itself is.

use clap::Args;

use crate::config::OwnOptions;

/// Who the program itself is.
#[derive(Args, Debug)]
pub struct OwnArgs {
    /// Be a component of this system: send HEARTBEAT, answer TIMESYNC and PING, measure links
    ///
    /// Without it, the program sends nothing of its own accord. Of an endpoint that has
    /// own_component=false it stays away.
    #[arg(long, value_name = "SYSTEM", value_parser = clap::value_parser!(u8).range(1..))]
    pub system: Option<u8>,

    /// The component id of that component [default: 191]
    #[arg(long, value_name = "COMPONENT", value_parser = clap::value_parser!(u8).range(1..))]
    pub component: Option<u8>,
}

impl OwnArgs {
    /// Overrides what the files say.
    pub(super) fn apply_to(&self, options: &mut OwnOptions) {
        options.system = self.system.or(options.system);
        options.component = self.component.unwrap_or(options.component);
    }
}
