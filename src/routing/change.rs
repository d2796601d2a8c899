//! What can be changed while frames flow: queues, counters and routes stay as they are.

use std::iter;

use super::group::{Group, Membership};
use super::link_set::LinkId;
use super::options::{LinkOptions, RouterOptions};
use super::router::Router;
use super::time::Time;

impl Router {
    /// Routes in another way from now on. What is known of components stays known; what is too old
    /// by a new age is forgotten with the next [`Router::handle_timeout`], which is due at once.
    pub fn set_options(&mut self, options: RouterOptions, now: Time) {
        if options.route_age != self.options.route_age {
            let is_aging = options.route_age.is_some() && !self.table.components().is_empty();
            self.next_aging = is_aging.then_some(now);
        }
        self.options = options;
        self.find_sniffers();
    }

    /// How it routes now.
    pub fn options(&self) -> RouterOptions {
        self.options
    }

    /// Treats a link in another way from now on. What waits for it is sent at the new pace, in the
    /// same order; nothing of it is dropped, even where less may wait now.
    ///
    /// Does nothing if there is no such link.
    pub fn set_link_options(&mut self, link: LinkId, options: LinkOptions, now: Time) {
        let Some(Some(port)) = self.ports.get_mut(link.index()) else { return };
        let (old, new) = (port.options.membership, options.membership);
        let is_sniffer = options.is_sniffer;
        port.set_options(options, now);
        port.set_gate(link, &mut self.signing, now);
        if old != new {
            self.leave_groups(link);
            new.into_iter().for_each(|membership| self.join_group(link, membership));
        }
        self.sniffers.remove(link);
        if is_sniffer {
            self.sniffers.insert(link);
        }
        self.find_sniffers();
        // A pace that held it back may be gone.
        self.dirty.insert(link);
    }

    /// Says of each group, by number, whether it sends over its best member only, whoever of its
    /// members is there; `None`: there is no such group. What was known of the paths of one that is
    /// gone is forgotten, and its links are in no group, so that another may have its number.
    pub fn set_groups(&mut self, best_only: &[Option<bool>]) {
        let groups = self.groups.len().max(best_only.len());
        self.groups.resize_with(groups, Group::default);
        let best_only = best_only.iter().copied().chain(iter::repeat(None));
        for (group, best_only) in self.groups.iter_mut().zip(best_only) {
            match best_only {
                Some(best_only) => group.set_best_only(best_only),
                None => {
                    for link in std::mem::take(group).links().iter() {
                        // Or it would pass for a member of the next one with this number.
                        let port = self.ports.get_mut(link.index()).and_then(Option::as_mut);
                        port.into_iter().for_each(|port| port.options.membership = None);
                    }
                }
            }
        }
    }

    pub(super) fn join_group(&mut self, link: LinkId, membership: Membership) {
        let number = usize::from(membership.group.0);
        let groups = self.groups.len().max(number + 1);
        self.groups.resize_with(groups, Group::default);
        self.groups[number].add(link, membership);
    }

    pub(super) fn leave_groups(&mut self, link: LinkId) {
        self.groups.iter_mut().for_each(|group| group.remove(link));
    }

    fn find_sniffers(&mut self) {
        self.has_sniffers = self.options.sniffer.is_some() || !self.sniffers.is_empty();
    }
}
