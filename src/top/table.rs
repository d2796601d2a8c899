//! What each view shows: a table made of the newest snapshot and of how its figures went.

use std::cmp::Ordering;

use super::app::{App, Key};
use super::trace::Trace;
use crate::printable::printable;
use crate::status::units::{bytes, number, percent, time};
use crate::status::{
    ArmedState, ComponentStatus, EndpointState, EndpointStatus, LinkStatus, MessageStatus,
};

/// What there is to look at.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum View {
    Links,
    Components,
    Messages,
}

/// A column: its title and width, and whether it is a figure.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    pub(super) title: &'static str,
    pub(super) width: u16,
    pub(super) is_figure: bool,
}

/// How a row stands out.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Tone {
    Plain,
    Dim,
    Warn,
    Bad,
}

/// One cell: what it says, and where it belongs when rows are sorted by it.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Cell {
    pub(super) text: String,
    order: Order,
}

#[derive(Clone, PartialEq, Debug)]
enum Order {
    Figure(f64),
    Text,
}

/// A row.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Row {
    pub(super) cells: Vec<Cell>,
    /// How its frames went, if that is known.
    pub(super) trace: Option<Trace>,
    pub(super) tone: Tone,
}

const fn text(title: &'static str, width: u16) -> Column {
    Column { title, width, is_figure: false }
}

const fn figure(title: &'static str, width: u16) -> Column {
    Column { title, width, is_figure: true }
}

impl View {
    /// All of them, in the order of their keys.
    pub(super) const ALL: [Self; 3] = [Self::Links, Self::Components, Self::Messages];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Links => "Links",
            Self::Components => "Components",
            Self::Messages => "Messages",
        }
    }

    /// Its columns; those of text get what room is left over. The round trip, which is the last one
    /// of links, is left out where it is not measured.
    pub(super) fn columns(self, has_round_trips: bool) -> &'static [Column] {
        const LINKS: [Column; 10] = [
            text("ENDPOINT", 10),
            text("LINK", 16),
            figure("IN/s", 5),
            figure("OUT/s", 5),
            figure("B/s IN", 7),
            figure("B/s OUT", 7),
            figure("QUEUE", 9),
            figure("LOSS", 5),
            figure("REF/s", 5),
            figure("RTT ms", 6),
        ];
        const COMPONENTS: [Column; 7] = [
            text("ID", 7),
            text("TYPE", 12),
            text("AUTOPILOT", 10),
            text("STATE", 17),
            figure("FRAMES/s", 8),
            figure("LOSS", 5),
            text("HEARD", 14),
        ];
        const MESSAGES: [Column; 6] = [
            text("FROM", 7),
            figure("ID", 6),
            text("MESSAGE", 26),
            figure("RATE/s", 7),
            figure("B/s", 8),
            figure("FRAMES", 9),
        ];
        match self {
            Self::Links if has_round_trips => &LINKS,
            Self::Links => &LINKS[..LINKS.len() - 1],
            Self::Components => &COMPONENTS,
            Self::Messages => &MESSAGES,
        }
    }

    /// The column by which it is sorted at first; `None`: as configured, or as heard.
    pub(super) fn first_sort(self) -> Option<usize> {
        match self {
            Self::Links | Self::Components => None,
            Self::Messages => Some(3),
        }
    }
}

/// The rows of a view, filtered and sorted.
pub(super) fn rows(app: &App) -> Vec<Row> {
    let Some(snapshot) = app.snapshot() else { return Vec::new() };
    let mut rows: Vec<Row> = match app.view {
        View::Links => snapshot.endpoints.iter().flat_map(|it| endpoint(app, it)).collect(),
        View::Components => snapshot.components.iter().map(|it| component(app, it)).collect(),
        View::Messages => snapshot.messages.iter().map(|it| message(app, it)).collect(),
    };
    let wanted = app.filter.to_lowercase();
    rows.retain(|row| row.cells.iter().any(|cell| cell.text.to_lowercase().contains(&wanted)));
    if let Some(column) = app.sort {
        rows.sort_by(|a, b| compare(&a.cells[column], &b.cells[column]));
        // Figures are wanted from the largest on.
        if app.view.columns(true)[column].is_figure != app.is_reversed {
            rows.reverse();
        }
    } else if app.is_reversed {
        rows.reverse();
    }
    rows
}

fn compare(a: &Cell, b: &Cell) -> Ordering {
    match (&a.order, &b.order) {
        (Order::Figure(a), Order::Figure(b)) => a.total_cmp(b),
        _ => a.text.cmp(&b.text),
    }
}

fn words(text: impl Into<String>) -> Cell {
    // What a name or an answer of the network has that would move the cursor is shown as it is not.
    let text: String = text.into();
    Cell { text: printable(&text), order: Order::Text }
}

fn value(value: f64, text: String) -> Cell {
    Cell { text, order: Order::Figure(value) }
}

/// The links of an endpoint, or itself if it has none.
fn endpoint(app: &App, endpoint: &EndpointStatus) -> Vec<Row> {
    if !endpoint.links.is_empty() {
        return endpoint.links.iter().map(|it| link(app, endpoint, it)).collect();
    }
    let (state, tone) = match endpoint.state {
        EndpointState::Waiting => ("waiting", Tone::Warn),
        EndpointState::Resolving => ("resolving", Tone::Warn),
        EndpointState::Connecting => ("connecting", Tone::Warn),
        EndpointState::Listening => ("listening", Tone::Dim),
        EndpointState::Up => ("up", Tone::Dim),
        EndpointState::GivenUp => ("given up", Tone::Bad),
        EndpointState::Disabled => ("disabled", Tone::Dim),
    };
    let mut cells = vec![words(endpoint.name.as_str()), words(state)];
    cells.extend((2..View::Links.columns(true).len()).map(|_| value(-1.0, String::new())));
    vec![Row { cells, trace: None, tone }]
}

fn link(app: &App, endpoint: &EndpointStatus, link: &LinkStatus) -> Row {
    let key = |what| Key::Link(endpoint.name.clone(), link.id, what);
    let (frames_in, frames_out) = (app.trace(&key(0)), app.trace(&key(1)));
    let rates = [2, 3, 4].map(|what| app.trace(&key(what)).rate());
    let queue = &link.queue;
    let share = 100.0 * queue.bytes as f64 / queue.limit.max(1) as f64;
    let waits = match queue.bytes {
        0 => String::new(),
        _ => format!("{share:.0}% {}", time(queue.age_ms)),
    };
    let loss = link.loss_percent;
    let tone = match (loss.unwrap_or_default(), share) {
        (loss, share) if loss >= 5.0 || share >= 90.0 => Tone::Bad,
        (_, share) if share >= 60.0 || rates[2] > 0.0 => Tone::Warn,
        _ => Tone::Plain,
    };
    let figure = |rate: f64| value(rate, number(rate));
    let cells = vec![
        words(endpoint.name.as_str()),
        words(format!("#{} {}", link.id, link.peer)),
        figure(frames_in.rate()),
        figure(frames_out.rate()),
        value(rates[0], bytes(rates[0])),
        value(rates[1], bytes(rates[1])),
        value(share, waits),
        value(loss.unwrap_or(-1.0), loss.map(percent).unwrap_or_default()),
        figure(rates[2]),
        value(link.round_trip_ms.unwrap_or(-1.0), round_trip(link)),
    ];
    let mut trace = frames_in;
    if trace.rate() < frames_out.rate() {
        trace = frames_out;
    }
    Row { cells, trace: Some(trace), tone }
}

/// Of late; a second and more without a fraction.
fn round_trip(link: &LinkStatus) -> String {
    match link.round_trip_ms {
        None => "-".to_owned(),
        Some(ms) if ms < 1_000.0 => format!("{ms:.1}"),
        Some(ms) => format!("{ms:.0}"),
    }
}

fn component(app: &App, it: &ComponentStatus) -> Row {
    let trace = app.trace(&Key::Component(it.system, it.component, 0));
    let lost = app.trace(&Key::Component(it.system, it.component, 1)).rate();
    let loss = 100.0 * lost / (lost + trace.rate()).max(f64::MIN_POSITIVE);
    let silence = it.heard.iter().map(|heard| heard.heard_ago_ms).min();
    let vehicle = it.vehicle.clone().unwrap_or_default();
    let state = match (&it.vehicle, vehicle.armed) {
        (None, _) => String::new(),
        (_, ArmedState::Armed) => format!("ARMED {}", vehicle.state),
        (_, ArmedState::Disarmed) => format!("disarmed {}", vehicle.state),
        (_, ArmedState::None) => vehicle.state,
    };
    let places = it.heard.iter().map(|heard| format!("{} #{}", heard.endpoint, heard.link));
    let places = places.collect::<Vec<_>>().join(", ");
    let heard = match silence {
        Some(silence) if silence > 3_000 => format!("{} ago, {places}", time(silence)),
        _ => places,
    };
    let tone = match silence {
        _ if loss >= 5.0 => Tone::Bad,
        Some(..=10_000) => Tone::Plain,
        _ => Tone::Dim,
    };
    let cells = vec![
        words(format!("{}/{}", it.system, it.component)),
        words(vehicle.kind),
        words(vehicle.autopilot),
        words(state),
        value(trace.rate(), number(trace.rate())),
        value(loss, percent(loss)),
        words(heard),
    ];
    Row { cells, trace: Some(trace), tone }
}

fn message(app: &App, it: &MessageStatus) -> Row {
    let trace = app.trace(&Key::Message(it.system, it.component, it.id, 0));
    let octets = app.trace(&Key::Message(it.system, it.component, it.id, 1)).rate();
    let name = it.name.clone().unwrap_or_else(|| "(unknown)".to_owned());
    let cells = vec![
        words(format!("{}/{}", it.system, it.component)),
        value(f64::from(it.id), it.id.to_string()),
        words(name),
        value(trace.rate(), number(trace.rate())),
        value(octets, bytes(octets)),
        value(it.frames as f64, it.frames.to_string()),
    ];
    Row { cells, trace: Some(trace), tone: Tone::Plain }
}
