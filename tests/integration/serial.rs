//! Serial ports, by pseudo terminals: absent, there, gone and back again.

use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::Command;
use std::thread;
use std::time::Duration;

use crate::harness::*;
use crate::program::assert_refused;

const TCP: &str = "tcpin:127.0.0.1:0?name=tcp";

/// A path that is to lead from one terminal to the next, as those below /dev/serial/by-id do.
struct Device {
    dir: TempDir,
}

impl Device {
    fn absent() -> Self {
        Self { dir: TempDir::new() }
    }

    fn endpoint(&self) -> String {
        format!("serial:{}:921600?name=fc", self.dir.path("device").display())
    }

    fn plug(&self, pty: &Pty) {
        symlink(&pty.path, self.dir.path("device")).unwrap();
    }

    fn unplug(&self) {
        fs::remove_file(self.dir.path("device")).unwrap();
    }
}

#[test]
fn frames_of_every_shape_go_unchanged_both_ways_through_a_serial_port() {
    let pty = Pty::new();
    let router = Router::start(&[&format!("serial:{}:921600?name=fc", pty.device()), TCP]);
    let line = router.log.wait_for(&["fc: link #"]);
    assert!(line.contains("921600"), "no baud in {line:?}");
    let mut vehicle = router.serial("fc", pty, VEHICLE);
    let mut gcs = router.tcp("tcp", GCS);
    vehicle.send(every_shape(VEHICLE).concat());
    gcs.expect_each(&every_shape(VEHICLE));
    gcs.send(every_shape(GCS).concat());
    vehicle.expect_each(&every_shape(GCS));
    gcs.expect_nothing_from(&mut vehicle);
    vehicle.expect_nothing_from(&mut gcs);
}

#[test]
fn every_byte_value_passes_a_serial_port_as_it_is() {
    let pty = Pty::new();
    let router = Router::start(&[&format!("serial:{}:921600?name=fc", pty.device()), TCP]);
    let mut vehicle = router.serial("fc", pty, VEHICLE);
    let mut gcs = router.tcp("tcp", GCS);
    let all: Vec<u8> = (0..=254).rev().collect();
    let there = Draft::new(VEHICLE, ENCAPSULATED_DATA, all.clone()).untrimmed().build();
    vehicle.send(&there);
    gcs.expect(&there);
    let back = Draft::new(GCS, ENCAPSULATED_DATA, all).untrimmed().build();
    gcs.send(&back);
    vehicle.expect(&back);
}

#[test]
fn frames_cut_into_single_bytes_arrive_from_a_serial_port() {
    let pty = Pty::new();
    let router = Router::start(&[&format!("serial:{}:921600?name=fc", pty.device()), TCP]);
    let mut vehicle = router.serial("fc", pty, VEHICLE);
    let mut gcs = router.tcp("tcp", GCS);
    for frame in [heartbeat(VEHICLE), attitude(VEHICLE, 1), bulk(VEHICLE, 2)] {
        // A long silence within a frame may end it: on a machine that pauses here, once more.
        for attempt in 1.. {
            vehicle.send_bytewise(&frame);
            if gcs.receive_rest_from(&mut vehicle) == [frame.clone()] {
                break;
            }
            assert!(attempt < 10, "it never arrives");
        }
    }
}

#[test]
fn a_serial_stream_begun_within_a_frame_gives_all_whole_frames_and_no_garbage() {
    let pty = Pty::new();
    let router = Router::start(&[&format!("serial:{}:921600?name=fc", pty.device()), TCP]);
    let mut vehicle = router.serial("fc", pty, VEHICLE);
    let mut gcs = router.tcp("tcp", GCS);
    let frames: Vec<_> = (0..12).map(|n| ftp_full_of_start_bytes(VEHICLE, GCS, n)).collect();
    let stream = frames.concat();
    for offset in (1..=300).step_by(7) {
        vehicle.send(&stream[offset..]);
        gcs.expect_each(&frames[offset.div_ceil(frames[0].len())..]);
    }
}

#[test]
fn a_serial_port_that_hangs_up_is_awaited_quietly_and_works_again() {
    let device = Device::absent();
    let first = Pty::new();
    device.plug(&first);
    let router = Router::start(&[&device.endpoint(), TCP]);
    let mut vehicle = router.serial("fc", first, VEHICLE);
    let mut gcs = router.tcp("tcp", GCS);
    router.assert_serves(&mut gcs, &mut vehicle);
    for round in 0..3 {
        let before = router.log.len();
        device.unplug();
        drop(vehicle);
        router.log.wait_from(before, &["fc: link #", " down: "]);
        if round == 0 {
            assert_rests(&router);
        }
        let mut other = Peer::new(router.tcp_unnoticed("tcp", OTHER).wire, OTHER);
        router.assert_serves(&mut gcs, &mut other);
        let next = Pty::new();
        device.plug(&next);
        router.log.wait_from(before, &["fc: link #", " up"]);
        vehicle = Peer::new(next.wire, VEHICLE);
        router.assert_serves(&mut gcs, &mut vehicle);
        gcs.send(command_long(GCS, VEHICLE));
        vehicle.expect(command_long(GCS, VEHICLE));
    }
}

/// While it waits for a device, the router must not be busy: 5 % of the time at most.
fn assert_rests(router: &Router) {
    let before = router.process().processor_time();
    let wait = Duration::from_secs(2);
    thread::sleep(wait);
    let used = router.process().processor_time() - before;
    assert!(used <= wait / 20, "{used:?} of processor time in {wait:?} of waiting");
}

#[test]
fn a_serial_port_that_is_absent_at_start_is_awaited_and_others_work_meanwhile() {
    let device = Device::absent();
    let router = Router::launch(&[&device.endpoint(), TCP]);
    router.log.wait_for(&["fc: ", "waiting"]);
    let mut gcs = router.tcp("tcp", GCS);
    let mut other = router.tcp("tcp", OTHER);
    router.assert_serves(&mut gcs, &mut other);
    let pty = Pty::new();
    device.plug(&pty);
    let mut vehicle = router.serial("fc", pty, VEHICLE);
    router.assert_serves(&mut gcs, &mut vehicle);
}

#[test]
fn a_serial_port_without_permission_is_refused_with_the_remedy() {
    let pty = Pty::new();
    let endpoint = format!("serial:{}:57600?name=fc", pty.device());
    fs::set_permissions(&pty.path, fs::Permissions::from_mode(0o0)).unwrap();
    // The superuser needs no permission, so the router must be somebody else.
    let nobody = rustix::process::geteuid().is_root().then_some(65534);
    if nobody.is_some() && !is_open_to_all(Path::new(PROGRAM)) {
        println!("skipped: nobody else can run {PROGRAM}");
        return;
    }
    let router = Router::launch_as(nobody, &[&endpoint, TCP]);
    let (status, text) = router.wait_for_end();
    assert_eq!(status.code(), Some(1), "{text}");
    let line = text.lines().find(|line| line.starts_with("mavswitch: "));
    let line = line.expect("a line that says why");
    for word in ["fc", pty.device(), "dialout"] {
        assert!(line.contains(word), "no {word:?} in {line:?}");
    }
}

/// Whether every directory on the way to `path` lets everybody pass.
fn is_open_to_all(path: &Path) -> bool {
    let passable = |dir: &Path| fs::metadata(dir).is_ok_and(|it| it.permissions().mode() & 1 == 1);
    path.ancestors().skip(1).all(passable)
}

#[test]
fn a_second_opener_is_refused_and_leaves_the_port_to_the_first() {
    let pty = Pty::new();
    let (fc, device) = (format!("serial:{}:57600?name=fc", pty.device()), pty.path.clone());
    let router = Router::start(&[&fc, TCP]);
    let mut vehicle = router.serial("fc", pty, VEHICLE);
    let mut gcs = router.tcp("tcp", GCS);
    assert_refused(&run(&[&fc, TCP]), &["fc", device.to_str().unwrap(), "busy"]);
    router.assert_serves(&mut gcs, &mut vehicle);
    if !rustix::process::geteuid().is_root() {
        return;
    }
    // Nor may anybody open it who asks for no lock; only the superuser always may.
    fs::set_permissions(&device, fs::Permissions::from_mode(0o666)).unwrap();
    let mut command = Command::new("sh");
    command.args(["-c", "exec 3<>\"$0\""]).arg(&device).uid(65534);
    assert!(!command.output().unwrap().status.success(), "the port is open to others");
}

#[test]
fn a_serial_port_that_is_no_terminal_is_refused() {
    let dir = TempDir::new();
    let file = dir.write("device", "not a terminal");
    let path = file.to_str().unwrap();
    assert_refused(&run(&[&format!("serial:{path}:57600?name=fc"), TCP]), &["fc", path]);
}

#[test]
fn ten_thousand_frames_in_one_burst_arrive_from_a_serial_port() {
    let pty = Pty::new();
    let serial = format!("serial:{}:921600?name=fc", pty.device());
    let router = Router::start(&[TCP, &serial]);
    let mut gcs = router.tcp("tcp", GCS);
    let mut vehicle = router.serial("fc", pty, VEHICLE);
    gcs.meet(&mut vehicle);
    let frames: Vec<_> = (0..10_000).map(|n| bulk(VEHICLE, n)).collect();
    thread::scope(|scope| {
        // More than the terminal's buffer holds: it is full again and again.
        scope.spawn(|| vehicle.send(frames.concat()));
        gcs.expect_each(&frames);
    });
    gcs.expect_nothing_from(&mut vehicle);
}
