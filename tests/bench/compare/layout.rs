//! The endpoints that a scenario asks for, in the words of each router.

use std::net::SocketAddr;

/// What a router is to open.
#[derive(Default)]
pub(crate) struct Layout {
    /// It listens here for datagrams.
    pub(crate) udp_server: Option<SocketAddr>,
    /// It sends datagrams there.
    pub(crate) udp_client: Option<SocketAddr>,
    /// It listens here for connections.
    pub(crate) tcp_server: Option<SocketAddr>,
    /// It opens this device, with so many baud.
    pub(crate) serial: Option<(String, u32)>,
    /// Each frame is for one of the TCP clients. A router sees by itself for which.
    pub(crate) in_turn: bool,
}

impl Layout {
    /// As mavswitch reads it.
    pub(crate) fn endpoints(&self) -> String {
        let mut words = Vec::new();
        words.extend(self.udp_server.map(|at| format!("'udpin:{at}?max_peers=1000'")));
        words.extend(self.udp_client.map(|at| format!("udpout:{at}")));
        words.extend(self.tcp_server.map(|at| format!("'tcpin:{at}?max_peers=1000'")));
        words.extend(self.serial.iter().map(|(path, baud)| format!("serial:{path}:{baud}")));
        words.join(" ")
    }

    /// As mavp2p reads it.
    pub(crate) fn mavp2p(&self) -> String {
        let mut words = Vec::new();
        words.extend(self.udp_server.map(|at| format!("udps:{at}")));
        words.extend(self.udp_client.map(|at| format!("udpc:{at}")));
        words.extend(self.tcp_server.map(|at| format!("tcps:{at}")));
        words.extend(self.serial.iter().map(|(path, baud)| format!("serial:{path}:{baud}")));
        words.join(" ")
    }

    /// As mavlink-router reads it, in a file.
    pub(crate) fn conf(&self) -> String {
        let tcp_port = self.tcp_server.map_or(0, |at| at.port());
        let mut text = format!("[General]\nTcpServerPort={tcp_port}\nReportStats=false\n");
        let udp = |name, mode, at: SocketAddr| {
            let (ip, port) = (at.ip(), at.port());
            format!("[UdpEndpoint {name}]\nMode={mode}\nAddress={ip}\nPort={port}\n")
        };
        text.extend(self.udp_server.map(|at| udp("server", "Server", at)));
        text.extend(self.udp_client.map(|at| udp("client", "Normal", at)));
        text.extend(
            self.serial
                .iter()
                .map(|(path, baud)| format!("[UartEndpoint line]\nDevice={path}\nBaud={baud}\n")),
        );
        text
    }

    /// As the forwarders read it.
    pub(crate) fn blind(&self) -> String {
        let mut words = Vec::new();
        words.extend(self.udp_server.map(|at| format!("--udp-server {at}")));
        words.extend(self.udp_client.map(|at| format!("--udp-client {at}")));
        words.extend(self.tcp_server.map(|at| format!("--tcp-server {at}")));
        words.extend(self.serial.iter().map(|(path, _)| format!("--serial {path}")));
        words.extend(self.in_turn.then(|| "--in-turn".to_owned()));
        words.join(" ")
    }
}
