//! What the service manager is told, and when: ready, how it goes, still alive, stopping.
//!
//! The status is looked at only in turns that happen anyway, and at most once a second; how the
//! messages travel is for `notify`.

use std::collections::BTreeMap;
use std::fmt::{Display, Write};

use super::endpoint::State;
use super::endpoint_table::EndpointId;
use super::event_loop::Daemon;
use super::timers::Timer;
use crate::mavlink::Component;
use crate::printable::printable;

/// A list longer than this is told by its length alone: the status is one line.
const LISTED: usize = 8;

impl Daemon {
    /// The configuration is about to be read anew; whatever comes of it, [`Self::tell_ready`] has
    /// to follow.
    pub(super) fn tell_reloading(&mut self) {
        self.notifier.handle_reloading(self.now);
        self.set_notify_timer();
    }

    /// Everything that is configured has been opened, at the start or after a reload.
    pub(super) fn tell_ready(&mut self) {
        let status = self.status_line();
        self.notifier.handle_ready(status, self.now);
        self.set_notify_timer();
    }

    /// Tells how it goes, if that is worth a message now.
    pub(super) fn tell_status(&mut self) {
        if self.notifier.wants_status(self.now) {
            let status = self.status_line();
            self.notifier.handle_status(status);
        }
    }

    /// This comes from the loop itself, so that a loop that is stuck says nothing.
    pub(super) fn feed_watchdog(&mut self) {
        self.notifier.handle_timeout(self.now);
        self.set_notify_timer();
    }

    fn set_notify_timer(&mut self) {
        if let Some(at) = self.notifier.take_timeout() {
            self.timers.set(at, Timer::Notify);
        }
    }

    /// Links, components, and what is still missing: `2 links (fc 1, gcs 1), 1 component (1/1);
    /// waiting for radio`.
    fn status_line(&self) -> String {
        let components = self.router.table().components().iter().map(|known| known.component);
        let mut components: Vec<Component> = components.collect();
        components.sort_unstable();
        let links = self.router.links();
        let mut line = counted(links.len(), "link");
        list(&mut line, &self.links_of_endpoints());
        let _ = write!(line, ", {}", counted(components.len(), "component"));
        list(&mut line, &components);
        let missing = self.missing();
        match missing.len() {
            0 => {}
            1..=LISTED => drop(write!(line, "; waiting for {}", missing.join(", "))),
            count => drop(write!(line, "; waiting for {count} endpoints")),
        }
        // A line that an odd name broke in two could say anything to the manager.
        printable(&line)
    }

    /// The endpoints that have links, and how many.
    fn links_of_endpoints(&self) -> Vec<String> {
        let mut counts: BTreeMap<EndpointId, usize> = BTreeMap::new();
        for id in self.router.links().iter() {
            if let Some(link) = self.io.links.get(id) {
                *counts.entry(link.endpoint).or_default() += 1;
            }
        }
        let name = |index| &self.io.endpoints[index].name;
        counts.into_iter().map(|(index, count)| format!("{} {count}", name(index))).collect()
    }

    /// The names of the endpoints that are not open.
    fn missing(&self) -> Vec<&str> {
        let is_missing = |state: &State| {
            matches!(
                state,
                State::Waiting | State::Resolving | State::Opening | State::Connecting(..)
            )
        };
        let endpoints = self.io.endpoints.iter().filter(|endpoint| endpoint.options().enabled);
        let missing = endpoints
            .filter(|endpoint| is_missing(&endpoint.state))
            // Such as a log that has been played back; one that failed at its only try is missing.
            .filter(|endpoint| endpoint.tries_once() || !endpoint.is_given_up());
        missing.map(|endpoint| endpoint.name.as_str()).collect()
    }
}

/// `1 link`, `2 links`.
fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// Adds the items in parentheses, if there are not too many.
fn list(line: &mut String, items: &[impl Display]) {
    if (1..=LISTED).contains(&items.len()) {
        let items: Vec<String> = items.iter().map(ToString::to_string).collect();
        let _ = write!(line, " ({})", items.join(", "));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_list_is_told_by_its_length_alone() {
        let mut line = counted(2, "link");
        list(&mut line, &["a 1", "b 1"]);
        assert_eq!(line, "2 links (a 1, b 1)");
        let mut line = counted(0, "component");
        list(&mut line, &[0; 0]);
        assert_eq!(line, "0 components");
        let mut line = counted(9, "component");
        list(&mut line, &[0; 9]);
        assert_eq!(line, "9 components");
    }
}
