//! The table of options: everything that reads, prints or explains an option goes through it.
//!
//! The rows stand by subject in files of their own.

mod address;
mod datagrams;
mod filters;
mod groups;
mod guard;
mod own;
mod pace;
mod peers;
mod replay;
mod row;
mod sim;

use super::address::AddressKind::{self, Multicast, TcpIn, TcpOut, UdpBroadcast, UdpIn, UdpOut};
use super::option_spec::OptionSpec;

const ANY: &[AddressKind] = AddressKind::ALL;
const UDP: &[AddressKind] = &[UdpIn, UdpOut, UdpBroadcast, Multicast];
const NETWORK: &[AddressKind] = &[UdpIn, UdpOut, UdpBroadcast, Multicast, TcpIn, TcpOut];
const SENDERS: &[AddressKind] = &[UdpOut, UdpBroadcast, Multicast, TcpOut];

/// The rows of each subject, in the order in which they are printed and explained.
const SUBJECTS: &[&[OptionSpec]] = &[
    address::ADDRESS,
    pace::PACE,
    peers::PEERS,
    datagrams::DATAGRAMS,
    filters::FILTERS,
    groups::GROUPS,
    guard::GUARD,
    own::OWN,
    replay::REPLAY,
    sim::SIM,
];

/// All options, in the order in which they are printed and explained.
pub const OPTIONS: &[OptionSpec] = &concat::<{ count(SUBJECTS) }>(SUBJECTS);

const fn count(subjects: &[&[OptionSpec]]) -> usize {
    let (mut rows, mut subject) = (0, 0);
    while subject < subjects.len() {
        rows += subjects[subject].len();
        subject += 1;
    }
    rows
}

/// `N` is the [`count`] of rows.
const fn concat<const N: usize>(subjects: &[&[OptionSpec]]) -> [OptionSpec; N] {
    // Each row is overwritten with its own.
    let mut all = [subjects[0][0]; N];
    let (mut filled, mut subject) = (0, 0);
    while subject < subjects.len() {
        let rows = subjects[subject];
        let mut row = 0;
        while row < rows.len() {
            all[filled] = rows[row];
            (filled, row) = (filled + 1, row + 1);
        }
        subject += 1;
    }
    all
}

/// Stores a value that could be read.
fn put<T>(field: &mut T, value: Option<T>) -> Option<()> {
    *field = value?;
    Some(())
}

#[cfg(test)]
mod tests;
