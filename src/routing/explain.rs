//! Why a frame goes where it goes: the router's own decision, taken for a frame that is only asked
//! about. Nothing is changed, counted or learned by it.

use super::counters::DropReason;
use super::decision::{Decision, Step, Witness};
use super::link_set::{LinkId, LinkSet};
use super::options::Learn;
use super::port::Port;
use super::router::{Router, precedence};
use super::time::Time;
use crate::mavlink::{CheckedFrame, Component, FrameBuffer, MessageId};

/// What would become of a frame.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Explanation {
    /// Why it would not be taken at all, if so. `fates` tell what would be if it were.
    pub refused: Option<DropReason>,
    /// Whether it is taken only if its signature is good and newer than the last: then all else here
    /// holds for one that is.
    pub if_signature_is_good: bool,
    /// What it would be to each link, lowest number first; the one it comes from is among them.
    pub fates: Vec<(LinkId, Fate)>,
}

/// What a frame is to a link.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Fate {
    /// It is queued there, and why there.
    Sent(Way),
    /// It came from there (rule 34).
    OwnLink,
    /// The link leads the same way as the one it came from.
    OwnGroup,
    /// Its target is not there (rules 36-39).
    NoRoute(Missing),
    /// The group of the link has chosen another path.
    OtherPath,
    /// A broadcast of the source just came over this link: whoever is there has it already (rule 49).
    Loop(LinkId),
    /// It is not queued there, and counts so.
    Refused(DropReason),
}

/// Why a frame is sent to a link.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Way {
    /// It is for everybody.
    Broadcast,
    /// Its target is there.
    Route,
    /// Another link of the same group leads to the target.
    SameGroup,
    /// Everything is sent there.
    Sniffer,
}

/// Why no frame for a target goes to a link.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Missing {
    /// Neither it nor anybody of its system was heard there.
    Unheard,
    /// It was heard there too long ago.
    TooOld,
    /// It was heard there, but by nothing that teaches a route: copies, or what is not HEARTBEAT
    /// where only that teaches; or it started again elsewhere.
    NotLearned,
    /// Others of its system are there; but it was itself heard elsewhere, or `strict` is set.
    OthersOnly,
}

impl Explanation {
    /// What the frame would be to a link, if there is such a link.
    pub fn fate(&self, link: LinkId) -> Option<Fate> {
        self.fates.iter().find(|(other, _)| *other == link).map(|(_, fate)| *fate)
    }
}

impl Router {
    /// What would become of a frame that came from `link` now and had not come before; `None` if
    /// there is no such link. [`Router::handle`] would do the same, but for signatures: they are taken
    /// for good ones.
    pub fn explain(
        &self,
        link: LinkId,
        frame: &CheckedFrame<'_>,
        now: Time,
    ) -> Option<Explanation> {
        let port = self.port(link)?;
        let mut buffers = <[FrameBuffer; 2]>::default();
        let taken = &self.as_taken(link, frame, &mut buffers);
        let is_filtered = !port.takes(taken);
        let refused = port.foresee_in(frame, now);
        let refused = refused.or_else(|| is_filtered.then_some(DropReason::FilteredIn));
        let if_signature_is_good = port.looks_at_signature(frame, now);
        let mut groups = self.groups.clone();
        let mut decision = Decision {
            options: self.options,
            links: &self.links,
            table: &self.table,
            sniffers: &self.sniffers,
            has_sniffers: self.has_sniffers,
            groups: &mut groups,
            witness: Noting { ports: &self.ports, taught: self.taught(link, taken), steps: vec![] },
        };
        decision.destinations(link, taken, now);
        let steps = decision.witness.steps;
        let fates = self.links.iter().map(|to| (to, self.fate(link, to, taken, &steps, now)));
        Some(Explanation { refused, if_signature_is_good, fates: fates.collect() })
    }

    /// The route that the frame itself teaches.
    fn taught(&self, link: LinkId, frame: &CheckedFrame<'_>) -> Option<(Component, LinkId)> {
        let source = frame.header.source;
        let may_teach = match self.options.learn {
            Learn::All => true,
            Learn::Heartbeat => frame.header.id == MessageId::HEARTBEAT,
        };
        (frame.verified && may_teach && source.is_valid_source()).then_some((source, link))
    }

    /// What the steps of a decision mean for one link.
    fn fate(
        &self,
        from: LinkId,
        to: LinkId,
        frame: &CheckedFrame<'_>,
        steps: &[(Step, LinkSet)],
        now: Time,
    ) -> Fate {
        let mut fate = Fate::NoRoute(self.missing(frame.target, to, now));
        let mut was_left = false;
        for (step, left) in steps {
            let is_left = left.contains(to);
            if is_left != was_left || *step == Step::OwnPath {
                fate = self.after(*step, is_left, from, to, frame).unwrap_or(fate);
            }
            was_left = is_left;
        }
        let port = self.port(to).filter(|_| was_left);
        let refusal = port.and_then(|port| port.foresee_out(frame, precedence(frame), now));
        refusal.map_or(fate, Fate::Refused)
    }

    /// What a step has made of a link that it took out or put in; `None`: nothing that matters.
    fn after(
        &self,
        step: Step,
        is_left: bool,
        from: LinkId,
        to: LinkId,
        frame: &CheckedFrame<'_>,
    ) -> Option<Fate> {
        let group = |link| self.port(link).and_then(Port::group);
        match (step, is_left) {
            (Step::Routes, true) if frame.is_directed() => Some(Fate::Sent(Way::Route)),
            (Step::Routes, true) => Some(Fate::Sent(Way::Broadcast)),
            (Step::OwnPath, false) if to == from => Some(Fate::OwnLink),
            (Step::OwnPath, false) if group(to).is_some() && group(to) == group(from) => {
                Some(Fate::OwnGroup)
            }
            (Step::Sniffers, true) => Some(Fate::Sent(Way::Sniffer)),
            (Step::Paths, true) => Some(Fate::Sent(Way::SameGroup)),
            (Step::Paths, false) => Some(Fate::OtherPath),
            (Step::Loop(by), false) => Some(Fate::Loop(by)),
            (Step::SetupSigning, false) => Some(Fate::Refused(DropReason::SetupSigning)),
            _ => None,
        }
    }

    /// Why a link is none that leads to a target.
    fn missing(&self, target: Component, link: LinkId, now: Time) -> Missing {
        let oldest = self.options.oldest_route(now);
        let is_it = |component: Component| target.component == 0 || component == target;
        let mut missing = Missing::Unheard;
        for known in self.table.system(target.system) {
            let Some(heard) = known.on(link) else { continue };
            let here = match () {
                () if !is_it(known.component) => Missing::OthersOnly,
                () if heard.last < oldest => Missing::TooOld,
                () => Missing::NotLearned,
            };
            if missing == Missing::Unheard || is_it(known.component) {
                missing = here;
            }
        }
        missing
    }
}

/// Takes down what is decided.
struct Noting<'a> {
    ports: &'a [Option<Port>],
    taught: Option<(Component, LinkId)>,
    steps: Vec<(Step, LinkSet)>,
}

impl Witness for Noting<'_> {
    fn ports(&self) -> &[Option<Port>] {
        self.ports
    }

    fn taught(&self, component: Component) -> LinkSet {
        let taught = self.taught.filter(|(source, _)| *source == component);
        taught.map_or(LinkSet::EMPTY, |(_, link)| LinkSet::of(link))
    }

    fn note(&mut self, step: Step, left: &LinkSet) {
        self.steps.push((step, *left));
    }
}
