//! What the log tells of faults: a line when something goes, a line when it comes, and what matters
//! is never left out.

use std::fs;
use std::os::unix::fs::symlink;

use crate::harness::*;

const TCP: &str = "tcpin:127.0.0.1:0?name=tcp";

/// The lines about an endpoint, from the line number `from` on.
fn lines_about(router: &Router, endpoint: &str, from: usize) -> Vec<String> {
    let word = format!("{endpoint}: ");
    let lines = router.log.lines();
    lines[from..].iter().filter(|line| line.contains(&word)).cloned().collect()
}

#[test]
fn a_port_that_goes_and_comes_back_is_told_in_a_line_each() {
    let dir = TempDir::new();
    let device = dir.path("device");
    let mut pty = Pty::new();
    symlink(&pty.path, &device).unwrap();
    let router = Router::start(&[&format!("serial:{}:57600?name=fc", device.display()), TCP]);
    let mut gcs = router.tcp("tcp", GCS);
    for _ in 0..3 {
        let mut vehicle = Peer::new(pty.wire, VEHICLE);
        router.assert_serves(&mut gcs, &mut vehicle);
        let from = router.log.len();
        fs::remove_file(&device).unwrap();
        drop(vehicle);
        router.log.wait_from(from, &["fc: link #", " down: ", "waiting for it"]);
        // It is looked for in vain a few times.
        std::thread::sleep(std::time::Duration::from_millis(1_000));
        pty = Pty::new();
        symlink(&pty.path, &device).unwrap();
        router.log.wait_from(from, &["fc: link #", " up: ", "57600"]);
        assert_eq!(lines_about(&router, "fc", from).len(), 2, "{}", router.log.text());
    }
}

#[test]
fn a_server_that_goes_and_comes_back_is_told_in_a_line_each() {
    let mut server = TcpServer::down();
    server.up();
    let router = Router::start(&[&format!("tcpout:{}?name=out", server.address()), TCP]);
    let mut gcs = router.tcp("tcp", GCS);
    for _ in 0..3 {
        let mut vehicle = server.accept(VEHICLE);
        router.assert_serves(&mut gcs, &mut vehicle);
        let from = router.log.len();
        server.go_down();
        drop(vehicle);
        router.log.wait_from(from, &["out: link #", " down: ", "waiting for it"]);
        std::thread::sleep(std::time::Duration::from_millis(1_000));
        server.up();
        router.log.wait_from(from, &["out: link #", " up: "]);
        assert_eq!(lines_about(&router, "out", from).len(), 2, "{}", router.log.text());
    }
}

#[test]
fn of_a_server_that_comes_and_goes_all_the_time_the_last_word_is_told() {
    let mut server = TcpServer::down();
    server.up();
    let router = Router::start(&[&format!("tcpout:{}?name=out", server.address()), TCP]);
    let mut gcs = router.tcp("tcp", GCS);
    for _ in 0..16 {
        let mut vehicle = server.accept(VEHICLE);
        router.assert_serves(&mut gcs, &mut vehicle);
    }
    let mut vehicle = server.accept(VEHICLE);
    router.assert_serves(&mut gcs, &mut vehicle);
    router.log.wait_for(&["out: link #", " up: ", "left out"]);
    let lines = lines_about(&router, "out", 0);
    assert!(lines.len() < 33, "nothing was left out");
    assert!(lines.last().is_some_and(|line| line.contains(" up: ")), "{}", lines.join("\n"));
}

#[test]
fn callers_who_come_and_go_all_the_time_do_not_hide_that_another_was_refused() {
    let router = Router::start(&["tcpin:127.0.0.1:0?name=few&max_peers=1", TCP]);
    let mut gcs = router.tcp("tcp", GCS);
    for _ in 0..30 {
        let mut caller = router.tcp_unnoticed("few", OTHER);
        router.assert_serves(&mut gcs, &mut caller);
    }
    let mut stays = router.tcp_unnoticed("few", VEHICLE);
    router.assert_serves(&mut gcs, &mut stays);
    let _one_too_many = router.tcp_unnoticed("few", CAMERA);
    router.log.wait_for(&["few: ", "refused", "max_peers"]);
}
