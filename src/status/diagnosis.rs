//! What looks wrong, by one snapshot: the causes that users ask about most, each with its remedy.

use std::collections::BTreeSet;

use super::snapshot::{
    ComponentStatus, EndpointState, EndpointStatus, LinkStatus, MessageStatus, Snapshot,
};
use crate::config::AddressKind;

/// Something that looks wrong.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Finding {
    /// Where, if it is one endpoint's matter.
    pub endpoint: Option<String>,
    /// What is wrong.
    pub problem: String,
    /// What to do about it.
    pub remedy: String,
}

/// An endpoint that is silent for so long has lost its other side, in milliseconds.
const SILENT_MS: u64 = 10_000;

/// A serial port that has brought nothing for so long is told of, as in the log.
const UNHEARD_SERIAL_MS: u64 = 5_000;

/// The number of the message that says who is there.
const HEARTBEAT: u32 = 0;

/// Less than this says nothing yet: frames, and bytes.
const FEW_FRAMES: u64 = 20;
const FEW_BYTES: u64 = 400;

impl Finding {
    fn at(endpoint: &EndpointStatus, problem: String, remedy: &str) -> Self {
        Self { endpoint: Some(endpoint.name.clone()), problem, remedy: remedy.to_owned() }
    }
}

/// What looks wrong, the gravest first.
pub fn diagnose(snapshot: &Snapshot) -> Vec<Finding> {
    // A part of the program itself has neither a cable nor anybody to switch it on.
    let of_others = snapshot.endpoints.iter().filter(|endpoint| !endpoint.is_internal);
    let endpoints: Vec<&EndpointStatus> = of_others.collect();
    let mut findings: Vec<Finding> = endpoints.iter().filter_map(|it| down(it)).collect();
    findings.extend(endpoints.iter().flat_map(|it| it.links.iter().filter_map(|l| noise(it, l))));
    findings.extend(endpoints.iter().filter_map(|it| nobody(it)));
    findings.extend(endpoints.iter().flat_map(|it| refused_peers(it)));
    findings.extend(endpoints.iter().flat_map(|it| it.links.iter().filter_map(|l| silence(it, l))));
    findings.extend(endpoints.iter().flat_map(|it| it.links.iter().flat_map(|l| refusals(it, l))));
    findings.extend(no_heartbeat(snapshot));
    findings.extend(snapshot.components.iter().filter_map(|it| two_places(it, snapshot)));
    each_once(findings)
}

/// Several links may have the same to be said of them.
fn each_once(findings: Vec<Finding>) -> Vec<Finding> {
    let mut once = Vec::new();
    for finding in findings {
        if !once.contains(&finding) {
            once.push(finding);
        }
    }
    once
}

fn down(endpoint: &EndpointStatus) -> Option<Finding> {
    let problem = match endpoint.state {
        EndpointState::Waiting => "is down",
        EndpointState::Resolving => "is down: its host name is being asked for",
        EndpointState::Connecting => "is down: it is being connected",
        EndpointState::GivenUp => "is closed and not tried again",
        EndpointState::Disabled => "is switched off",
        EndpointState::Listening | EndpointState::Up => return None,
    };
    let remedy = match endpoint.state {
        EndpointState::Disabled => "mavswitch endpoint enable NAME switches it on",
        EndpointState::GivenUp => {
            "`mavswitch endpoint disable NAME` and then `enable NAME` open it again"
        }
        _ => "it is tried again by itself; is the other side on, and the address right?",
    };
    let reason = endpoint.reason.as_ref().map_or_else(String::new, |it| format!(": {it}"));
    Some(Finding::at(endpoint, format!("{problem}{reason}"), remedy))
}

/// Nothing but what is no MAVLink, or much of it.
fn noise(endpoint: &EndpointStatus, link: &LinkStatus) -> Option<Finding> {
    let counters = &link.counters;
    let (garbage, damaged) = (counters.garbage_bytes, counters.bad_crc);
    if counters.frames_in == 0 && garbage > FEW_BYTES {
        let problem = format!("{garbage} bytes came from {}, and no frame in them", remote(link));
        let remedy = match kind(endpoint) {
            Some(AddressKind::Serial) => {
                "is the baud rate right, and does the other side speak MAVLink?"
            }
            _ => "does the other side speak MAVLink?",
        };
        return Some(Finding::at(endpoint, problem, remedy));
    }
    if damaged > FEW_FRAMES && damaged * 20 > counters.frames_in {
        let problem = format!(
            "{damaged} frames from {} came damaged, and {} whole",
            remote(link),
            counters.frames_in
        );
        let remedy = match kind(endpoint) {
            Some(AddressKind::Serial) => {
                "a bad cable, a baud rate a little off, no flow control, or two senders at once"
            }
            _ => "they were damaged before they were sent: a radio, or a program that is wrong",
        };
        return Some(Finding::at(endpoint, problem, remedy));
    }
    if counters.unknown_flags > FEW_FRAMES {
        let problem = format!(
            "{} frames from {} have a flag that nobody knows",
            counters.unknown_flags,
            remote(link)
        );
        let remedy = "they are of a newer MAVLink, or no MAVLink at all";
        return Some(Finding::at(endpoint, problem, remedy));
    }
    None
}

/// The kind of an endpoint's address, if it is one that can be configured.
fn kind(endpoint: &EndpointStatus) -> Option<AddressKind> {
    AddressKind::from_scheme(endpoint.address.split(':').next().unwrap_or_default())
}

/// Who is at the other end, without our own address.
fn remote(link: &LinkStatus) -> &str {
    link.peer.split(" from ").next().unwrap_or_default()
}

fn nobody(endpoint: &EndpointStatus) -> Option<Finding> {
    let is_open = endpoint.state == EndpointState::Listening && endpoint.links.is_empty();
    let remedy = match kind(endpoint) {
        Some(AddressKind::TcpIn) => {
            "does the other side connect to this address and port? Firewalls keep connections out"
        }
        _ => {
            "does the other side send to this address and port? It is admitted by its first frame; \
             firewalls keep that out"
        }
    };
    is_open
        .then(|| Finding::at(endpoint, "nobody has come yet, or all have gone".to_owned(), remedy))
}

/// Who is kept out by an option that may be too narrow.
fn refused_peers(endpoint: &EndpointStatus) -> Vec<Finding> {
    let refused = |reason: &str| endpoint.refused_peers.get(reason).copied().unwrap_or(0);
    let (outside, unbelieved, full) = (refused("outside"), refused("unbelieved"), refused("full"));
    let mut findings = Vec::new();
    let mut find = |problem, remedy| findings.push(Finding::at(endpoint, problem, remedy));
    // Whoever has peers may be glad that strangers are kept out.
    if endpoint.links.is_empty() && outside > 0 {
        let problem = format!("{outside} datagrams or connections came from outside allow_from");
        find(problem, "the log names their addresses: is one of them to be let in?");
    }
    if endpoint.links.is_empty() && unbelieved > 0 {
        let problem = format!("{unbelieved} datagrams or connections were not believed (`verify`)");
        let remedy =
            "the log says why of each: no signature, another key, or a clock that is behind";
        find(problem, remedy);
    }
    if full > 0 {
        let problem = format!("{full} datagrams or connections found max_peers reached");
        find(problem, "raise max_peers, or find out who the others are");
    }
    findings
}

fn silence(endpoint: &EndpointStatus, link: &LinkStatus) -> Option<Finding> {
    let counters = &link.counters;
    if counters.frames_in == 0 && counters.garbage_bytes <= FEW_BYTES {
        let is_serial = kind(endpoint) == Some(AddressKind::Serial);
        if link.up_ago_ms < if is_serial { UNHEARD_SERIAL_MS } else { SILENT_MS } {
            return None;
        }
        let problem = format!("no frame has ever come from {}", remote(link));
        return Some(Finding::at(endpoint, problem, who_never_spoke(kind(endpoint))));
    }
    let silent = link.heard_ago_ms.filter(|ago| *ago > SILENT_MS && counters.frames_in > 0)?;
    let problem = format!("{} has been silent for {} s", remote(link), silent / 1_000);
    Some(Finding::at(endpoint, problem, "is the other side still on, and in reach?"))
}

/// What to do about somebody who never spoke, by the kind of the endpoint.
fn who_never_spoke(kind: Option<AddressKind>) -> &'static str {
    match kind {
        Some(AddressKind::Serial) => {
            "is the port set to MAVLink there? Are RX and TX swapped, is ground joined, is there \
             power?"
        }
        Some(AddressKind::UdpOut | AddressKind::UdpBroadcast | AddressKind::Multicast) => {
            "does anybody listen there? It has to answer to the port that it was sent from; is a \
             firewall between?"
        }
        Some(AddressKind::TcpIn | AddressKind::TcpOut) => {
            "it is connected: does it speak MAVLink, or does it wait for somebody to speak first?"
        }
        _ => "is the other side on, and does it speak MAVLink?",
    }
}

fn refusals(endpoint: &EndpointStatus, link: &LinkStatus) -> Vec<Finding> {
    let counters = &link.counters;
    let refused = |reason: &str| counters.refused.get(reason).copied().unwrap_or(0);
    let mut findings = Vec::new();
    let mut find = |problem, remedy| findings.push(Finding::at(endpoint, problem, remedy));
    let (filtered_in, filtered_out) = (refused("filtered_in"), refused("filtered_out"));
    if counters.frames_in > FEW_FRAMES && filtered_in == counters.frames_in {
        let problem = format!("its lists let none of {filtered_in} frames in");
        find(problem, "see allow_*_in and block_*_in of this endpoint");
    }
    if counters.frames_out == 0 && filtered_out > FEW_FRAMES {
        let problem = format!("its lists let none of {filtered_out} frames out");
        find(problem, "see allow_*_out and block_*_out of this endpoint");
    }
    let full = refused("queue_full");
    if full > FEW_FRAMES && full * 50 > counters.frames_out {
        let problem =
            format!("{full} frames found its queue full, {} did not", counters.frames_out);
        find(problem, "it carries less than it is sent: a faster line, `rate` caps, or lists");
    }
    let (unsigned, wrong) = (refused("unsigned"), refused("wrong_signature"));
    if unsigned > FEW_FRAMES && unsigned * 10 > counters.frames_in {
        let problem = format!("{unsigned} frames from {} were not signed", remote(link));
        find(problem, "switch signing on there, with the key of `verify`");
    }
    if wrong > FEW_FRAMES && wrong * 10 > counters.frames_in {
        let problem = format!("{wrong} frames from {} were signed with another key", remote(link));
        find(problem, "give both sides the same key");
    }
    let unrouted = refused("no_route");
    if unrouted > FEW_FRAMES && unrouted * 10 > counters.frames_in {
        let problem = format!("{unrouted} frames from {} were for nobody known here", remote(link));
        find(problem, "their target was never heard; `mavswitch listen dropped` shows which it is");
    }
    findings
}

/// A vehicle that nobody sees: frames come, and no heartbeat among them.
fn no_heartbeat(snapshot: &Snapshot) -> Option<Finding> {
    let components = &snapshot.components;
    let is_heartbeat = |message: &MessageStatus| message.id == HEARTBEAT;
    let is_silent = !snapshot.messages.is_empty() && !snapshot.messages.iter().any(is_heartbeat);
    let sources: Vec<String> =
        components.iter().take(5).map(|it| format!("{}/{}", it.system, it.component)).collect();
    let problem = format!("no HEARTBEAT has come, only other frames of {}", sources.join(", "));
    let remedy =
        "a ground station shows no vehicle without: does the autopilot send it on this port?";
    is_silent.then(|| Finding { endpoint: None, problem, remedy: remedy.to_owned() })
}

/// A component that is heard at two endpoints which are in no common group.
fn two_places(component: &ComponentStatus, snapshot: &Snapshot) -> Option<Finding> {
    let group = |name: &str| {
        let endpoint = snapshot.endpoints.iter().find(|endpoint| endpoint.name == name);
        endpoint.and_then(|endpoint| endpoint.group.clone()).unwrap_or_else(|| name.to_owned())
    };
    let fresh = component.heard.iter().filter(|heard| heard.heard_ago_ms < SILENT_MS);
    let names: BTreeSet<&str> = fresh.map(|heard| heard.endpoint.as_str()).collect();
    let ways: BTreeSet<String> = names.iter().map(|name| group(name)).collect();
    let problem = format!(
        "{}/{} is heard at {}",
        component.system,
        component.component,
        names.into_iter().collect::<Vec<_>>().join(" and ")
    );
    let remedy = "two vehicles with one system id? Give each its own. Two ways to one vehicle? Put the \
                  endpoints into one `group`";
    (ways.len() > 1).then(|| Finding { endpoint: None, problem, remedy: remedy.to_owned() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::status::{Counters, HeardStatus};

    fn endpoint(name: &str, state: EndpointState, links: Vec<LinkStatus>) -> EndpointStatus {
        EndpointStatus { name: name.to_owned(), state, links, ..EndpointStatus::default() }
    }

    fn link(counters: Counters) -> LinkStatus {
        LinkStatus {
            peer: "/dev/ttyS1".to_owned(),
            up_ago_ms: 60_000,
            counters,
            ..LinkStatus::default()
        }
    }

    fn found(endpoints: Vec<EndpointStatus>, components: Vec<ComponentStatus>) -> Vec<String> {
        let snapshot = Snapshot { endpoints, components, ..Snapshot::default() };
        diagnose(&snapshot).into_iter().map(|it| it.problem).collect()
    }

    #[test]
    fn a_wrong_baud_rate_shows_by_bytes_without_frames() {
        let counters = Counters { garbage_bytes: 9_000, ..Counters::default() };
        let fc = endpoint("fc", EndpointState::Up, vec![link(counters)]);
        assert_eq!(
            found(vec![fc], vec![]),
            ["9000 bytes came from /dev/ttyS1, and no frame in them"]
        );
    }

    #[test]
    fn what_to_do_is_told_by_the_kind_of_endpoint() {
        let told = |address: &str, peer: &str, up_ago_ms: u64| {
            let link = LinkStatus { peer: peer.to_owned(), up_ago_ms, ..LinkStatus::default() };
            let mut it = endpoint("it", EndpointState::Up, vec![link]);
            it.address = address.to_owned();
            diagnose(&Snapshot { endpoints: vec![it], ..Snapshot::default() })
        };
        let uart = &told("serial:/dev/ttyS1:57600", "/dev/ttyS1", 5_000)[0];
        assert!(uart.remedy.contains("RX and TX"), "{uart:?}");
        assert!(told("udpout:10.0.0.2:14550", "10.0.0.2:14550", 5_000).is_empty());
        let gcs = "10.0.0.2:14550 from 0.0.0.0:40001";
        let gcs = &told("udpout:10.0.0.2:14550", gcs, 10_000)[0];
        assert_eq!(gcs.problem, "no frame has ever come from 10.0.0.2:14550");
        assert!(gcs.remedy.contains("listen there"), "{gcs:?}");
        assert!(!gcs.remedy.contains("RX"), "{gcs:?}");
        let client = &told("tcpin:0.0.0.0:5760", "10.0.0.2:40001", 10_000)[0];
        assert!(client.remedy.starts_with("it is connected"), "{client:?}");
    }

    #[test]
    fn the_same_is_told_once() {
        let refused = [("filtered_in".to_owned(), 90)].into();
        let counters = Counters { frames_in: 90, refused, ..Counters::default() };
        let link = LinkStatus { heard_ago_ms: Some(10), ..link(counters) };
        let fc = endpoint("fc", EndpointState::Up, vec![link.clone(), link]);
        assert_eq!(found(vec![fc], vec![]).len(), 1);
    }

    #[test]
    fn what_is_down_or_silent_is_told_with_its_reason() {
        let mut radio = endpoint("radio", EndpointState::Waiting, vec![]);
        radio.reason = Some("/dev/ttyUSB0: No such file or directory".to_owned());
        let fc = endpoint("fc", EndpointState::Up, vec![link(Counters::default())]);
        let gcs = endpoint("gcs", EndpointState::Listening, vec![]);
        let found = found(vec![fc, gcs, radio], vec![]);
        assert_eq!(found[0], "is down: /dev/ttyUSB0: No such file or directory");
        assert_eq!(found[1], "nobody has come yet, or all have gone");
        assert_eq!(found[2], "no frame has ever come from /dev/ttyS1");
    }

    #[test]
    fn an_empty_server_that_sent_people_away_may_be_too_strict() {
        let mut gcs = endpoint("gcs", EndpointState::Listening, vec![]);
        gcs.refused_peers = [("outside".to_owned(), 7), ("unbelieved".to_owned(), 8)].into();
        let problems = found(vec![gcs.clone()], vec![]);
        assert_eq!(problems[1], "7 datagrams or connections came from outside allow_from");
        assert_eq!(problems[2], "8 datagrams or connections were not believed (`verify`)");
        let link = LinkStatus { heard_ago_ms: Some(10), ..link(Counters::default()) };
        gcs.links = vec![LinkStatus { up_ago_ms: 10, ..link }];
        assert!(found(vec![gcs.clone()], vec![]).is_empty(), "those who are meant are there");
        gcs.refused_peers = [("full".to_owned(), 9)].into();
        let full = ["9 datagrams or connections found max_peers reached"];
        assert_eq!(found(vec![gcs], vec![]), full);
    }

    #[test]
    fn a_log_that_was_played_back_is_waited_for_by_nobody() {
        let mut log = endpoint("log", EndpointState::GivenUp, vec![]);
        log.reason = Some("the log has ended".to_owned());
        assert_eq!(found(vec![log], vec![]), ["is closed and not tried again: the log has ended"]);
    }

    #[test]
    fn a_part_of_the_program_itself_has_no_cable() {
        let mut logs = endpoint("flight-logs", EndpointState::Up, vec![link(Counters::default())]);
        assert_eq!(found(vec![logs.clone()], vec![]).len(), 1);
        logs.is_internal = true;
        assert!(found(vec![logs], vec![]).is_empty());
    }

    #[test]
    fn lists_that_swallow_everything_are_found() {
        let refused = [("filtered_in".to_owned(), 90)].into();
        let counters = Counters { frames_in: 90, refused, ..Counters::default() };
        let mut link = link(counters);
        link.heard_ago_ms = Some(10);
        let found = found(vec![endpoint("fc", EndpointState::Up, vec![link])], vec![]);
        assert_eq!(found, ["its lists let none of 90 frames in"]);
    }

    #[test]
    fn frames_without_any_heartbeat_are_found() {
        let component = ComponentStatus { system: 1, component: 1, ..ComponentStatus::default() };
        let message =
            |id| MessageStatus { system: 1, component: 1, id, ..MessageStatus::default() };
        let mut snapshot = Snapshot { components: vec![component], ..Snapshot::default() };
        assert!(diagnose(&snapshot).is_empty(), "nothing is known of messages");
        snapshot.messages = vec![message(30), message(33)];
        let found = diagnose(&snapshot);
        assert_eq!(found[0].problem, "no HEARTBEAT has come, only other frames of 1/1");
        snapshot.messages.push(message(0));
        assert!(diagnose(&snapshot).is_empty());
    }

    #[test]
    fn one_system_at_two_places_is_found_unless_they_are_one_way() {
        let heard =
            |name: &str| HeardStatus { endpoint: name.to_owned(), ..HeardStatus::default() };
        let component = ComponentStatus {
            system: 1,
            component: 1,
            vehicle: None,
            heard: vec![heard("a"), heard("b")],
        };
        let mut ways = ["a", "b"].map(|name| endpoint(name, EndpointState::Up, vec![]));
        assert_eq!(found(ways.to_vec(), vec![component.clone()]), ["1/1 is heard at a and b"]);
        ways.iter_mut().for_each(|way| way.group = Some("vehicle".to_owned()));
        assert!(found(ways.to_vec(), vec![component]).is_empty());
    }
}
