//! What goes on in a second: the difference of two pictures.

use super::{Counters, HeardStatus, LinkStatus, MessageStatus, Snapshot};

/// The time between two pictures, and what was counted at its beginning.
#[derive(Clone, Copy, Debug)]
pub struct Rates<'a> {
    before: &'a Snapshot,
    seconds: f64,
}

/// Frames and bytes a second.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Rate {
    /// Frames a second.
    pub frames: f64,
    /// Bytes a second.
    pub bytes: f64,
}

impl<'a> Rates<'a> {
    /// What happened from `before` to `after`; `None` if that is no time, or if they are pictures of
    /// two programs.
    pub fn between(before: &'a Snapshot, after: &Snapshot) -> Option<Self> {
        let is_same = before.program == after.program && before.time_us < after.time_us;
        let seconds = (after.time_us.saturating_sub(before.time_us)) as f64 / 1e6;
        is_same.then_some(Self { before, seconds })
    }

    /// What a link took and sent. One that has come meanwhile began with nothing.
    pub fn link(&self, after: &LinkStatus) -> (Rate, Rate) {
        let none = Counters::default();
        let was = self.link_before(after).map_or(&none, |link| &link.counters);
        let is = &after.counters;
        let taken = self.rate((was.frames_in, was.bytes_in), (is.frames_in, is.bytes_in));
        let sent = self.rate((was.frames_out, was.bytes_out), (is.frames_out, is.bytes_out));
        (taken, sent)
    }

    /// The same link before: another one may have had its number.
    fn link_before(&self, after: &LinkStatus) -> Option<&LinkStatus> {
        let is_it = |link: &&LinkStatus| {
            link.id == after.id
                && link.peer == after.peer
                && link.counters.frames_in <= after.counters.frames_in
                && link.counters.frames_out <= after.counters.frames_out
        };
        self.before.endpoints.iter().flat_map(|endpoint| &endpoint.links).find(is_it)
    }

    /// Frames a second of a component, over all its links.
    pub fn component(&self, system: u8, component: u8, heard: &[HeardStatus]) -> f64 {
        let frames = |heard: &[HeardStatus]| heard.iter().map(|it| it.frames).sum::<u64>();
        let mut before = self.before.components.iter();
        let was = before.find(|it| (it.system, it.component) == (system, component));
        let was = was.map_or(0, |it| frames(&it.heard));
        frames(heard).saturating_sub(was) as f64 / self.seconds
    }

    /// How often a message of a component came.
    pub fn message(&self, after: &MessageStatus) -> Rate {
        let mut before = self.before.messages.iter();
        let key = |it: &MessageStatus| (it.system, it.component, it.id);
        let was = before.find(|it| key(it) == key(after));
        let was = was.map_or((0, 0), |it| (it.frames, it.bytes));
        self.rate(was, (after.frames, after.bytes))
    }

    fn rate(&self, was: (u64, u64), is: (u64, u64)) -> Rate {
        let a_second = |was: u64, is: u64| is.saturating_sub(was) as f64 / self.seconds;
        Rate { frames: a_second(was.0, is.0), bytes: a_second(was.1, is.1) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::status::{ComponentStatus, EndpointStatus};

    fn picture(time_us: u64, frames: u64, peer: &str) -> Snapshot {
        let counters = Counters { frames_in: frames, bytes_in: frames * 10, ..Counters::default() };
        let link = LinkStatus { peer: peer.to_owned(), counters, ..LinkStatus::default() };
        let name = "fc".to_owned();
        let endpoint = EndpointStatus { name, links: vec![link], ..EndpointStatus::default() };
        let heard = vec![HeardStatus { frames, ..HeardStatus::default() }];
        let component = ComponentStatus { system: 1, component: 1, heard, ..Default::default() };
        let message = MessageStatus { frames, bytes: frames * 10, ..MessageStatus::default() };
        Snapshot {
            time_us,
            endpoints: vec![endpoint],
            components: vec![component],
            messages: vec![message],
            ..Snapshot::default()
        }
    }

    #[test]
    fn rates_are_differences_by_time() {
        let (before, after) = (picture(1_000_000, 100, "a"), picture(3_000_000, 150, "a"));
        let rates = Rates::between(&before, &after).unwrap();
        let (taken, sent) = rates.link(&after.endpoints[0].links[0]);
        assert_eq!((taken, sent), (Rate { frames: 25.0, bytes: 250.0 }, Rate::default()));
        assert_eq!(rates.component(1, 1, &after.components[0].heard), 25.0);
        assert_eq!(rates.message(&after.messages[0]).frames, 25.0);
    }

    #[test]
    fn a_link_is_found_by_its_number_whatever_its_endpoint_is_called() {
        let [mut before, mut after] = [(0, 100), (1_000_000, 130)].map(|(time_us, frames)| {
            let mut picture = picture(time_us, 0, "first");
            let mut second = self::picture(time_us, frames, "second").endpoints.remove(0);
            second.links[0].id = 1;
            picture.endpoints.push(second);
            picture
        });
        let frames = |before: &Snapshot, after: &Snapshot| {
            let rates = Rates::between(before, after).unwrap();
            rates.link(&after.endpoints[1].links[0]).0.frames
        };
        assert_eq!(frames(&before, &after), 30.0);
        before.endpoints[1].name = "fc#2".to_owned();
        after.endpoints[1].name = "other".to_owned();
        assert_eq!(frames(&before, &after), 30.0);
    }

    #[test]
    fn a_link_that_took_the_number_of_another_began_with_nothing() {
        let (before, after) = (picture(0, 100, "a"), picture(1_000_000, 30, "b"));
        let rates = Rates::between(&before, &after).unwrap();
        assert_eq!(rates.link(&after.endpoints[0].links[0]).0.frames, 30.0);
    }

    #[test]
    fn there_are_none_without_time_or_between_two_programs() {
        let picture = picture(5, 1, "a");
        assert!(Rates::between(&picture, &picture).is_none());
        let mut other = picture.clone();
        (other.program.pid, other.time_us) = (7, 9);
        assert!(Rates::between(&picture, &other).is_none());
    }
}
