//! The component in a loop of its own: when it is there, and that it costs nothing when it is not.

use super::*;
use crate::config::{General, OwnOptions};
use crate::daemon::stage;

fn daemon(system: Option<u8>, endpoint: &str) -> Daemon {
    let own = OwnOptions { system, ..OwnOptions::default() };
    let general = General { own, ..General::default() };
    let mut daemon = stage::daemon(general, vec![endpoint.parse().unwrap()]);
    daemon.open_all().unwrap();
    daemon.refresh_own();
    daemon
}

/// Whether there is a component, and whether a timer is set for it.
fn presence(daemon: &Daemon) -> (bool, bool) {
    (daemon.own.at_work.is_some(), daemon.own.deadline.is_some())
}

#[test]
fn it_is_there_while_there_is_something_for_it_to_do() {
    assert_eq!(presence(&daemon(None, "udpout:127.0.0.1:9")), (false, false));
    assert_eq!(presence(&daemon(Some(1), "udpout:127.0.0.1:9")), (true, true));
    let mut asking = daemon(None, "udpout:127.0.0.1:9?request_streams=4");
    assert_eq!(presence(&asking), (true, true));
    asking.change_all(Vec::new());
    assert!(!presence(&asking).0 && asking.io.endpoints.ids().is_empty());
    // The timer that is still set finds nothing to do, and sets no other.
    asking.now = asking.now + SECOND;
    asking.handle_own_deadline();
    assert_eq!(presence(&asking), (false, false));
}

#[test]
fn its_heartbeat_is_kept_away_from_an_endpoint_as_long_as_there_is_one() {
    let mut daemon = daemon(Some(7), "udpout:127.0.0.1:9?own_component=false");
    let index = daemon.io.endpoints.ids()[0];
    let link = daemon.links_of(index)[0];
    let kept_away =
        |daemon: &Daemon| daemon.router.port(link).unwrap().options().filter_out.block_single;
    assert_eq!(kept_away(&daemon), Some((MessageId::HEARTBEAT, Component::new(7, 191))));
    daemon.general.own.system = None;
    daemon.refresh_own();
    assert_eq!(kept_away(&daemon), None);
}

#[test]
fn a_second_lasts_a_second_however_late_the_loop_is() {
    let mut daemon = daemon(Some(7), "udpout:127.0.0.1:9");
    let start = daemon.own.deadline.unwrap();
    for (late_ms, next_ms) in [(0, 1_000), (1_300, 2_000), (2_000, 3_000), (60_000, 61_000)] {
        daemon.now = start + Duration::from_millis(late_ms);
        daemon.handle_own_deadline();
        assert_eq!(daemon.own.deadline, Some(start + Duration::from_millis(next_ms)));
    }
}
