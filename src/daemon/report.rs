//! What the log tells of routing: components that come and go, and what a link carried.

use tracing::{info, warn};

use super::event_loop::Daemon;
use super::links::Link;
use super::log_limit::LeftOut;
use crate::routing::{DropReason, LinkId, RouterEvent};

impl Daemon {
    /// Tells what happened in the router since the last turn.
    pub(super) fn report_events(&mut self) {
        while let Some(event) = self.router.poll_event() {
            let Some(left_out) = self.component_log.permit(self.now) else {
                continue;
            };
            let left_out = LeftOut(left_out);
            match event {
                RouterEvent::ComponentSeen(component, link) => {
                    info!("component {component} seen on {}{left_out}", self.describe(link));
                }
                RouterEvent::ComponentLost(component) => {
                    info!("component {component} lost{left_out}");
                }
                RouterEvent::ComponentRestarted(component, link) => {
                    info!("component {component} restarted on {}{left_out}", self.describe(link));
                }
            }
        }
    }

    fn describe(&self, id: LinkId) -> String {
        let link = self.io.links.get(id);
        let name = link.map_or("?", |link| &self.io.endpoints[link.endpoint].name);
        format!("{name} ({id})")
    }

    /// Tells what each link carried.
    pub(super) fn report_links(&self) {
        for id in self.router.links().iter() {
            if let Some(link) = self.io.links.get(id) {
                self.report_link(id, link);
            }
        }
    }

    /// Tells what a link carried.
    pub(super) fn report_link(&self, id: LinkId, link: &Link) {
        let Some(counters) = self.router.counters(id) else {
            return;
        };
        let stats = link.splitter.stats();
        let name = &self.io.endpoints[link.endpoint].name;
        tracing::debug!(
            "{name}: link {id} ({}) carried {} frames in ({} B; {} damaged, {} B of garbage) \
             and {} out ({} B; {} refused)",
            link.peer,
            counters.frames_in,
            counters.bytes_in,
            stats.damaged + stats.incompatible,
            stats.skipped_bytes,
            counters.frames_out,
            counters.bytes_out,
            counters[DropReason::QueueFull],
        );
    }

    /// Tells how an endpoint is getting on; a peer may have brought it about.
    pub(super) fn tell(&mut self, index: usize, text: &str) {
        let endpoint = &mut self.io.endpoints[index];
        if let Some(left_out) = endpoint.log.permit(self.now) {
            info!("{}: {text}{}", endpoint.name, LeftOut(left_out));
        }
    }

    /// Warns of something about an endpoint; a peer may have brought it about.
    pub(super) fn warn(&mut self, index: usize, text: &str) {
        let endpoint = &mut self.io.endpoints[index];
        if let Some(left_out) = endpoint.log.permit(self.now) {
            warn!("{}: {text}{}", endpoint.name, LeftOut(left_out));
        }
    }
}
