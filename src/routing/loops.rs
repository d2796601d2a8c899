//! Frames that come back: by parallel links, and round rings of routers (rule 49).

use std::time::Duration;

use super::counters::DropReason;
use super::dedup::CopyFrom;
use super::group::Group;
use super::link_set::{LinkId, LinkSet};
use super::options::LOOP_WINDOW;
use super::route_table::Heard;
use super::router::{Router, count_drop};
use super::time::Time;
use crate::mavlink::{CheckedFrame, Component};

/// A frame that goes round comes again within this time.
const RING_WINDOW: Duration = Duration::from_secs(2);

impl Router {
    /// Whether a frame has come already, by another way or round a ring (rule 49).
    ///
    /// The loop rule alone does not end every ring: where frames go round one way, each router but
    /// the first hears their source on one side only. So while a source is heard on several links,
    /// what comes in by the same link again was going round; and frames that teach no route are
    /// known by their bytes alone.
    #[inline]
    pub(super) fn is_copy(&mut self, link: LinkId, frame: &CheckedFrame<'_>, now: Time) -> bool {
        let option = self.port(link).and_then(|port| port.options.dedup);
        let source = frame.header.source;
        let (window, from) = if !(frame.verified && source.is_valid_source()) {
            (RING_WINDOW, CopyFrom::OtherLinks)
        } else if let Some(window) = option {
            (window, CopyFrom::OtherLinks)
        } else if self.is_heard_on_several_links(source, now) {
            (RING_WINDOW, CopyFrom::SameLink)
        } else {
            return false;
        };
        self.dedup.is_copy(frame.bytes, link, from, window, now)
    }

    fn is_heard_on_several_links(&self, source: Component, now: Time) -> bool {
        let Some(known) = self.table.find(source) else { return false };
        let is_recent = |heard: &&Heard| now.since(heard.last) < LOOP_WINDOW;
        known.heard.len() > 1 && known.heard.iter().filter(is_recent).nth(1).is_some()
    }

    /// Rule 49: takes out the links on which the source was just heard, and those that lead the same
    /// way.
    pub(super) fn apply_loop_rule(
        &mut self,
        link: LinkId,
        frame: &CheckedFrame<'_>,
        destinations: &mut LinkSet,
        now: Time,
    ) {
        let Some(source) = self.table.find(frame.header.source) else { return };
        for heard in &source.heard {
            if heard.link == link || now.since(heard.last) >= LOOP_WINDOW {
                continue;
            }
            let port = self.ports[heard.link.index()].as_ref();
            let group = port.and_then(|port| port.options.membership).map(|m| m.group.0);
            let same_way = group.and_then(|group| self.groups.get(usize::from(group)));
            let muted = same_way.map_or_else(|| LinkSet::of(heard.link), Group::links);
            if !(*destinations & muted).is_empty() {
                *destinations = *destinations - muted;
                count_drop(&mut self.ports, heard.link, DropReason::Loop);
            }
        }
    }
}
