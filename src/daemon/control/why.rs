//! The request `why`: what the router would do with a frame, asked of the router itself.

use super::Daemon;
use crate::config::message_hint;
use crate::control::Answer;
use crate::mavlink::{
    CheckedFrame, Component, Definition, FrameSpec, Header, MessageId, SIGNATURE, Target, Version,
};
use crate::routing::{Explanation, Fate, LinkId, Missing, Way};
use crate::status::{FrameFate, LinkFate, Why};

/// How many places a frame may come from that are looked at.
const MAX_ORIGINS: usize = 8;

/// What is asked about if no message is named: beside HEARTBEAT, which is for everybody, one that is
/// for the target alone.
const COMMAND_LONG: MessageId = MessageId(76);

/// How a frame looks that is asked about, as far as that was said.
#[derive(Clone, Copy, Debug)]
pub(super) struct FrameShape {
    version: Version,
    /// Whether it is signed; if it was not said, it is where signatures are asked for. MAVLink 1 never
    /// is.
    signed: Option<bool>,
}

impl FrameShape {
    /// `mavlink`: 1 or 2; MAVLink 2 if it was not said.
    pub(super) fn new(mavlink: Option<u8>, signed: Option<bool>) -> Result<Self, String> {
        match (mavlink, signed) {
            (Some(1), Some(true)) => {
                Err("MAVLink 1 cannot be signed: ask about MAVLink 2, or about what is not signed"
                    .into())
            }
            (Some(1), _) => Ok(Self { version: Version::V1, signed: Some(false) }),
            (None | Some(2), _) => Ok(Self { version: Version::V2, signed }),
            (Some(other), _) => Err(format!("there is no MAVLink {other}: expected 1 or 2")),
        }
    }

    /// Holds that a message can have this shape.
    fn check(self, message: &Definition) -> Result<(), String> {
        if self.version == Version::V1 && message.id.0 > 255 {
            return Err(format!(
                "{} has an id above 255: MAVLink 1 does not have it",
                message.name
            ));
        }
        Ok(())
    }

    /// A frame of this shape, of nothing but zeros; its signature is no good.
    fn frame(self, message: &Definition, source: Component, is_signed: bool) -> Vec<u8> {
        let payload = vec![0; usize::from(message.base_len.min(255))];
        let spec = FrameSpec::new(source, message.id, message.crc_extra, &payload);
        let signature = is_signed.then_some([0; SIGNATURE]);
        FrameSpec { version: self.version, signature, ..spec }.to_frame()
    }
}

/// Who sends, or who shall hear.
enum Party {
    Everybody,
    System(u8),
    Component(Component),
    /// Whoever is on a link of an endpoint.
    Endpoint(String),
}

impl Daemon {
    /// Answers why frames go where they go.
    pub(super) fn request_why(
        &self,
        from: &str,
        to: &str,
        message: Option<&str>,
        shape: FrameShape,
    ) -> Answer {
        match self.why(from, to, message, shape) {
            Ok(why) => Answer::Why(Box::new(why)),
            Err(text) => Answer::Error(text),
        }
    }

    fn why(
        &self,
        from: &str,
        to: &str,
        message: Option<&str>,
        shape: FrameShape,
    ) -> Result<Why, String> {
        let (sender, hearer) = (self.party(from)?, self.party(to)?);
        if matches!(sender, Party::Everybody) {
            return Err(not_a_sender(from));
        }
        let messages = match message {
            Some(name) => vec![self.message(name)?],
            None if self.target_of(&hearer).system == 0 => vec![self.known(MessageId::HEARTBEAT)?],
            None => vec![self.known(MessageId::HEARTBEAT)?, self.known(COMMAND_LONG)?],
        };
        messages.iter().try_for_each(|message| shape.check(message))?;
        let (origins, wanted) = (self.origins(&sender), self.links_where(&hearer));
        let fate = |definition: &Definition, (link, source): (LinkId, Component)| {
            self.fate_of(definition, shape, source, self.target_of(&hearer), link, &wanted)
        };
        let frames = messages
            .iter()
            .flat_map(|definition| origins.iter().filter_map(|origin| fate(definition, *origin)));
        Ok(Why {
            from: from.to_owned(),
            to: to.to_owned(),
            from_is_known: !origins.is_empty(),
            to_is_known: matches!(hearer, Party::Everybody) || !wanted.is_empty(),
            frames: frames.collect(),
        })
    }

    /// Whom a word means: `all`, `1`, `1/190`, or the name of an endpoint.
    fn party(&self, word: &str) -> Result<Party, String> {
        let is_name = self.io.endpoints.iter().any(|endpoint| endpoint.name == word);
        let number = |text: &str| text.parse::<u8>().ok().filter(|id| *id > 0);
        let pair = word.split_once('/').and_then(|(system, component)| {
            Some(Component::new(system.parse().ok()?, component.parse().ok()?))
        });
        match (word, number(word), pair) {
            // Whatever component of system 0: it is everybody (rule 33).
            ("all" | "0", ..) | (.., Some(Component { system: 0, .. })) => Ok(Party::Everybody),
            (_, Some(system), _) | (.., Some(Component { system, component: 0 })) => {
                Ok(Party::System(system))
            }
            (_, _, Some(component)) => Ok(Party::Component(component)),
            _ if is_name => Ok(Party::Endpoint(word.to_owned())),
            _ => {
                let names: Vec<&str> =
                    self.io.endpoints.iter().map(|endpoint| endpoint.name.as_str()).collect();
                Err(format!(
                    "{word} is nobody: write 1/190 for a component, 1 for a system, all, or the \
                     name of an endpoint: {}",
                    names.join(", ")
                ))
            }
        }
    }

    fn message(&self, name: &str) -> Result<Definition, String> {
        let dialect = self.checker.dialect();
        let found = match name.parse() {
            Ok(id) => dialect.by_id(MessageId(id)),
            Err(_) => dialect.definitions().iter().find(|it| it.name.eq_ignore_ascii_case(name)),
        };
        let unknown = || {
            let start = "start the router with --dialect and the file that has it";
            format!("{name} is no message known here: {}", message_hint(name, dialect, start))
        };
        found.cloned().ok_or_else(unknown)
    }

    fn known(&self, id: MessageId) -> Result<Definition, String> {
        self.message(&id.to_string())
    }

    fn target_of(&self, hearer: &Party) -> Component {
        match hearer {
            Party::Everybody | Party::Endpoint(_) => Component::new(0, 0),
            Party::System(system) => Component::new(*system, 0),
            Party::Component(component) => *component,
        }
    }

    /// Where the sender's frames come from, and which component it is.
    fn origins(&self, sender: &Party) -> Vec<(LinkId, Component)> {
        let mut origins = Vec::new();
        for known in self.router.table().components() {
            let is_it = match sender {
                Party::Everybody | Party::Endpoint(_) => true,
                Party::System(system) => known.component.system == *system,
                Party::Component(component) => known.component == *component,
            };
            let is_there = |link: LinkId| match sender {
                Party::Endpoint(name) => self.endpoint_name(link) == name,
                _ => true,
            };
            let links = known.heard.iter().map(|heard| heard.link);
            let links = links.filter(|link| is_it && is_there(*link));
            origins.extend(links.map(|link| (link, known.component)));
        }
        origins.sort_by_key(|(link, component)| (*component, *link));
        origins.truncate(MAX_ORIGINS);
        origins
    }

    /// The links that the hearer is on.
    fn links_where(&self, hearer: &Party) -> Vec<LinkId> {
        if let Party::Endpoint(name) = hearer {
            let links = self.router.links();
            return links.iter().filter(|link| self.endpoint_name(*link) == name).collect();
        }
        let Component { system, component } = self.target_of(hearer);
        let known = self.router.table().system(system);
        let known = known.filter(|it| component == 0 || it.component.component == component);
        let mut links: Vec<LinkId> =
            known.flat_map(|it| it.heard.iter().map(|heard| heard.link)).collect();
        links.sort_unstable();
        links.dedup();
        links
    }

    fn fate_of(
        &self,
        definition: &Definition,
        shape: FrameShape,
        source: Component,
        asked: Component,
        link: LinkId,
        wanted: &[LinkId],
    ) -> Option<FrameFate> {
        let target = match definition.target {
            Target::None => Component::new(0, 0),
            Target::System(_) => Component::new(asked.system, 0),
            Target::SystemComponent(..) => asked,
        };
        // On that link both may have other ids than here.
        let (from, to) =
            (self.router.on_the_wire(link, source), self.router.on_the_wire(link, target));
        let is_signed = shape.signed.unwrap_or_else(|| self.router.asks_for_signatures(link));
        let bytes = shape.frame(definition, from, is_signed);
        let header = Header::parse(&bytes).ok()?;
        let frame = CheckedFrame { bytes: &bytes, header, target: to, verified: true };
        let Explanation { refused, if_signature_is_good, fates } =
            self.router.explain(link, &frame, self.now)?;
        let links = fates.iter().map(|(to, fate)| self.link_fate(*to, *fate, wanted));
        Some(FrameFate {
            source: source.to_string(),
            target: shown(target),
            message: definition.name.to_string(),
            endpoint: self.endpoint_name(link).to_owned(),
            link: number(link),
            peer: self.peer_name(link),
            refused: refused.map(|reason| reason.name().to_owned()),
            if_signature_is_good,
            links: links.collect(),
        })
    }

    fn link_fate(&self, link: LinkId, fate: Fate, wanted: &[LinkId]) -> LinkFate {
        let by = match fate {
            Fate::Loop(by) => Some(self.endpoint_name(by).to_owned()),
            _ => None,
        };
        LinkFate {
            endpoint: self.endpoint_name(link).to_owned(),
            link: number(link),
            peer: self.peer_name(link),
            is_wanted: wanted.contains(&link),
            is_sent: matches!(fate, Fate::Sent(_)),
            reason: reason(fate).to_owned(),
            by,
        }
    }

    /// The name of a link's endpoint.
    pub(super) fn endpoint_name(&self, link: LinkId) -> &str {
        let link = self.io.links.get(link);
        let endpoint = link.and_then(|link| self.io.endpoints.get(link.endpoint));
        endpoint.map_or("", |endpoint| endpoint.name.as_str())
    }

    fn peer_name(&self, link: LinkId) -> String {
        self.io.links.get(link).map_or_else(String::new, |link| link.peer.clone())
    }
}

/// Below the number of links that there may be.
fn number(link: LinkId) -> u16 {
    link.index() as u16
}

/// Why nobody sends by this word, which means everybody.
fn not_a_sender(word: &str) -> String {
    match word {
        "all" => "`all` send nothing together: name one of them, as 1/1".to_owned(),
        _ => format!(
            "{word} has system 0, which is nobody's: what it sends goes on to the others, but nothing \
             is learned from it, so no answer finds it. Let it have a system and component id of its \
             own (source_system and source_component in pymavlink)"
        ),
    }
}

fn shown(target: Component) -> String {
    match target {
        Component { system: 0, .. } => "all".to_owned(),
        Component { system, component: 0 } => system.to_string(),
        target => target.to_string(),
    }
}

fn reason(fate: Fate) -> &'static str {
    match fate {
        Fate::Sent(Way::Broadcast) => "broadcast",
        Fate::Sent(Way::Route) => "route",
        Fate::Sent(Way::SameGroup) => "same_group",
        Fate::Sent(Way::Sniffer) => "sniffer",
        Fate::OwnLink => "own_link",
        Fate::OwnGroup => "own_group",
        Fate::NoRoute(Missing::Unheard) => "unheard",
        Fate::NoRoute(Missing::TooOld) => "stale",
        Fate::NoRoute(Missing::NotLearned) => "not_learned",
        Fate::NoRoute(Missing::OthersOnly) => "others_only",
        Fate::OtherPath => "other_path",
        Fate::Loop(_) => "loop",
        Fate::Refused(reason) => reason.name(),
    }
}
