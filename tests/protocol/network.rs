//! A router with links that are nothing but queues, and a clock that the test moves.

use crate::frames::{Receiver, frame, signed};
use mavswitch::mavlink::{Component, Input, Version};
use mavswitch::routing::{
    Capacity, LinkCounters, LinkId, LinkOptions, Router, RouterOptions, Time,
};
use std::time::Duration;

pub(crate) struct Network {
    pub(crate) router: Router,
    pub(crate) now: Time,
}

impl Network {
    pub(crate) fn new(options: RouterOptions) -> Self {
        Self { router: Router::new(options), now: Time::from_millis(1_000_000) }
    }

    /// A router as it comes, with so many links.
    pub(crate) fn with_links<const N: usize>() -> (Self, [LinkId; N]) {
        let mut network = Self::new(RouterOptions::default());
        let links = std::array::from_fn(|_| network.link());
        (network, links)
    }

    pub(crate) fn link(&mut self) -> LinkId {
        let capacity = Capacity::Bytes(65_536);
        self.link_with(LinkOptions { capacity, ..LinkOptions::default() })
    }

    pub(crate) fn link_with(&mut self, options: LinkOptions) -> LinkId {
        self.router.add_link(options, self.now).unwrap()
    }

    pub(crate) fn pass(&mut self, seconds: u64) {
        self.pass_ms(seconds * 1_000);
    }

    pub(crate) fn pass_ms(&mut self, millis: u64) {
        self.now = self.now + Duration::from_millis(millis);
    }

    /// `bytes` arrive on a link, whole, as a peer of its own would send them.
    pub(crate) fn receive(&mut self, link: LinkId, bytes: &[u8]) {
        let mut receiver = Receiver::new();
        self.receive_by(&mut receiver, link, bytes);
    }

    /// The same through a receiver that remembers what came before.
    pub(crate) fn receive_by(&mut self, receiver: &mut Receiver, link: LinkId, bytes: &[u8]) {
        let (router, now) = (&mut self.router, self.now);
        receiver.each(bytes, Input::Paused, |frame| {
            router.handle(link, frame, now);
        });
    }

    /// Who sends what, and which links get it.
    pub(crate) fn hears(&mut self, link: LinkId, bytes: &[u8]) -> Vec<LinkId> {
        self.receive(link, bytes);
        self.delivered()
    }

    /// The links that got something since the last look; their queues are emptied.
    pub(crate) fn delivered(&mut self) -> Vec<LinkId> {
        let links: Vec<LinkId> = self.router.take_dirty().iter().collect();
        links.iter().for_each(|link| drop(self.sent(*link)));
        links
    }

    /// What waits for a link, taken out.
    pub(crate) fn sent(&mut self, link: LinkId) -> Vec<u8> {
        let port = self.router.port_mut(link).unwrap();
        let (first, second) = port.head(usize::MAX);
        let bytes = [first, second].concat();
        port.consume(bytes.len());
        bytes
    }

    pub(crate) fn counters(&self, link: LinkId) -> LinkCounters {
        *self.router.counters(link).unwrap()
    }
}

pub(crate) const VEHICLE: Component = Component::new(1, 1);
pub(crate) const CAMERA: Component = Component::new(1, 100);
pub(crate) const STATION: Component = Component::new(255, 190);

pub(crate) fn heartbeat(from: Component) -> Vec<u8> {
    frame(Version::V2, 0, from, (0, 50), &[0, 0, 0, 0, 2, 3, 81, 3, 3])
}

pub(crate) fn attitude(from: Component, seq: u8) -> Vec<u8> {
    frame(Version::V2, seq, from, (30, 39), &[7; 28])
}

pub(crate) fn command(from: Component, to: Component) -> Vec<u8> {
    let mut payload = [0; 33];
    payload[30] = to.system;
    payload[31] = to.component;
    payload[32] = 1;
    frame(Version::V2, 0, from, (76, 152), &payload)
}

pub(crate) fn system_time(from: Component, boot_ms: u32) -> Vec<u8> {
    let mut payload = [1; 12];
    payload[8..].copy_from_slice(&boot_ms.to_le_bytes());
    frame(Version::V2, 0, from, (2, 137), &payload)
}

pub(crate) fn setup_signing(seq: u8, from: Component, to: Component) -> Vec<u8> {
    let mut payload = [1; 42];
    payload[8] = to.system;
    payload[9] = to.component;
    signed(seq, from, (256, 71), &payload)
}
