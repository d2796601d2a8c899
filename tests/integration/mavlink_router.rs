//! In the place of mavlink-router: called by its name, with its command line and its files; and the
//! same after an import.

use std::fs;
use std::net::{TcpListener, UdpSocket};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::harness::*;

/// The program by the other name, far from what this computer has in /etc.
pub(super) struct Routerd {
    pub(super) dir: TempDir,
}

impl Routerd {
    pub(super) fn new() -> Self {
        let dir = TempDir::new();
        symlink(PROGRAM, dir.path("mavlink-routerd")).unwrap();
        Self { dir }
    }

    fn command(&self) -> Command {
        let mut command = Command::new(self.dir.path("mavlink-routerd"));
        command.env("MAVLINK_ROUTERD_CONF_FILE", self.dir.path("absent.conf"));
        command.env("MAVLINK_ROUTERD_CONF_DIR", self.dir.path("absent.d"));
        command
    }

    pub(super) fn start(&self, arguments: &[&str]) -> Router {
        Router::start_command(self.command(), arguments)
    }

    fn run(&self, arguments: &[&str]) -> Output {
        run_command(self.command(), arguments)
    }
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Programs that the router calls: whoever they are, the router knows them by these names.
struct Called {
    fc: TcpServer,
    thin: TcpServer,
    radio: TcpServer,
    lte: TcpServer,
}

impl Called {
    fn new() -> Self {
        let up = || {
            let mut server = TcpServer::down();
            server.up();
            server
        };
        Self { fc: up(), thin: up(), radio: up(), lte: up() }
    }

    /// A configuration of mavlink-router with filters and a group.
    fn configuration(&self) -> String {
        let endpoint = |name: &str, server: &TcpServer, keys: &str| {
            let port = server.address().port();
            format!("[TcpEndpoint {name}]\nAddress = 127.0.0.1\nPort = {port}\n{keys}\n")
        };
        let thin = "allowmsgidout = 0, 76\nBlockSrcCompOut = 100\n";
        let endpoints = [
            endpoint("fc", &self.fc, ""),
            endpoint("thin", &self.thin, thin),
            endpoint("radio", &self.radio, "Group = ground\n"),
            endpoint("lte", &self.lte, "Group = ground\nBlockSrcSysIn = 254"),
        ];
        let general = "[General]\nTcpServerPort = 0\nDeduplicationPeriod = 0\n\n";
        // The last line has no end.
        format!("{general}{}", endpoints.concat()).trim_end().to_owned()
    }

    /// Filters and groups do what they say, whoever reads the configuration.
    fn assert_routed(&self, router: &Router) {
        const LTE: Component = Component::new(253, 190);
        let mut vehicle = self.fc.accept(VEHICLE);
        let mut thin = self.thin.accept(WITNESS);
        let mut gcs = self.radio.accept(GCS);
        let mut lte = self.lte.accept(LTE);
        vehicle.send_mark();
        thin.send_mark();
        gcs.send_mark();
        lte.send_mark();
        for component in [VEHICLE, WITNESS, GCS, LTE] {
            router.wait_until_seen(component);
        }
        // Telemetry goes to both ways of the group, but not through the thin link.
        vehicle.send(attitude(VEHICLE, 1));
        gcs.expect(attitude(VEHICLE, 1));
        lte.expect(attitude(VEHICLE, 1));
        thin.expect_nothing_from(&mut vehicle);
        vehicle.send(heartbeat(CAMERA));
        thin.expect_nothing_from(&mut vehicle);
        vehicle.send(heartbeat(VEHICLE));
        thin.expect(heartbeat(VEHICLE));
        // Nothing is forwarded within the group.
        gcs.expect_each(&[heartbeat(CAMERA), heartbeat(VEHICLE)]);
        lte.expect_each(&[heartbeat(CAMERA), heartbeat(VEHICLE)]);
        gcs.send(attitude(GCS, 2));
        vehicle.expect(attitude(GCS, 2));
        lte.expect_nothing_from(&mut vehicle);
        // What is kept out is kept out.
        lte.send(heartbeat(GCS_2));
        vehicle.expect_nothing_from(&mut lte);
        // A command finds its way, and no other.
        gcs.send(command_long(GCS, VEHICLE));
        vehicle.expect(command_long(GCS, VEHICLE));
        thin.expect_nothing_from(&mut gcs);
    }
}

#[test]
fn filters_and_groups_hold_by_either_name() {
    let routerd = Routerd::new();
    let called = Called::new();
    let file = routerd.dir.write("main.conf", &called.configuration());
    called.assert_routed(&routerd.start(&["-c", text(&file)]));
    let imported = run(&["import", text(&file)]);
    assert_eq!(imported.status.code(), Some(0), "{}", stderr(&imported));
    let toml = String::from_utf8_lossy(&imported.stdout).into_owned();
    let toml = routerd.dir.write("mavswitch.toml", &toml);
    assert_eq!(run(&["check", text(&toml)]).status.code(), Some(0));
    called.assert_routed(&Router::start(&["-c", text(&toml)]));
}

#[test]
fn the_command_line_of_mavlink_router_joins_a_server_and_those_it_sends_to() {
    let routerd = Routerd::new();
    let station = UdpSocket::bind("127.0.0.1:0").unwrap();
    let mut sim = TcpServer::down();
    sim.up();
    let (to, call) = (station.local_addr().unwrap().to_string(), sim.address().to_string());
    let port = FreePort::new();
    let server = port.here();
    let router = routerd.start(&["-t", "0", "-e", &to, "-p", &call, &server, "-v"]);
    let mut vehicle = router.udp(&format!("udpin:{server}"), VEHICLE);
    let mut simulator = sim.accept(OTHER);
    simulator.meet(&mut vehicle);
    let mut buffer = [0; 300];
    station.set_read_timeout(Some(PATIENCE)).unwrap();
    let (len, from) = station.recv_from(&mut buffer).unwrap();
    assert_eq!(
        (source_of(&buffer[..len]), from.ip()),
        (VEHICLE, station.local_addr().unwrap().ip())
    );
    // The server serves everybody who speaks to it.
    let mut second = router.udp(&format!("udpin:{server}"), GCS);
    router.assert_serves(&mut vehicle, &mut second);
    router.assert_serves(&mut vehicle, &mut simulator);
}

#[test]
fn files_are_found_by_the_environment() {
    let routerd = Routerd::new();
    let port = FreePort::new();
    let server = "[UdpEndpoint gcs]\nMode = Server\nAddress = 127.0.0.1\nPort = 14550\n";
    routerd.dir.write("absent.conf", &format!("[General]\nTcpServerPort = 0\n{server}"));
    fs::create_dir(routerd.dir.path("absent.d")).unwrap();
    let other = format!("[UdpEndpoint gcs]\nPort = {}", port.number());
    routerd.dir.write("absent.d/10.conf", &other);
    let router = routerd.start(&[]);
    assert_eq!(router.address("gcs").to_string(), port.here());
}

#[test]
fn files_are_read_again_on_sighup_and_wrong_ones_change_nothing() {
    let routerd = Routerd::new();
    let (a, b) = (FreePort::new(), FreePort::new());
    let endpoint = |name: &str, port: &FreePort, mode: &str| {
        let port = port.number();
        format!("[UdpEndpoint {name}]\nMode = {mode}\nAddress = 127.0.0.1\nPort = {port}\n")
    };
    let first = format!("[General]\nTcpServerPort = 0\n{}", endpoint("a", &a, "Server"));
    let file = routerd.dir.write("main.conf", &first);
    let router = routerd.start(&["-c", text(&file)]);
    let mut vehicle = router.udp("a", VEHICLE);
    fs::write(&file, first.clone() + &endpoint("b", &b, "Srver")).unwrap();
    router.signal(rustix::process::Signal::HUP);
    router.log.wait_for(&["main.conf:8:8: bad value `Srver` for `Mode`"]);
    fs::write(&file, first + &endpoint("b", &b, "Server")).unwrap();
    router.signal(rustix::process::Signal::HUP);
    let mut gcs = router.udp("b", GCS);
    router.assert_serves(&mut gcs, &mut vehicle);
}

#[test]
fn what_is_not_there_yet_is_told_once() {
    let routerd = Routerd::new();
    let flags = ["-t0", "-r", "-y", "-c", "/nonexistent/main.conf"];
    let port = FreePort::new();
    let router = routerd.start(&[&flags[..], &[&port.here()]].concat());
    let log = router.log.text();
    for told in ["-r: no statistics", "-y: the log", "main.conf"] {
        assert_eq!(log.matches(told).count(), 1, "{told} in\n{log}");
    }
}

#[test]
fn a_wrong_file_is_told_with_its_line_and_nothing_is_started() {
    let routerd = Routerd::new();
    let wrong = "[UdpEndpoint gcs]\nMode = Normal\nAddress = 127.0.0.1\nPrt = 14550";
    let file = routerd.dir.write("main.conf", wrong);
    let told =
        format!("{}:4:1: unknown key `Prt` in UdpEndpoint: did you mean `Port`?", text(&file));
    for output in [routerd.run(&["-c", text(&file)]), run(&["import", text(&file)])] {
        assert_eq!(output.status.code(), Some(2));
        assert_eq!(stderr(&output).trim_end(), format!("mavswitch: {told}"));
    }
    let output = routerd.run(&["-t", "0"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("nothing to join"), "{}", stderr(&output));
}

#[test]
fn a_directory_is_imported_as_mavlink_router_reads_it() {
    let dir = TempDir::new();
    let main = "[General]\nTcpServerPort=0\n[UdpEndpoint a]\nMode=normal\nAddress=10.0.0.2\n";
    dir.write("main.conf", main);
    fs::create_dir(dir.path("config.d")).unwrap();
    dir.write(
        "config.d/10",
        "[UdpEndpoint a]\nPort=14560\n[General]\nReportStats=1\nLog=/var/log\n",
    );
    let root: PathBuf = dir.path("");
    let output = run(&["import", text(&root)]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let toml = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(toml.contains("[endpoint.a]\naddress = \"udpout:10.0.0.2:14560\""), "{toml}");
    let note = format!("{}:4:13: `ReportStats` = 1: no statistics", text(&dir.path("config.d/10")));
    assert!(toml.contains("record = \"/var/log\"") && toml.contains("flight_log = \"auto\""));
    assert!(toml.contains(&note) && stderr(&output).contains(&note), "{toml}");
}

#[test]
fn a_tcp_port_that_is_taken_stops_only_who_asked_for_it() {
    let routerd = Routerd::new();
    let (usual, port) = (FreePort::of(5760), FreePort::new());
    // If another program has it already, so much the better.
    let _taken = TcpListener::bind(("0.0.0.0", usual.number()));
    let router = routerd.start(&[&port.here()]);
    router.log.wait_for(&["another program listens on TCP port 5760", "-t 0"]);
    assert!(!router.log.text().contains("tcp-server"));
    let other = TcpListener::bind("127.0.0.1:0").unwrap();
    let taken = other.local_addr().unwrap().port().to_string();
    let output = routerd.run(&[&port.here(), "-t", &taken]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("another program is there"), "{}", stderr(&output));
}
