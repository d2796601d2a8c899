//! What Prometheus is told of made-up snapshots, and what its own checker says of it.

use std::io::Write as _;
use std::process::{Command, Stdio};

use super::*;
use crate::status::{
    ComponentStatus, Counters, EndpointState, EndpointStatus, HeardStatus, LinkStatus, Program,
};

fn link(id: u16, frames_in: u64) -> LinkStatus {
    let counters = Counters {
        frames_in,
        bytes_in: frames_in * 20,
        refused: [("queue_full".to_owned(), frames_in)].into(),
        ..Counters::default()
    };
    LinkStatus { id, counters, loss_percent: Some(12.5), ..LinkStatus::default() }
}

fn heard(link: u16, frames: u64, lost: u64) -> HeardStatus {
    HeardStatus { endpoint: "fc".to_owned(), link, frames, lost, ..HeardStatus::default() }
}

/// An endpoint `fc` with these links, and 1/1 heard there.
fn snapshot(links: Vec<LinkStatus>, past: u64, heard: Vec<HeardStatus>) -> Snapshot {
    let past = Counters { frames_in: past, ..Counters::default() };
    let fc = EndpointStatus {
        name: "fc".to_owned(),
        state: EndpointState::Up,
        refused_peers: [("outside".to_owned(), 3)].into(),
        links,
        past,
        ..EndpointStatus::default()
    };
    let vehicle = ComponentStatus { system: 1, component: 1, heard, ..ComponentStatus::default() };
    Snapshot {
        time_us: 1_500_000,
        program: Program { version: "0.1.0".to_owned(), pid: 1 },
        endpoints: vec![fc],
        components: vec![vehicle],
        ..Snapshot::default()
    }
}

fn has(text: &str, line: &str) {
    assert!(text.lines().any(|it| it == line), "no line `{line}` in\n{text}");
}

#[test]
fn an_endpoint_is_a_series_and_its_links_are_none() {
    let snapshot = snapshot(vec![link(0, 5), link(1, 7)], 100, vec![heard(0, 5, 2)]);
    let text = Metrics::default().encode(snapshot, MetricsFormat::Plain);
    has(&text, "# TYPE mavswitch_received_frames_total counter");
    has(&text, "mavswitch_received_frames_total{endpoint=\"fc\"} 112");
    has(&text, "mavswitch_received_bytes_total{endpoint=\"fc\"} 240");
    has(&text, "mavswitch_refused_frames_total{endpoint=\"fc\",reason=\"queue_full\"} 12");
    has(&text, "mavswitch_refused_peers_total{endpoint=\"fc\",reason=\"outside\"} 3");
    has(&text, "mavswitch_endpoint_up{endpoint=\"fc\"} 1.0");
    has(&text, "mavswitch_loss_ratio{endpoint=\"fc\"} 0.125");
    has(&text, "mavswitch_uptime_seconds 1.5");
    has(&text, "mavswitch_build_info{version=\"0.1.0\"} 1");
    let labels = "system=\"1\",component=\"1\",endpoint=\"fc\"";
    has(&text, &format!("mavswitch_component_lost_frames_total{{{labels}}} 2"));
    assert!(!text.contains("UNIT") && !text.contains("EOF"), "{text}");
}

#[test]
fn open_metrics_is_what_it_is_where_that_is_asked_for() {
    let accept = "application/openmetrics-text;version=1.0.0,text/plain;version=0.0.4;q=0.5";
    let format = MetricsFormat::accepted(accept);
    assert_eq!(format, MetricsFormat::OpenMetrics);
    assert_eq!(MetricsFormat::accepted("text/html, */*"), MetricsFormat::Plain);
    let text = Metrics::default().encode(snapshot(vec![link(0, 5)], 0, vec![]), format);
    has(&text, "# TYPE mavswitch_received_bytes counter");
    has(&text, "# UNIT mavswitch_received_bytes bytes");
    has(&text, "mavswitch_received_bytes_total{endpoint=\"fc\"} 100");
    assert!(text.ends_with("# EOF\n"), "{text}");
}

#[test]
fn what_a_component_sent_stays_counted_when_its_link_goes() {
    let mut metrics = Metrics::default();
    let mut frames = |heard: Vec<HeardStatus>| -> u64 {
        let text = metrics.encode(snapshot(Vec::new(), 0, heard), MetricsFormat::Plain);
        let line = text.lines().find(|line| line.starts_with("mavswitch_component_frames_total{"));
        line.unwrap().rsplit(' ').next().unwrap().parse().unwrap()
    };
    assert_eq!(frames(vec![heard(0, 5, 0), heard(1, 7, 0)]), 12);
    assert_eq!(frames(vec![heard(1, 8, 0)]), 13);
    // Another link got the number.
    assert_eq!(frames(vec![heard(0, 2, 0), heard(1, 9, 0)]), 16);
    assert_eq!(frames(vec![heard(0, 1, 0), heard(1, 9, 0)]), 17);
    assert_eq!(frames(Vec::new()), 17);
}

#[test]
fn odd_names_break_no_line() {
    let mut snapshot = snapshot(vec![link(0, 1)], 0, vec![]);
    "a\"b\\c\nd".clone_into(&mut snapshot.endpoints[0].name);
    let text = Metrics::default().encode(snapshot, MetricsFormat::Plain);
    has(&text, "mavswitch_received_frames_total{endpoint=\"a\\\"b\\\\c\\nd\"} 1");
}

#[test]
fn components_beyond_the_bound_are_counted_and_no_more() {
    let mut snapshot = snapshot(Vec::new(), 0, Vec::new());
    let component = |number: usize| ComponentStatus {
        system: (number / 250) as u8 + 1,
        component: (number % 250) as u8 + 1,
        heard: vec![heard(0, 1, 0)],
        ..ComponentStatus::default()
    };
    snapshot.components = (0..MAX_COMPONENT_SERIES + 10).map(component).collect();
    let text = Metrics::default().encode(snapshot, MetricsFormat::Plain);
    has(&text, "mavswitch_components_left_out 10");
    let series = text.lines().filter(|it| it.starts_with("mavswitch_component_frames_total{"));
    assert_eq!(series.count(), MAX_COMPONENT_SERIES);
}

/// Debian's package `prometheus` has the checker.
#[test]
fn promtool_finds_nothing_to_complain_of() {
    let mut command = Command::new("promtool");
    command.args(["check", "metrics"]).stdin(Stdio::piped());
    let Ok(mut promtool) = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn() else {
        return println!("skipped: there is no promtool here (package prometheus)");
    };
    let snapshot = snapshot(vec![link(0, 5), link(1, 7)], 100, vec![heard(0, 5, 2)]);
    let text = Metrics::default().encode(snapshot, MetricsFormat::Plain);
    promtool.stdin.take().unwrap().write_all(text.as_bytes()).unwrap();
    let output = promtool.wait_with_output().unwrap();
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8_lossy(&said);
    assert!(output.status.success() && said.is_empty(), "{said}\n{text}");
}
