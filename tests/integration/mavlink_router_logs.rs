//! In the place of mavlink-router: the files that its keys and flags for logs ask for really come.

use std::fs;
use std::net::UdpSocket;
use std::path::{Path, PathBuf};

use rustix::process::Signal;

use super::flight_logs::{
    BLOCK_STATUS, COMMAND_LONG, START_BLOCKS, STOP_BLOCKS, next, next_status, send_block,
    send_ulog, ulog,
};
use super::mavlink_router::Routerd;
use crate::harness::*;

/// MAV_AUTOPILOT_GENERIC and MAV_AUTOPILOT_PX4.
const GENERIC: u8 = 0;
const PX4: u8 = 12;

/// MAV_MODE_FLAG_SAFETY_ARMED.
const ARMED: u8 = 0x80;

fn heartbeat_of(from: Component, autopilot: u8, mode: u8) -> Vec<u8> {
    Draft::new(from, HEARTBEAT, [0, 0, 0, 0, 2, autopilot, mode, 4, 3]).build()
}

/// A program that the router calls.
fn server() -> TcpServer {
    let mut server = TcpServer::down();
    server.up();
    server
}

/// What there is in a directory, the oldest first.
fn files(dir: &Path) -> Vec<PathBuf> {
    let files = fs::read_dir(dir).into_iter().flatten().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = files.collect();
    files.sort();
    files
}

fn extensions(files: &[PathBuf]) -> Vec<&str> {
    files.iter().map(|file| file.extension().unwrap().to_str().unwrap()).collect()
}

/// Nobody has been asked for a log by now.
fn assert_not_asked(peer: &mut Peer<TcpWire>, other: &mut Peer<TcpWire>) {
    // Whoever is asked for something is asked in the turn after the one that gave rise to it.
    let frames = [peer.receive_rest_from(other), peer.receive_rest_from(other)].concat();
    let is_asked = |frame: &&Vec<u8>| {
        let id = u32::from_le_bytes([frame[7], frame[8], frame[9], 0]);
        frame[0] == 0xfd && [BLOCK_STATUS, COMMAND_LONG].contains(&id)
    };
    assert_eq!(frames.iter().find(is_asked), None);
}

/// System 2 alone is asked, while it is armed, in the way of ArduPilot whatever it says that it is; and
/// of its logs the last two are kept.
#[test]
fn the_log_keys_of_a_file_say_whose_log_is_taken_when_and_how_many_are_kept() {
    let routerd = Routerd::new();
    let (one, two) = (server(), server());
    let logs = routerd.dir.path("logs");
    let endpoint = |name: &str, server: &TcpServer| {
        format!("[TcpEndpoint {name}]\nAddress = 127.0.0.1\nPort = {}\n", server.address().port())
    };
    let general = format!(
        "[General]\nTcpServerPort = 0\nLog = {}\nLogMode = while-armed\nLogSystemId = 2\n\
         MavlinkDialect = ardupilotmega\nMaxLogFiles = 2\n",
        logs.display()
    );
    let text = general + &endpoint("one", &one) + &endpoint("two", &two);
    let file = routerd.dir.write("main.conf", &text);
    let router = routerd.start(&["-c", file.to_str().unwrap()]);
    let (mut first, mut second) = (one.accept(VEHICLE), two.accept(OTHER));
    first.send(heartbeat_of(VEHICLE, PX4, ARMED));
    second.send(heartbeat_of(OTHER, GENERIC, 0));
    router.wait_until_seen(VEHICLE);
    router.wait_until_seen(OTHER);
    assert_not_asked(&mut first, &mut second);
    assert_not_asked(&mut second, &mut first);
    for blocks in 1..=3 {
        second.send(heartbeat_of(OTHER, GENERIC, ARMED));
        let logger = loop {
            let (logger, status) = next(&mut second, BLOCK_STATUS);
            if status[..4] == START_BLOCKS.to_le_bytes() {
                break logger;
            }
        };
        assert_eq!(logger, Component::new(2, 155));
        for number in 0..blocks {
            send_block(&mut second, logger, number);
            while next_status(&mut second) != (number, true) {}
        }
        second.send(heartbeat_of(OTHER, GENERIC, 0));
        while next_status(&mut second).0 != STOP_BLOCKS {}
    }
    assert_not_asked(&mut first, &mut second);
    router.signal(Signal::TERM);
    assert!(router.wait_for_end().0.success());
    let files = files(&logs);
    assert_eq!(extensions(&files), ["bin", "bin"], "no telemetry was asked for: {files:?}");
    for (file, blocks) in files.iter().zip([2, 3]) {
        let sent: Vec<u8> = (1..=blocks).flat_map(|byte| [byte; 200]).collect();
        assert!(fs::read(file).unwrap() == sent, "{}", file.display());
    }
}

#[test]
fn the_log_flags_of_the_command_line_bring_a_ulog_and_a_telemetry_log() {
    let routerd = Routerd::new();
    let (one, two) = (server(), server());
    let calls = [&one, &two].map(|server| server.address().to_string());
    let logs = routerd.dir.path("logs");
    let flags = ["-t", "0", "-l", logs.to_str().unwrap(), "-T", "-p", &calls[0], "-p", &calls[1]];
    let router = routerd.start(&flags);
    let (mut px4, mut station) = (one.accept(VEHICLE), two.accept(GCS));
    station.send(heartbeat(GCS));
    router.wait_until_seen(GCS);
    // Always, if nothing else is said: armed or not.
    px4.send(heartbeat_of(VEHICLE, PX4, 0));
    let (logger, command) = next(&mut px4, COMMAND_LONG);
    assert_eq!((logger, command[30]), (Component::new(1, 155), 1));
    send_ulog(&mut px4, logger, &ulog());
    station.send(command_long(GCS, VEHICLE));
    while next(&mut px4, COMMAND_LONG).0 != GCS {}
    router.signal(Signal::TERM);
    assert!(router.wait_for_end().0.success());
    let files = files(&logs);
    let mut kinds = extensions(&files);
    kinds.sort_unstable();
    assert_eq!(kinds, ["tlog", "ulg"], "{files:?}");
    for file in &files {
        let bytes = fs::read(file).unwrap();
        if file.extension().unwrap() == "ulg" {
            assert!(bytes == ulog(), "the ULog is not as it was sent");
        } else {
            let order = command_long(GCS, VEHICLE);
            assert!(bytes.windows(order.len()).any(|it| it == order), "the command is not there");
        }
    }
}

/// A directory for logs is no reason for a file that nobody has written anything to.
#[test]
fn where_there_is_no_traffic_there_is_no_file() {
    let routerd = Routerd::new();
    let logs = routerd.dir.path("logs");
    let port = FreePort::new();
    let router = routerd.start(&["-t", "0", "-l", logs.to_str().unwrap(), "-T", &port.here()]);
    // Strangers and noise are no traffic either.
    let noise = UdpSocket::bind("127.0.0.1:0").unwrap();
    noise.send_to(&[0xfd, 9, 0, 0, 1, 2, 3], port.here()).unwrap();
    router.signal(Signal::TERM);
    assert!(router.wait_for_end().0.success());
    assert_eq!(files(&logs), [] as [PathBuf; 0]);
}
