//! Which group has which number, and who is in it.
//!
//! A group is known by its name as long as an endpoint names it; then another may have its number.

use super::endpoint::Endpoint;
use super::endpoint_table::{EndpointId, EndpointTable};
use crate::config::PathChoice;
use crate::routing::{GroupId, Membership};

impl EndpointTable {
    /// The place of an endpoint in the group that it names. Its own earlier membership counts for
    /// nothing.
    ///
    /// `None` if it names no group, or if there are 256 others.
    pub(super) fn membership_of(&self, index: EndpointId) -> Option<Membership> {
        let endpoint = self.get(index)?;
        let options = endpoint.options();
        let name = options.group.as_ref()?;
        let others = || self.others(index);
        let mates = others().filter(|other| other.options().group.as_ref() == Some(name));
        let known = mates.filter_map(|other| other.membership).map(|other| other.group).next();
        let is_free = |id: &GroupId| {
            others().all(|other| other.membership.is_none_or(|other| other.group != *id))
        };
        let group = known.or_else(|| (0..=u8::MAX).map(GroupId).find(is_free))?;
        Some(Membership {
            group,
            member: index.slot(),
            rank: options.prefer,
            best_only: options.path == PathChoice::Best,
        })
    }

    fn others(&self, index: EndpointId) -> impl Iterator<Item = &Endpoint> {
        let own = self.get(index);
        self.iter().filter(move |other| own.is_none_or(|own| !std::ptr::eq(own, *other)))
    }

    /// By number: whether the group sends over its best member only; `None`: there is none.
    pub(super) fn groups(&self) -> Vec<Option<bool>> {
        let mut groups = Vec::new();
        for membership in self.iter().filter_map(|endpoint| endpoint.membership) {
            let number = usize::from(membership.group.0);
            groups.resize(groups.len().max(number + 1), None);
            let best_only = groups[number].unwrap_or(false) || membership.best_only;
            groups[number] = Some(best_only);
        }
        groups
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::daemon::settings::settle;
    use crate::mavlink::Dialect;
    use crate::routing::Time;

    fn add(table: &mut EndpointTable, text: &str) -> EndpointId {
        let settled = settle(vec![text.parse().unwrap()], &Dialect::builtin());
        let endpoint = Endpoint::new(settled.unwrap().remove(0), Time::ZERO);
        let id = table.insert(endpoint).unwrap();
        table[id].membership = table.membership_of(id);
        id
    }

    #[test]
    fn endpoints_of_one_name_are_a_group() {
        let mut table = EndpointTable::default();
        let texts = ["udpin::1?group=a", "udpin::2?group=b&path=best&prefer=7", "udpin::3?group=a"];
        let ids = texts.map(|text| add(&mut table, text));
        let places = ids.map(|id| table[id].membership.map(|m| (m.group.0, m.member, m.rank)));
        assert_eq!(places, [Some((0, 0, 0)), Some((1, 1, 7)), Some((0, 2, 0))]);
        assert_eq!(table.groups(), [Some(false), Some(true)]);
    }

    #[test]
    fn the_number_of_a_group_that_is_gone_is_free_again() {
        let mut table = EndpointTable::default();
        let ids = ["udpin::1?group=a", "udpin::2?group=b"].map(|text| add(&mut table, text));
        table.remove(ids[0]);
        assert_eq!(table.groups(), [None, Some(false)]);
        let id = add(&mut table, "udpin::3?group=c&path=best");
        assert_eq!(table[id].membership.map(|m| m.group.0), Some(0));
        assert_eq!(table.groups(), [Some(true), Some(false)]);
    }
}
