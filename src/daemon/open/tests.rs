//! What is left of a socket that could not be opened to the end.

use std::fs::File;
use std::os::fd::OwnedFd;

use super::*;
use crate::config::General;
use crate::daemon::stage::daemon;

#[test]
fn a_socket_that_cannot_be_watched_leaves_no_link() {
    let mut daemon = daemon(General::default(), vec!["udpin:127.0.0.1:0".parse().unwrap()]);
    let index = daemon.io.endpoints.ids()[0];
    let remote: SocketAddr = "127.0.0.1:9".parse().unwrap();
    // The system watches no such file.
    let file = OwnedFd::from(File::open("/dev/null").unwrap());
    let socket = UdpSocket::from_std(std::net::UdpSocket::from(file));
    let failed = daemon.open_datagrams(
        index,
        (socket, None),
        || "send".into(),
        |daemon| Ok(Role::Sender { link: daemon.add_sender_link(index, remote, remote)?, remote }),
    );
    assert_eq!(failed.unwrap_err().error.raw_os_error(), Some(libc::EPERM));
    assert!(daemon.links_of(index).is_empty());
}
