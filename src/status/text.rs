//! A picture as text for people: what is open, what each link carries, who was heard, what they say.

use std::fmt::Write;

use super::columns::Columns;
use super::rates::{Rate, Rates};
use super::record_text;
use super::units::{bytes, number, percent, time};
use super::{
    ArmedState, ComponentStatus, Counters, EndpointState, EndpointStatus, LinkStatus, Snapshot,
};
use crate::printable::printable;

/// How many messages are told of: those that come most often.
const TOP: usize = 10;

const ENDPOINTS: &[&str] = &["ENDPOINT", "STATE", " SINCE", " LINKS", "GROUP", "ADDRESS"];
const LINKS: &[&str] = &[
    "LINK",
    "ENDPOINT",
    "PEER",
    " HEARD",
    " IN/s",
    " IN B/s",
    " OUT/s",
    " OUT B/s",
    " QUEUE",
    " AGE",
    " PACE",
    " LOSS",
    " ROUND TRIP",
    "REFUSED AND DAMAGED",
];
const COMPONENTS: &[&str] = &["COMPONENT", "WHAT", "ARMED", "ON", " HEARD", " FRAMES/s", " LOSS"];
const MESSAGES: &[&str] = &["MESSAGE", "FROM", " FRAMES/s", " B/s", " FRAMES"];

/// What is going on, with rates since `before`; `colour`: for a terminal.
pub fn to_text(before: &Snapshot, snapshot: &Snapshot, colour: bool) -> String {
    let rates = Rates::between(before, snapshot);
    let program = &snapshot.program;
    let up = time(snapshot.time_us / 1_000);
    let mut text = format!("mavswitch {}, process {}, up {up}\n", program.version, program.pid);
    let mut add = |table: String| {
        text.push('\n');
        text.push_str(&table);
    };
    add(endpoints(snapshot, colour));
    add(links(snapshot, rates.as_ref(), colour));
    add(components(snapshot, rates.as_ref(), colour));
    if !snapshot.messages.is_empty() {
        add(messages(snapshot, rates.as_ref(), colour));
    }
    if let Some(record) = &snapshot.record {
        record_text::tables(record, colour).into_iter().for_each(add);
    }
    text
}

fn endpoints(snapshot: &Snapshot, colour: bool) -> String {
    if snapshot.endpoints.is_empty() {
        return "no endpoint (`mavswitch endpoint add` makes one)\n".to_owned();
    }
    let mut table = Columns::new(ENDPOINTS, colour);
    for endpoint in &snapshot.endpoints {
        table.push(vec![
            endpoint.name.clone(),
            state(endpoint.state).to_owned(),
            time(endpoint.since_ago_ms),
            endpoint.links.len().to_string(),
            endpoint.group.clone().unwrap_or_else(|| "-".to_owned()),
            endpoint.address.clone(),
        ]);
    }
    let mut text = table.to_string();
    for EndpointStatus { name, reason, refused_peers, .. } in &snapshot.endpoints {
        if let Some(reason) = reason {
            let _ = writeln!(text, "{}: {}", printable(name), printable(reason));
        }
        if !refused_peers.is_empty() {
            let counts: Vec<String> =
                refused_peers.iter().map(|(reason, count)| format!("{reason} {count}")).collect();
            let _ = writeln!(text, "{}: peers refused: {}", printable(name), counts.join(", "));
        }
    }
    text
}

fn state(state: EndpointState) -> &'static str {
    match state {
        EndpointState::Waiting => "waiting",
        EndpointState::Resolving => "resolving",
        EndpointState::Connecting => "connecting",
        EndpointState::Listening => "listening",
        EndpointState::Up => "up",
        EndpointState::GivenUp => "given up",
        EndpointState::Disabled => "disabled",
    }
}

fn links(snapshot: &Snapshot, rates: Option<&Rates<'_>>, colour: bool) -> String {
    let mut table = Columns::new(LINKS, colour);
    let mut is_empty = true;
    for endpoint in &snapshot.endpoints {
        for link in &endpoint.links {
            let rates = rates.map(|rates| rates.link(link)).unwrap_or_default();
            table.push(link_row(&endpoint.name, link, rates));
            is_empty = false;
        }
    }
    if is_empty { "no link yet\n".to_owned() } else { table.to_string() }
}

fn link_row(endpoint: &str, link: &LinkStatus, (taken, sent): (Rate, Rate)) -> Vec<String> {
    vec![
        format!("#{}", link.id),
        endpoint.to_owned(),
        link.peer.clone(),
        link.heard_ago_ms.map_or_else(|| "never".to_owned(), time),
        number(taken.frames),
        number(taken.bytes),
        number(sent.frames),
        number(sent.bytes),
        bytes(link.queue.bytes as f64),
        time(link.queue.age_ms),
        link.pace.map_or_else(|| "-".to_owned(), |pace| format!("{pace} B/s")),
        link.loss_percent.map_or_else(|| "-".to_owned(), percent),
        round_trip(link),
        trouble(&link.counters),
    ]
}

/// Of late, and the last one.
fn round_trip(link: &LinkStatus) -> String {
    match (link.round_trip_ms, link.last_round_trip_ms) {
        (Some(smoothed), Some(last)) => format!("{smoothed:.1} ({last:.1}) ms"),
        _ => "-".to_owned(),
    }
}

/// What was refused, and what came damaged.
fn trouble(counters: &Counters) -> String {
    let refused = counters.refused.iter().map(|(reason, count)| format!("{reason} {count}"));
    let damaged = [
        ("bad_crc", counters.bad_crc),
        ("unknown_flags", counters.unknown_flags),
        ("garbage_bytes", counters.garbage_bytes),
    ];
    let damaged = damaged.into_iter().filter(|(_, count)| *count > 0);
    let all: Vec<String> =
        refused.chain(damaged.map(|(what, count)| format!("{what} {count}"))).collect();
    if all.is_empty() { "-".to_owned() } else { all.join(", ") }
}

fn components(snapshot: &Snapshot, rates: Option<&Rates<'_>>, colour: bool) -> String {
    if snapshot.components.is_empty() {
        return "no component heard yet: does the autopilot send, at this baud rate, to this \
                port? `mavswitch listen` shows what comes\n"
            .to_owned();
    }
    let mut table = Columns::new(COMPONENTS, colour);
    for component in &snapshot.components {
        let ComponentStatus { system, component: id, vehicle, heard } = component;
        let what = vehicle.as_ref().map(|it| match it.armed {
            ArmedState::None => it.kind.clone(),
            _ => format!("{}, {}, {}", it.kind, it.autopilot, it.state),
        });
        let armed = vehicle.as_ref().map_or("-", |it| match it.armed {
            ArmedState::Armed => "armed",
            ArmedState::Disarmed => "no",
            ArmedState::None => "-",
        });
        let on = heard.iter().map(|it| format!("{} #{}", it.endpoint, it.link));
        let last = heard.iter().map(|it| it.heard_ago_ms).min().unwrap_or_default();
        table.push(vec![
            format!("{system}/{id}"),
            what.unwrap_or_else(|| "no heartbeat".to_owned()),
            armed.to_owned(),
            on.collect::<Vec<_>>().join(", "),
            time(last),
            number(rates.map_or(0.0, |rates| rates.component(*system, *id, heard))),
            loss(component),
        ]);
    }
    table.to_string()
}

/// The part that was lost, by sequence numbers, of the link where it is least.
fn loss(component: &ComponentStatus) -> String {
    let parts = component.heard.iter().filter(|it| it.frames + it.lost > 0);
    let parts = parts.map(|it| it.lost as f64 / (it.frames + it.lost) as f64);
    let least = parts.fold(f64::INFINITY, f64::min);
    if least.is_finite() { percent(least * 100.0) } else { "-".to_owned() }
}

fn messages(snapshot: &Snapshot, rates: Option<&Rates<'_>>, colour: bool) -> String {
    let rate_of = |rates: Option<&Rates<'_>>, it| rates.map(|rates| rates.message(it));
    let mut rows: Vec<_> =
        snapshot.messages.iter().map(|it| (rate_of(rates, it).unwrap_or_default(), it)).collect();
    rows.sort_by(|a, b| b.0.frames.total_cmp(&a.0.frames).then(b.1.frames.cmp(&a.1.frames)));
    let mut table = Columns::new(MESSAGES, colour);
    for (its, message) in rows.iter().take(TOP) {
        table.push(vec![
            message.name.clone().unwrap_or_else(|| message.id.to_string()),
            format!("{}/{}", message.system, message.component),
            number(its.frames),
            number(its.bytes),
            message.frames.to_string(),
        ]);
    }
    let mut text = table.to_string();
    if rows.len() > TOP {
        let _ = writeln!(text, "and {} more (--json has them)", rows.len() - TOP);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::status::{HeardStatus, MessageStatus, Program, Vehicle};

    #[test]
    fn nothing_is_told_as_nothing() {
        let text = to_text(&Snapshot::default(), &Snapshot::default(), false);
        for word in ["no endpoint", "no link yet", "no component heard yet", "`mavswitch listen`"] {
            assert!(text.contains(word), "{text}");
        }
    }

    #[test]
    fn no_name_and_no_reason_commands_a_terminal() {
        let odd = "\x1b[2J\u{9b}\r\n\u{202e}";
        let link = LinkStatus { peer: odd.to_owned(), ..LinkStatus::default() };
        let endpoint = EndpointStatus {
            name: odd.to_owned(),
            reason: Some(odd.to_owned()),
            links: vec![link],
            ..EndpointStatus::default()
        };
        let snapshot = Snapshot { endpoints: vec![endpoint], ..Snapshot::default() };
        let text = to_text(&snapshot, &snapshot, false);
        assert!(text.contains("?[2J????: ?[2J????\n"), "{text:?}");
        assert!(
            !text.contains(|c: char| c.is_control() && c != '\n' || c == '\u{202e}'),
            "{text:?}"
        );
    }

    #[test]
    fn what_is_going_on_stands_in_tables() {
        let counters = Counters {
            frames_in: 50,
            bytes_in: 1_000,
            bad_crc: 3,
            refused: [("queue_full".to_owned(), 7)].into(),
            ..Counters::default()
        };
        let link = LinkStatus {
            peer: "10.0.0.2:14550".into(),
            counters,
            round_trip_ms: Some(12.34),
            last_round_trip_ms: Some(11.0),
            ..Default::default()
        };
        let up = EndpointStatus {
            name: "gcs".into(),
            address: "udpin:0.0.0.0:14550".into(),
            state: EndpointState::Listening,
            links: vec![link],
            ..Default::default()
        };
        let down = EndpointStatus {
            name: "radio".into(),
            reason: Some("cannot open /dev/ttyUSB0: No such file or directory".into()),
            ..Default::default()
        };
        let vehicle = Vehicle {
            kind: "quadrotor".into(),
            autopilot: "ArduPilot".into(),
            armed: ArmedState::Armed,
            state: "active".into(),
        };
        let heard =
            HeardStatus { endpoint: "gcs".into(), frames: 90, lost: 10, ..HeardStatus::default() };
        let component =
            ComponentStatus { system: 1, component: 1, vehicle: Some(vehicle), heard: vec![heard] };
        let message = MessageStatus { name: Some("ATTITUDE".into()), ..Default::default() };
        let snapshot = Snapshot {
            time_us: 2_000_000,
            program: Program { version: "0.1.0".into(), pid: 7 },
            endpoints: vec![up, down],
            components: vec![component],
            messages: vec![message],
            ..Snapshot::default()
        };
        let before = Snapshot { program: snapshot.program.clone(), ..Snapshot::default() };
        let text = to_text(&before, &snapshot, false);
        for words in [
            "mavswitch 0.1.0, process 7, up 2.0s",
            "radio: cannot open /dev/ttyUSB0",
            "10.0.0.2:14550",
            "  25  ",
            "queue_full 7, bad_crc 3",
            "12.3 (11.0) ms",
            "quadrotor, ArduPilot, active",
            "10%",
            "ATTITUDE",
        ] {
            assert!(text.contains(words), "no {words} in\n{text}");
        }
        assert!(!text.contains('\x1b'));
        assert!(to_text(&before, &snapshot, true).contains("\x1b[1m"));
    }
}
