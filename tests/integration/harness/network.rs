//! A second network, at the far end of a cable that a test can cut: for tests that have namespaces
//! of their own.

use std::fs::File;
use std::io;
use std::os::fd::AsFd;
use std::process::{Child, Command, Stdio};
use std::thread;

use rustix::thread::{LinkNameSpaceType, move_into_link_name_space};

use super::again::sh;
use super::process::eventually;

/// Our address at the near end of the cable, on the interface `near`.
pub(crate) const NEAR: &str = "10.99.0.1";
/// The address at the far end.
pub(crate) const FAR: &str = "10.99.0.2";

/// Whoever is at the other end of the cable.
pub(crate) struct FarNetwork {
    /// Holds the other network: ends with us, as its standard input does.
    holder: Child,
}

impl FarNetwork {
    /// What a test that uses this needs.
    pub(crate) const TOOLS: &[&str] = &["nsenter"];

    /// Another network, and a cable to it.
    pub(crate) fn new() -> Self {
        let mut command = Command::new("unshare");
        command.args(["--net", "cat"]).stdin(Stdio::piped()).stdout(Stdio::null());
        let network = Self { holder: command.spawn().expect("another network") };
        let of = |id: &str| std::fs::read_link(format!("/proc/{id}/ns/net")).ok();
        let id = network.holder.id().to_string();
        eventually("the other network is there", || {
            of(&id).is_some_and(|net| Some(net) != of("self"))
        });
        network.plug();
        network
    }

    /// Plugs the cable in.
    pub(crate) fn plug(&self) {
        let id = self.holder.id();
        sh(&format!(
            "ip link add near type veth peer name far netns {id} && \
             ip address add {NEAR}/24 dev near && ip link set near up && \
             ip route add 224.0.0.0/4 dev near && \
             nsenter -t {id} -n sh -c 'ip address add {FAR}/24 dev far && \
             ip link set far up && ip link set lo up'"
        ));
    }

    /// Pulls it out: the interface `near` is gone, and everything that was set up there.
    pub(crate) fn pull(&self) {
        sh("ip link delete near");
    }

    /// Makes something, a socket mostly, that belongs to the other network wherever it is used.
    pub(crate) fn make<T: Send>(&self, make: impl FnOnce() -> T + Send) -> T {
        let network = File::open(format!("/proc/{}/ns/net", self.holder.id()));
        let network = network.expect("the other network");
        // A thread for it alone: this one stays where it is.
        let there = || -> io::Result<T> {
            move_into_link_name_space(network.as_fd(), Some(LinkNameSpaceType::Network))?;
            Ok(make())
        };
        let made = thread::scope(|scope| scope.spawn(there).join());
        made.expect("the other network is reached").expect("leave to go there")
    }
}

impl Drop for FarNetwork {
    fn drop(&mut self) {
        // The network goes some time after its last process: the cable would stay until then.
        let _ = Command::new("ip").args(["link", "delete", "near"]).output();
        let _ = self.holder.kill();
        let _ = self.holder.wait();
    }
}
