//! What is seen of made-up snapshots, on screens of all sizes, after keys were pressed.

use std::collections::BTreeMap;

use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::super::app::Next;
use super::*;
use crate::status::{
    ArmedState, ComponentStatus, Counters, EndpointState, EndpointStatus, HeardStatus, LinkStatus,
    MessageStatus, Program, QueueStatus, Snapshot, Vehicle,
};

/// A flight controller that sends 100 frames a second, a radio that cannot keep up, and a camera that
/// is not there, after so many seconds.
fn snapshot(seconds: u64) -> Snapshot {
    let counters = |frames_in: u64, frames_out: u64, refused: u64| Counters {
        frames_in: frames_in * seconds,
        bytes_in: frames_in * seconds * 40,
        frames_out: frames_out * seconds,
        bytes_out: frames_out * seconds * 40,
        refused: BTreeMap::from([("queue_full".to_owned(), refused * seconds)]),
        ..Counters::default()
    };
    let fc = LinkStatus {
        id: 0,
        peer: "/dev/ttyACM0".to_owned(),
        counters: counters(100, 5, 0),
        ..LinkStatus::default()
    };
    let radio = LinkStatus {
        id: 1,
        peer: "/dev/ttyUSB0".to_owned(),
        counters: counters(5, 60, 40),
        queue: QueueStatus { bytes: 900, limit: 1_440, age_ms: 190 },
        loss_percent: Some(2.5),
        ..LinkStatus::default()
    };
    let endpoint = |name: &str, state, links| EndpointStatus {
        name: name.to_owned(),
        state,
        links,
        ..EndpointStatus::default()
    };
    let heard = HeardStatus {
        endpoint: "fc".to_owned(),
        frames: 100 * seconds,
        is_route: true,
        ..HeardStatus::default()
    };
    let vehicle = Vehicle {
        kind: "quadrotor".to_owned(),
        autopilot: "ArduPilot".to_owned(),
        armed: ArmedState::Armed,
        state: "active".to_owned(),
    };
    let message = |id, name: &str, rate: u64| MessageStatus {
        system: 1,
        component: 1,
        id,
        name: (!name.is_empty()).then(|| name.to_owned()),
        frames: rate * seconds,
        bytes: rate * seconds * 40,
    };
    Snapshot {
        time_us: seconds * 1_000_000,
        program: Program { version: "0.1.0".to_owned(), pid: 7 },
        endpoints: vec![
            endpoint("fc", EndpointState::Up, vec![fc]),
            endpoint("radio", EndpointState::Up, vec![radio]),
            endpoint("camera\u{1b}[2J", EndpointState::Waiting, Vec::new()),
        ],
        components: vec![ComponentStatus {
            system: 1,
            component: 1,
            vehicle: Some(vehicle),
            heard: vec![heard],
        }],
        messages: vec![
            message(0, "HEARTBEAT", 1),
            message(30, "ATTITUDE", 50),
            message(9_999, "", 9),
        ],
        ..Snapshot::default()
    }
}

fn running() -> App {
    let mut app = App::new(true);
    (10..20).for_each(|seconds| app.handle_snapshot(snapshot(seconds)));
    app
}

fn press(app: &mut App, keys: &str) {
    for key in keys.chars() {
        let code = match key {
            '\n' => KeyCode::Enter,
            '\t' => KeyCode::Tab,
            '\u{1b}' => KeyCode::Esc,
            letter => KeyCode::Char(letter),
        };
        assert_eq!(app.handle_key(KeyEvent::new(code, KeyModifiers::NONE)), Next::GoOn);
    }
}

fn screen(app: &App, width: u16, height: u16) -> Vec<String> {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    terminal.draw(|frame| draw(app, frame)).unwrap();
    let buffer = terminal.backend().buffer();
    let lines = buffer.content.chunks(usize::from(width));
    lines.map(|line| line.iter().map(ratatui::buffer::Cell::symbol).collect::<String>()).collect()
}

/// The line that begins with `start`, its words one blank apart.
fn line(app: &App, start: &str) -> String {
    let lines = screen(app, 80, 24);
    let line = lines.iter().find(|line| line.starts_with(start));
    let line = line.unwrap_or_else(|| panic!("no {start} in\n{}", lines.join("\n")));
    line.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn links_are_shown_with_their_rates_on_the_smallest_terminal() {
    let app = running();
    assert_eq!(line(&app, "fc"), "fc #0 /dev/ttyACM0 100 5.0 4.0 kB 200 B 0");
    let radio = line(&app, "radio");
    assert_eq!(radio, "radio #1 /dev/ttyUSB0 5.0 60 200 B 2.4 kB 62% 190ms 2.5% 40");
    assert_eq!(line(&app, "camera"), "camera?[2J waiting");
    assert!(line(&app, "mavswitch").ends_with("0.1.0 up 19s 2 links 1 component LIVE"));
    assert!(line(&app, "▼ in").starts_with("▼ in 105 frames/s 4.2 kB/s █"));
    assert!(screen(&app, 80, 24)[23].starts_with(KEYS));
}

#[test]
fn the_round_trip_has_a_column_where_it_is_measured() {
    let mut app = running();
    assert!(!screen(&app, 80, 24)[4].contains("RTT"));
    let mut measured = snapshot(20);
    measured.endpoints[0].links[0].round_trip_ms = Some(12.34);
    app.handle_snapshot(measured);
    assert!(screen(&app, 80, 24)[4].contains("RTT ms"));
    assert!(line(&app, "fc").ends_with(" 12.3"));
    assert!(line(&app, "radio").ends_with(" -"));
    // Sorted by a column that goes away.
    press(&mut app, "ssssssssss");
    app.handle_snapshot(snapshot(21));
    assert!(line(&app, "fc").ends_with(" 0"));
}

#[test]
fn a_wide_terminal_has_curves() {
    let lines = screen(&running(), 120, 24);
    assert!(lines[4].contains("LAST MINUTE"), "{}", lines[4]);
    assert!(lines[5].trim_end().ends_with("█████████"), "{}", lines[5]);
}

#[test]
fn keys_show_the_other_views() {
    let mut app = running();
    press(&mut app, "\t");
    let vehicle = line(&app, "1/1");
    assert_eq!(vehicle, "1/1 quadrotor ArduPilot ARMED active 100 0.0% fc #0");
    press(&mut app, "3");
    let lines = screen(&app, 80, 24);
    let place = |name: &str| lines.iter().position(|line| line.contains(name)).unwrap();
    assert!(place("ATTITUDE") < place("(unknown)") && place("(unknown)") < place("HEARTBEAT"));
    press(&mut app, "r");
    let lines = screen(&app, 80, 24);
    let place = |name: &str| lines.iter().position(|line| line.contains(name)).unwrap();
    assert!(place("ATTITUDE") > place("HEARTBEAT"));
}

#[test]
fn rows_are_sorted_and_filtered() {
    let mut app = running();
    let first = |app: &App| screen(app, 80, 24)[5].split(' ').next().unwrap().to_owned();
    assert_eq!(first(&app), "fc");
    press(&mut app, "s");
    assert_eq!(first(&app), "camera?[2J");
    press(&mut app, "sss");
    assert_eq!(first(&app), "radio", "by frames out");
    press(&mut app, "/ACM\n");
    assert_eq!(first(&app), "fc");
    assert!(!screen(&app, 80, 24).concat().contains("ttyUSB0"));
    press(&mut app, "/zzz");
    assert!(screen(&app, 80, 24).concat().contains("nothing has that"));
    press(&mut app, "\u{1b}");
    assert_eq!(first(&app), "radio");
}

#[test]
fn a_pause_holds_the_figures_and_a_daemon_that_is_gone_is_told_of() {
    let mut app = running();
    press(&mut app, " ");
    app.handle_snapshot(snapshot(1_000));
    assert!(line(&app, "mavswitch").ends_with("up 19s 2 links 1 component PAUSED"));
    press(&mut app, " ");
    app.handle_trouble("no mavswitch answers:\n  /run/x".to_owned());
    assert!(line(&app, "mavswitch").ends_with("RECONNECTING"));
    assert_eq!(screen(&app, 80, 24)[23].trim_end(), "no mavswitch answers:");
    // Another daemon counts from nothing.
    let mut other = snapshot(2);
    other.program.pid = 8;
    app.handle_snapshot(other);
    assert_eq!(line(&app, "fc"), "fc #0 /dev/ttyACM0 0 0 0 B 0 B 0");
}

#[test]
fn help_covers_the_table_until_a_key_is_pressed() {
    let mut app = running();
    press(&mut app, "?");
    assert!(screen(&app, 80, 24).concat().contains("pause, and go on"));
    press(&mut app, "x");
    assert!(!screen(&app, 80, 24).concat().contains("pause, and go on"));
}

#[test]
fn q_and_control_c_end_it() {
    let mut app = running();
    let quit = app.handle_key(KeyEvent::new(KeyCode::Char('q'), KeyModifiers::NONE));
    assert_eq!(quit, Next::Quit);
    let quit = app.handle_key(KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL));
    assert_eq!(quit, Next::Quit);
}

#[test]
fn every_size_is_drawn_in_every_state() {
    let mut app = App::new(false);
    for keys in ["", "?", "x2", "/a", "\n3", "\u{1b}1"] {
        press(&mut app, keys);
        for (width, height) in [(1, 1), (29, 6), (30, 7), (40, 50), (80, 24), (300, 9), (500, 100)]
        {
            let lines = screen(&app, width, height);
            assert_eq!(lines.len(), usize::from(height));
        }
        app.handle_snapshot(snapshot(10));
    }
}

#[test]
fn without_colour_nothing_has_one() {
    let mut app = App::new(false);
    app.handle_snapshot(snapshot(10));
    let mut terminal = Terminal::new(TestBackend::new(120, 24)).unwrap();
    terminal.draw(|frame| draw(&app, frame)).unwrap();
    let cells = &terminal.backend().buffer().content;
    assert!(cells.iter().all(|cell| cell.fg == Color::Reset && cell.bg == Color::Reset));
}

#[test]
fn what_is_recorded_has_a_line_of_its_own_where_there_is_a_recorder() {
    let record = RecordStatus {
        state: RecordState::Failing,
        error: Some("No space left on device".to_owned()),
        frames: 152,
        lost: 1_234_567,
        ..RecordStatus::default()
    };
    let mut app = running();
    assert!(!screen(&app, 80, 24).iter().any(|line| line.starts_with('●')));
    app.handle_snapshot(Snapshot { record: Some(record), ..snapshot(21) });
    let told = "● failing 152 frames 1.2M lost No space left on device; tried again each";
    assert!(line(&app, "●").starts_with(told), "{}", line(&app, "●"));
    assert_eq!(line(&app, "camera"), "camera?[2J waiting");
    for height in LEAST.1..12 {
        screen(&app, LEAST.0, height);
    }
}
