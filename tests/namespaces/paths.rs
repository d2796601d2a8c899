//! A vehicle and a ground station with two paths between them.

use std::net::SocketAddr;
use std::time::Duration;

use crate::harness::*;
use crate::net::{Namespace, Traffic, say};
use crate::relay::Relay;

/// Two computers, and two cables between them.
pub(crate) struct Field {
    pub(crate) air: Namespace,
    pub(crate) ground: Namespace,
}

/// One of the two cables.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Path {
    One,
    Two,
}

/// Which end of a cable.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum End {
    Air,
    Ground,
}

/// What a path does to what goes over it, in each direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Weather {
    pub(crate) loss_percent: u32,
    pub(crate) delay: Duration,
}

impl Path {
    pub(crate) const BOTH: [Self; 2] = [Self::One, Self::Two];

    /// The device at either end, and the name of its endpoint.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::One => "one",
            Self::Two => "two",
        }
    }

    fn number(self) -> u8 {
        match self {
            Self::One => 1,
            Self::Two => 2,
        }
    }

    fn ip(self, end: End) -> String {
        let host = match end {
            End::Air => 1,
            End::Ground => 2,
        };
        format!("10.77.{}.{host}", self.number())
    }

    fn mac(self, end: End) -> String {
        let host = match end {
            End::Air => 1,
            End::Ground => 2,
        };
        format!("02:00:00:00:0{}:0{host}", self.number())
    }
}

impl Field {
    /// A new one; `None`, and a line that says why, if there can be none here.
    pub(crate) fn new() -> Option<Self> {
        let field = Self { air: Namespace::new()?, ground: Namespace::new()? };
        for path in Path::BOTH {
            let (name, elsewhere) = (path.name(), field.ground.path());
            let (here, there) = (path.mac(End::Air), path.mac(End::Ground));
            field.air.ip(&format!(
                "link add {name} address {here} type veth \
                 peer name {name} address {there} netns {elsewhere}"
            ));
            for end in [End::Air, End::Ground] {
                let ip = path.ip(end);
                field.at(end).ip(&format!("address add {ip}/30 dev {name}"));
                field.restore(path, end);
            }
        }
        Some(field)
    }

    /// The computer at one end.
    fn at(&self, end: End) -> &Namespace {
        match end {
            End::Air => &self.air,
            End::Ground => &self.ground,
        }
    }

    /// Cuts a path at one end; the other end sees only that nothing comes any more.
    pub(crate) fn cut(&self, path: Path, end: End) {
        self.at(end).ip(&format!("link set dev {} down", path.name()));
    }

    /// Mends a path that was cut at this end.
    pub(crate) fn restore(&self, path: Path, end: End) {
        let name = path.name();
        let other = if end == End::Air { End::Ground } else { End::Air };
        let (ip, mac) = (path.ip(other), path.mac(other));
        self.at(end).ip(&format!("link set dev {name} up"));
        // As a radio, which is not asked where the other one is: while an address is being asked
        // for, the kernel holds packets back for seconds.
        self.at(end).ip(&format!("neighbour replace {ip} lladdr {mac} dev {name} nud permanent"));
    }

    /// What went over a path so far, as seen at one end.
    pub(crate) fn traffic(&self, path: Path, end: End) -> Traffic {
        self.at(end).traffic(path.name())
    }

    /// Waits until something comes out of a path at both ends.
    pub(crate) fn wait_until_carrying(&self, path: Path) {
        for end in [End::Air, End::Ground] {
            let before = self.traffic(path, end).received;
            eventually(&format!("{path:?} brings something to {end:?}"), || {
                self.traffic(path, end).received > before
            });
        }
    }

    /// Lets it rain on a path, both ways. Where the kernel cannot, a relay does it: what the air
    /// side sends to the address returned goes through the weather to `to`, and back.
    pub(crate) fn rain(&self, path: Path, weather: Weather, to: u16) -> Rain {
        let Weather { loss_percent, delay } = weather;
        let delay_ms = delay.as_millis();
        let netem = format!(
            "qdisc add dev {} root netem loss {loss_percent}% delay {delay_ms}ms",
            path.name()
        );
        let done = self.air.try_run("tc", &netem);
        match done.and_then(|()| self.ground.try_run("tc", &netem)) {
            Ok(()) => Rain { address: self.ground_address(path, to), _relay: None },
            Err(reason) => {
                say(&format!("no netem here, a relay takes its place ({reason})"));
                let relay = self.relay(path, to);
                relay.set_weather(loss_percent, delay);
                Rain { address: relay.address(), _relay: Some(relay) }
            }
        }
    }

    /// A relay at the ground end of a path, to a port of the ground router.
    pub(crate) fn relay(&self, path: Path, to: u16) -> Relay {
        let at = self.ground_address(path, 0).ip();
        let target = SocketAddr::new([127, 0, 0, 1].into(), to);
        self.ground.run(|| Relay::start(at, target))
    }

    /// Where a path leads on the ground.
    pub(crate) fn ground_address(&self, path: Path, port: u16) -> SocketAddr {
        SocketAddr::new(path.ip(End::Ground).parse().expect("an IP address"), port)
    }
}

/// A path in bad weather.
pub(crate) struct Rain {
    /// Where the air side sends to.
    pub(crate) address: SocketAddr,
    _relay: Option<Relay>,
}

/// The two routers, and whoever is behind them.
pub(crate) struct Pair {
    /// Ends with the test.
    _air: Router,
    pub(crate) ground: Router,
    pub(crate) vehicle: Peer<TcpWire>,
    pub(crate) station: Peer<TcpWire>,
}

impl Field {
    /// The ground router: a port for the ground station, and one for each path.
    pub(crate) fn start_ground(&self, options: impl Fn(Path) -> String) -> Router {
        let endpoint = |path: Path| {
            let name = path.name();
            format!("udpin:0.0.0.0:0?name={name}&{}", options(path))
        };
        let (one, two) = (endpoint(Path::One), endpoint(Path::Two));
        self.ground.run(|| Router::start(&["-v", "tcpin:127.0.0.1:0?name=station", &one, &two]))
    }

    /// The rest, once the ground router runs; each path leads to one of these addresses. Returns
    /// when both ends have heard each other.
    pub(crate) fn start_air(
        &self,
        ground: Router,
        addresses: [SocketAddr; 2],
        options: impl Fn(Path) -> String,
    ) -> Pair {
        let endpoint = |path: Path, address: SocketAddr| {
            format!("udpout:{address}?name={}&{}", path.name(), options(path))
        };
        let one = endpoint(Path::One, addresses[0]);
        let two = endpoint(Path::Two, addresses[1]);
        let air = || Router::start(&["-v", "tcpin:127.0.0.1:0?name=autopilot", &one, &two]);
        let air = self.air.run(air);
        let mut vehicle = self.air.run(|| air.tcp("autopilot", VEHICLE));
        let mut station = self.ground.run(|| ground.tcp("station", GCS));
        station.meet(&mut vehicle);
        vehicle.meet(&mut station);
        Pair { _air: air, ground, vehicle, station }
    }
}
