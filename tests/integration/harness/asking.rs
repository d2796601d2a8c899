//! What a running router tells of itself, to a program, at its control socket and by HTTP.

use std::net::SocketAddr;
use std::process::Output;

use mavswitch::control::Client;
use mavswitch::status::{EndpointStatus, Snapshot};

use super::router::{Router, first_word, run};

impl Router {
    /// Somebody at its control socket.
    #[track_caller]
    pub(crate) fn client(&self) -> Client {
        Client::connect(Some(&self.control())).expect("a daemon that answers")
    }

    /// What it tells of itself now.
    #[track_caller]
    pub(crate) fn status(&self) -> Snapshot {
        self.client().status().expect("an answer")
    }

    /// What it tells of one endpoint now.
    #[track_caller]
    pub(crate) fn endpoint(&self, name: &str) -> EndpointStatus {
        let mut endpoints = self.status().endpoints.into_iter();
        endpoints.find(|endpoint| endpoint.name == name).expect("an endpoint of this name")
    }

    /// `mavswitch COMMAND...`, asking this router.
    pub(crate) fn ask(&self, command: &[&str]) -> Output {
        let control = self.control();
        run(&[command, &["--control", control.to_str().expect("a path")]].concat())
    }

    /// The same, and what is then said on standard output.
    pub(crate) fn told(&self, command: &[&str]) -> String {
        String::from_utf8(self.ask(command).stdout).expect("text")
    }

    /// Where it tells of itself by HTTP.
    pub(crate) fn metrics(&self) -> SocketAddr {
        const SAID: &str = "metrics and status page at http://";
        let line = self.log.wait_for(&[SAID]);
        first_word(line.split_once(SAID).expect("the text waited for").1)
    }
}
