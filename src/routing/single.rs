//! Frames of the program's own that are for one link, whatever other ways lead to their target: what
//! measures that link, or asks whoever is on it.

use super::link_set::{LinkId, LinkSet};
use super::router::Router;
use super::time::Time;
use crate::mavlink::CheckedFrame;

impl Router {
    /// Takes a frame that arrived on `link`, a link inside the program, as [`Router::handle`] does,
    /// but queues it for `to` alone. Nothing is taken from a link that is not there.
    ///
    /// The frame is remembered like any other, so that it does not go round.
    #[inline(never)]
    pub fn handle_single(
        &mut self,
        link: LinkId,
        to: LinkId,
        frame: &CheckedFrame<'_>,
        now: Time,
    ) -> bool {
        if self.tap.is_open() {
            self.watch(link, frame, now, |router| router.take_single(link, to, frame, now))
        } else {
            self.take_single(link, to, frame, now)
        }
    }

    fn take_single(
        &mut self,
        link: LinkId,
        to: LinkId,
        frame: &CheckedFrame<'_>,
        now: Time,
    ) -> bool {
        if self.count_in(link, frame).is_none() {
            return false;
        }
        self.tallies.count(frame);
        let arrival = self.arrival(link, frame, now);
        self.learn(link, frame, arrival, now);
        self.deliver(frame, LinkSet::of(to), now);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mavlink::{Component, Header, Timing};
    use crate::routing::{DropReason, LinkOptions, RouterOptions};

    const OWN: Component = Component::new(1, 191);

    fn ping(seq: u32) -> Vec<u8> {
        let mut bytes = Vec::new();
        Timing::ping(5, seq, Component::new(0, 0)).encode(OWN, 0, &mut bytes);
        bytes
    }

    fn checked(bytes: &[u8]) -> CheckedFrame<'_> {
        let header = Header::parse(bytes).unwrap();
        CheckedFrame { bytes, header, target: Component::new(0, 0), verified: true }
    }

    #[test]
    fn a_frame_for_one_link_goes_there_alone_and_does_not_come_round() {
        let mut router = Router::new(RouterOptions::default());
        let [own, a, b] =
            [(); 3].map(|()| router.add_link(LinkOptions::default(), Time::ZERO).unwrap());
        let now = Time::from_millis(1);
        for is_watched in [false, true] {
            router.set_tap(is_watched);
            let bytes = ping(u32::from(is_watched));
            assert!(router.handle_single(own, a, &checked(&bytes), now));
            let sent = [own, a, b].map(|link| router.counters(link).unwrap().frames_out);
            assert_eq!(sent, [0, 1 + u64::from(is_watched), 0]);
            assert_eq!(router.tap().sightings().count(), usize::from(is_watched));
        }
        assert!(router.table().find(OWN).unwrap().on(own).unwrap().is_route);
        // It went out by one cable, and comes in by another.
        let bytes = ping(0);
        router.handle(b, &checked(&bytes), now);
        assert_eq!(router.counters(b).unwrap()[DropReason::Duplicate], 1);
        assert_eq!(router.counters(own).unwrap().frames_out, 0);
        assert!(!router.handle_single(LinkId::new(9).unwrap(), a, &checked(&bytes), now));
    }
}
