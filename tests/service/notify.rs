//! Every message to the service manager, from the real program: which, when, and when not.

use std::fs;
use std::net::{TcpListener, TcpStream};
use std::thread;
use std::time::{Duration, Instant};

use rustix::process::Signal;

use crate::harness::*;
use crate::manager::Manager;

const TCP: &str = "tcpin:127.0.0.1:0?name=tcp";
const UDP: &str = "udpin:127.0.0.1:0?name=udp";

#[test]
fn ready_is_said_once_everything_is_open() {
    let manager = Manager::at_a_path();
    let pty = Pty::new();
    let absent = TempDir::new().path("absent");
    let router = manager.launch(&[
        &format!("serial:{}:57600?name=fc", pty.device()),
        UDP,
        &format!("serial:{}:57600?name=radio", absent.display()),
        TCP,
    ]);
    let status = "1 link (fc 1), 0 components; waiting for radio";
    assert_eq!(manager.hear(), format!("READY=1\nSTATUS={status}"));
    let connected = TcpStream::connect(router.address("tcp"));
    connected.expect("a port that is open as soon as it is said to be");
}

#[test]
fn a_service_that_cannot_start_never_says_that_it_is_ready() {
    let manager = Manager::new();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let in_use = format!("tcpin:{}", listener.local_addr().unwrap());
    let (status, _) = manager.launch(&[UDP, &in_use]).wait_for_end();
    assert_eq!(status.code(), Some(1));
    manager.assert_heard_all();
}

#[test]
fn the_status_tells_of_links_and_components() {
    let manager = Manager::new();
    let router = manager.launch(&[TCP, UDP]);
    assert_eq!(manager.hear(), "READY=1\nSTATUS=0 links, 0 components");
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let _camera = router.tcp("tcp", CAMERA);
    let _gcs = router.udp("udp", GCS);
    // It is told in a turn that happens anyway: so let there be some.
    let end = router.log.clone();
    let feeder = thread::spawn(move || {
        while !end.has(&["stopping"]) {
            vehicle.send(heartbeat(VEHICLE));
            thread::sleep(Duration::from_millis(50));
        }
    });
    let mut told = Vec::new();
    let full = "STATUS=3 links (tcp 2, udp 1), 3 components (1/1, 1/100, 255/190)";
    while told.last().is_none_or(|(_, text)| text != full) {
        told.push((Instant::now(), manager.hear()));
        assert!(told.len() < 5, "{told:?}");
    }
    router.signal(Signal::TERM);
    assert_eq!(manager.hear(), "STOPPING=1", "no status without a change");
    feeder.join().unwrap();
    let (status, log) = router.wait_for_end();
    assert_eq!(status.code(), Some(0), "{log}");
}

#[test]
fn a_reload_is_told_from_its_beginning_to_its_end_whatever_comes_of_it() {
    let dir = TempDir::new();
    let text = "[endpoint.tcp]\naddress = \"tcpin:127.0.0.1:0\"\n";
    let file = dir.write("mavswitch.toml", text);
    let manager = Manager::new();
    let router = manager.launch(&["-c", file.to_str().unwrap()]);
    let ready = manager.hear();
    assert_eq!(ready, "READY=1\nSTATUS=0 links, 0 components");
    for text in [text, "wrong", &format!("strict = true\n{text}")] {
        fs::write(&file, text).unwrap();
        router.signal(Signal::HUP);
        let message = manager.hear();
        let time = message.strip_prefix("RELOADING=1\nMONOTONIC_USEC=").expect(&message);
        assert!(time.parse::<u64>().is_ok_and(|time| time > 0), "{message}");
        assert_eq!(manager.hear(), ready);
    }
}

#[test]
fn the_watchdog_is_fed_before_its_time_is_over() {
    let period = Duration::from_secs(4);
    let manager = Manager::new();
    let router = manager.launch_watched(period, &[TCP]);
    assert!(manager.hear().starts_with("READY=1\n"));
    let start = Instant::now();
    for _ in 0..3 {
        let last = Instant::now();
        assert_eq!(manager.hear(), "WATCHDOG=1");
        assert!(last.elapsed() < period, "{:?}", last.elapsed());
    }
    assert!(start.elapsed() > period, "twice in its time, and not more often");
    router.signal(Signal::TERM);
    while manager.hear() != "STOPPING=1" {}
    router.wait_for_end();
}

#[test]
fn a_watchdog_for_another_process_is_left_alone() {
    let manager = Manager::new();
    let router = manager.launch_in(&[TCP], |command| {
        command.env("WATCHDOG_USEC", "20000").env("WATCHDOG_PID", "1");
    });
    assert!(manager.hear().starts_with("READY=1\n"));
    let _vehicle = router.tcp("tcp", VEHICLE);
    router.signal(Signal::TERM);
    assert_eq!(manager.hear(), "STOPPING=1");
    router.wait_for_end();
    manager.assert_heard_all();
}

#[test]
fn stopping_is_said_while_queues_still_drain() {
    let manager = Manager::new();
    let router = manager.launch(&[TCP]);
    manager.hear();
    router.signal(Signal::INT);
    assert_eq!(manager.hear(), "STOPPING=1");
    let (status, log) = router.wait_for_end();
    assert_eq!(status.code(), Some(0), "{log}");
    manager.assert_heard_all();
}

#[test]
fn a_manager_that_does_not_listen_does_no_harm() {
    let manager = Manager::new();
    let router = manager.launch_watched(Duration::from_millis(20), &[TCP, UDP]);
    manager.hear();
    drop(manager);
    let line = router.log.wait_for(&["WARN", "cannot speak to the service manager"]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut gcs = router.udp("udp", GCS);
    router.assert_serves(&mut gcs, &mut vehicle);
    let lines = router.log.lines();
    let warnings = lines.iter().filter(|line| line.contains("service manager"));
    assert_eq!(warnings.collect::<Vec<_>>(), [&line], "once is enough");
}

#[test]
fn without_a_manager_nothing_is_opened() {
    let alone = Router::start(&[TCP]);
    let watched = Router::launch_in(&[TCP], |command| {
        command.env("WATCHDOG_USEC", "20000");
    });
    watched.log.wait_for(&["ready"]);
    let manager = Manager::new();
    let managed = manager.launch(&[TCP]);
    manager.hear();
    let count = alone.process().descriptors();
    assert_eq!(watched.process().descriptors(), count);
    assert_eq!(managed.process().descriptors(), count + 1);
}

#[test]
fn an_idle_service_without_a_watchdog_sleeps() {
    let manager = Manager::new();
    let router = manager.launch(&[TCP]);
    manager.hear();
    router.log.wait_for(&["ready"]);
    // It may still be on its way into its sleep; one that wakes once a second never gets there.
    eventually("it sleeps on", || {
        let before = sleeps(&router);
        thread::sleep(Duration::from_millis(2_500));
        sleeps(&router) == before
    });
}

/// How often the program went to sleep.
fn sleeps(router: &Router) -> u64 {
    let status = fs::read_to_string(format!("/proc/{}/status", router.process().0)).unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("voluntary_ctxt_switches:"));
    line.unwrap().trim().parse().unwrap()
}
