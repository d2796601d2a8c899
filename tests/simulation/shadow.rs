//! What must be true of one router, whatever comes: the rules, kept with plain sets and lists.

use std::collections::{HashMap, HashSet};

use mavswitch::mavlink::{CheckedFrame, Component};
use mavswitch::routing::{DropReason, LinkCounters, LinkId, Router, Time};

/// A router, and what is remembered of it.
pub(crate) struct Watched {
    pub(crate) router: Router,
    /// Who was heard on each link since it is open (rule 35).
    heard: HashMap<LinkId, HashSet<Component>>,
    /// What waits for each link, in the order in which it must leave (rule 42).
    waiting: HashMap<LinkId, Vec<Vec<u8>>>,
    /// Of each frame: the link that brought it first, if that is still open, and how often the frame
    /// was passed on and may have been.
    passed: HashMap<Vec<u8>, Passed>,
}

struct Passed {
    first: Option<LinkId>,
    times: usize,
    allowed: usize,
}

impl Watched {
    pub(crate) fn new(router: Router) -> Self {
        let (heard, waiting, passed) = (HashMap::new(), HashMap::new(), HashMap::new());
        Self { router, heard, waiting, passed }
    }

    pub(crate) fn open(&mut self, link: LinkId) {
        assert!(self.heard.insert(link, HashSet::new()).is_none(), "{link} is given twice");
        self.waiting.insert(link, Vec::new());
    }

    pub(crate) fn close(&mut self, link: LinkId) {
        self.router.remove_link(link);
        self.heard.remove(&link);
        self.waiting.remove(&link);
        for passed in self.passed.values_mut().filter(|passed| passed.first == Some(link)) {
            passed.first = None;
        }
    }

    /// A frame comes in; checks where it goes.
    pub(crate) fn handle(&mut self, link: LinkId, frame: &CheckedFrame<'_>, now: Time) {
        let before = self.counters();
        self.router.handle(link, frame, now);
        let after = self.counters();
        let sent = |id: &LinkId| after[id].frames_out - before[id].frames_out;
        let got: HashSet<LinkId> = after.keys().copied().filter(|id| sent(id) > 0).collect();

        assert!(got.iter().all(|id| sent(id) == 1), "rule 34: twice to one link");
        assert!(!got.contains(&link), "rule 34: back to where it came from");
        self.check_copies(link, frame, !got.is_empty());
        let was_copy = dropped(&before, &after, link, DropReason::Duplicate);
        self.heard.get_mut(&link).unwrap().insert(frame.header.source);
        self.check_destinations(link, frame, &got, was_copy);
        let refused = before.values().map(LinkCounters::dropped).sum::<u64>()
            < after.values().map(LinkCounters::dropped).sum::<u64>();
        let is_alone = after.len() == 1;
        assert!(!got.is_empty() || refused || is_alone, "it is gone, and nothing was counted");
        for id in got {
            self.waiting.get_mut(&id).unwrap().push(frame.bytes.to_vec());
        }
    }

    fn counters(&self) -> HashMap<LinkId, LinkCounters> {
        let links = self.router.links();
        links.iter().map(|link| (link, *self.router.counters(link).unwrap())).collect()
    }

    /// Rule 49: it is passed on once for each time that the link that was first brings it. Where that
    /// link is closed, another may take its place.
    fn check_copies(&mut self, link: LinkId, frame: &CheckedFrame<'_>, is_passed: bool) {
        let nothing = Passed { first: None, times: 0, allowed: 0 };
        let passed = self.passed.entry(frame.bytes.to_vec()).or_insert(nothing);
        if *passed.first.get_or_insert(link) == link {
            passed.allowed += 1;
        }
        passed.times += usize::from(is_passed);
        assert!(passed.times <= passed.allowed, "rule 49: passed on {} times", passed.times);
    }

    /// Rules 33 and 36-39: only to where the target was heard; a broadcast to all, but for links on
    /// which its source was heard.
    fn check_destinations(
        &self,
        link: LinkId,
        frame: &CheckedFrame<'_>,
        got: &HashSet<LinkId>,
        was_copy: bool,
    ) {
        let target = frame.target;
        let on = |is_meant: &dyn Fn(&Component) -> bool| -> HashSet<LinkId> {
            let links = self.heard.iter().filter(|(_, heard)| heard.iter().any(is_meant));
            links.map(|(link, _)| *link).collect()
        };
        let exact = on(&|heard| *heard == target);
        let of_system = on(&|heard| heard.system == target.system);
        let most: HashSet<LinkId> = match target {
            Component { system: 0, .. } => self.heard.keys().copied().collect(),
            Component { component: 0, .. } => of_system,
            _ if exact.is_empty() => of_system,
            _ => exact,
        };
        let source = frame.header.source;
        let may_loop = |id: &LinkId| target.system == 0 && self.heard[id].contains(&source);
        let least = most.iter().filter(|id| **id != link && !may_loop(id));
        assert!(got.is_subset(&most), "{got:?}, and {target} is on {most:?}");
        for id in least {
            assert!(was_copy || got.contains(id), "{id} does not get what is for {target}");
        }
    }

    /// What waits for a link leaves.
    pub(crate) fn flush(&mut self, link: LinkId) -> Vec<Vec<u8>> {
        let port = self.router.port_mut(link).unwrap();
        let frames: Vec<_> = port.frames().map(|(a, b)| [a, b].concat()).collect();
        let (first, second) = port.head(usize::MAX);
        assert_eq!([first, second].concat(), frames.concat(), "whole frames and nothing else");
        port.consume(frames.concat().len());
        let expected = std::mem::take(self.waiting.get_mut(&link).unwrap());
        assert_eq!(frames, expected, "rule 42: what was taken leaves whole and in order");
        frames
    }
}

fn dropped(
    before: &HashMap<LinkId, LinkCounters>,
    after: &HashMap<LinkId, LinkCounters>,
    link: LinkId,
    reason: DropReason,
) -> bool {
    after[&link][reason] > before[&link][reason]
}
