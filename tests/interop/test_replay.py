"""A recorded flight is replayed through the router: every frame of it arrives, in order, unaltered.

The log is not part of the repository. It lies beside the checkout, or where MAVSWITCH_TLOG says.
"""

import os
import socket
from bisect import bisect_right
from itertools import accumulate
from pathlib import Path

import pytest
from conftest import ROOT
from peers import mavlink2
from pymavlink.dialects.v20 import ardupilotmega

TLOG = Path(os.environ.get("MAVSWITCH_TLOG", ROOT.parent / "shared/data/flight.tlog"))

# How many frames may be on their way: less than a UDP socket holds, or the router's queues.
WINDOW = 64

# Each record of a log: the time in microseconds, then a frame.
TIMESTAMP = 8


class Listener:
    """Hears a socket, and compares what arrives with what is owed to it."""

    def __init__(self, name, kind, port):
        self.name = name
        self.socket = socket.socket(socket.AF_INET, kind)
        self.socket.connect(("127.0.0.1", port))
        self.socket.setblocking(False)
        # What is owed, in one piece, and where each frame of it ends.
        self.owed = b""
        self.ends = []
        self.received = 0

    def owe(self, frames):
        self.owed = b"".join(frames)
        self.ends = list(accumulate(map(len, frames)))

    @property
    def heard(self):
        """How many whole frames have arrived."""
        return bisect_right(self.ends, self.received)

    def fileno(self):
        return self.socket.fileno()

    def take(self):
        """Reads what has arrived; a datagram has to be one whole frame."""
        while True:
            try:
                data = self.socket.recv(65536)
            except BlockingIOError:
                return
            assert data, f"{self.name}: closed after {self.heard} frames"
            end = self.received + len(data)
            assert data == self.owed[self.received : end], f"{self}: then came {data.hex()}"
            if self.socket.type == socket.SOCK_DGRAM:
                assert end == self.ends[self.heard], f"{self}: then came not one frame, but {data}"
            self.received = end

    def __str__(self):
        return f"{self.name} heard {self.heard} of {len(self.ends)} frames"


def read_frames(log):
    """The frames of a log."""
    found, at = [], 0
    while at < len(log):
        start = at + TIMESTAMP
        marker, payload, flags = log[start : start + 3]
        if marker == mavlink2.PROTOCOL_MARKER_V1:
            end = start + payload + 8
        else:
            signature = 13 if flags & mavlink2.MAVLINK_IFLAG_SIGNED else 0
            end = start + payload + 12 + signature
        found.append(log[start:end])
        at = end
    return found


def sources_and_targets(flight):
    """Who speaks in a flight, and whom they address."""
    decoder = ardupilotmega.MAVLink(None)
    messages = [decoder.decode(bytearray(frame)) for frame in flight]
    sources = {(message.get_srcSystem(), message.get_srcComponent()) for message in messages}
    targets = {getattr(m, "target_system", getattr(m, "target", 0)) for m in messages}
    return sources, targets - {0}


@pytest.fixture(scope="module")
def flight():
    if not TLOG.is_file():
        pytest.skip(f"no recorded flight at {TLOG} (set MAVSWITCH_TLOG)")
    return read_frames(TLOG.read_bytes())


def announcement(system):
    """The heartbeat of a listener, as a frame."""
    kind, autopilot = mavlink2.MAV_TYPE_GCS, mavlink2.MAV_AUTOPILOT_INVALID
    heartbeat = mavlink2.MAVLink_heartbeat_message(kind, autopilot, 0, 0, 0, 3)
    return heartbeat.pack(mavlink2.MAVLink(None, system, 190))


@pytest.mark.parametrize("player_at", ["udpin", "tcpin"])
def test_every_frame_arrives_at_a_udp_and_a_tcp_listener(stage, flight, player_at):
    sources, targets = sources_and_targets(flight)
    # The listeners are none of those who speak in the log, or they would be spared its frames.
    assert not {(254, 190), (253, 190)} & sources
    # Directed frames would go to their targets alone; this log has none, so all are for all.
    assert not targets, f"the log has frames for the systems {targets}"
    stage.start_router(
        # A replay on a busy machine may take longer than peers may be silent.
        "udpin:127.0.0.1:0?name=udp&peer_timeout=60m",
        "tcpin:127.0.0.1:0?name=tcp",
        f"{player_at}:127.0.0.1:0?name=player",
    )
    by_udp = join(stage, Listener("udp", socket.SOCK_DGRAM, stage.port("udp")), 254)
    # The one who was there first hears the other one join.
    by_udp.owe([announcement(253), *flight])
    by_tcp = join(stage, Listener("tcp", socket.SOCK_STREAM, stage.port("tcp")), 253)
    by_tcp.owe(flight)
    stage.until("one to hear the other", lambda: by_udp.heard == 1)
    kind = socket.SOCK_DGRAM if player_at == "udpin" else socket.SOCK_STREAM
    with socket.socket(socket.AF_INET, kind) as player:
        player.connect(("127.0.0.1", stage.port("player")))
        replay(stage, flight, player, (by_udp, by_tcp))
    assert by_udp.received == len(by_udp.owed)
    assert by_tcp.received == len(by_tcp.owed)


def join(stage, listener, system):
    """Lets the router know a listener."""
    stage.listeners.append(listener)
    listener.socket.send(announcement(system))
    stage.until(
        f"{listener.name} to be seen",
        lambda: stage.router.says(rf"component {system}/190 seen on {listener.name}\b"),
    )
    return listener


def replay(stage, flight, player, listeners):
    """Sends a flight, never further ahead of the slower listener than the window."""

    def missing():
        return max(len(listener.ends) - listener.heard for listener in listeners)

    portion = WINDOW // 2
    for start in range(0, len(flight), portion):
        for frame in flight[start : start + portion]:
            player.sendall(frame)
        # What was sent before this portion has arrived.
        unsent = len(flight) - start
        stage.until("the listeners to keep up", lambda most=unsent: missing() <= most)
    stage.until("the last frames", lambda: missing() == 0)
