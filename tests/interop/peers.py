"""Peers: who speaks MAVLink on one pymavlink connection, and remembers every frame said and heard.

Owns the connection and the memory of it; what a vehicle answers is in `vehicle.py`.
"""

import os
import time

# What a connection speaks at first, and what it knows; read by pymavlink when it is imported.
os.environ.update(MAVLINK20="1", MAVLINK_DIALECT="common")

from pymavlink import mavutil
from pymavlink.dialects.v10 import common as mavlink1
from pymavlink.dialects.v20 import common as mavlink2

DIALECTS = {1: mavlink1, 2: mavlink2}

# Where signatures begin: any number does, as long as nobody is a minute ahead of the others.
SIGNING_START = 10**13


class Peer:
    """Somebody on the network."""

    TYPE = mavlink2.MAV_TYPE_ONBOARD_CONTROLLER
    AUTOPILOT = mavlink2.MAV_AUTOPILOT_INVALID

    def __init__(self, system, component, version=2, key=None):
        self.system, self.component = system, component
        self.name = f"{type(self).__name__}-{system}"
        self.dialect = DIALECTS[version]
        self.key = key
        self.link = None
        # Frames as bytes.
        self.said = []
        # Messages; their frames are in `frames`.
        self.heard = []
        # Frames that could not be decoded or verified, as pymavlink reports them.
        self.refused = []
        # When the next heartbeat is due, for those who keep beating.
        self.next_heartbeat = None

    def listen(self, endpoint):
        """Opens a socket that the router's endpoint will call."""
        self._open({"udpout": "udpin", "tcpout": "tcpin"}[endpoint], 0)

    def connect(self, endpoint, port):
        """Calls an endpoint of the router."""
        self._open({"udpin": "udpout", "tcpin": "tcp"}[endpoint], port)

    def _open(self, scheme, port):
        address = f"{scheme}:127.0.0.1:{port}"
        ids = {"source_system": self.system, "source_component": self.component}
        self.link = mavutil.mavlink_connection(address, **ids)
        # In place of the one that pymavlink chose, whose version depends on what it hears first.
        self.link.mav = self.dialect.MAVLink(self.link, self.system, self.component)
        self.link.mav.robust_parsing = True
        self.link.first_byte = False
        if self.key:
            self.link.setup_signing(self.key, initial_timestamp=SIGNING_START, link_id=1)

    @property
    def port(self):
        """The local port."""
        socket = getattr(self.link, "listen", None) or self.link.port
        return socket.getsockname()[1]

    def can_speak(self):
        """Whether there is anybody to speak to: who listens has to be called first."""
        if isinstance(self.link, mavutil.mavtcpin):
            return self.link.port is not None
        return not getattr(self.link, "udp_server", False) or bool(self.link.clients)

    def fileno(self):
        return self.link.fd

    def take(self):
        """Hears what has arrived."""
        while (message := self.link.recv_msg()) is not None:
            if message.get_type() == "BAD_DATA":
                self.refused.append(message)
            else:
                self.heard.append(message)
                self.answer(message)

    def answer(self, message):
        """Nothing, unless a kind of peer knows better."""

    def say(self, name, **fields):
        """Sends a message; fields that this version of MAVLink lacks are left out."""
        kind = getattr(self.dialect, f"MAVLink_{name}_message")
        fields = {field: value for field, value in fields.items() if field in kind.fieldnames}
        message = kind(**fields)
        self.link.mav.send(message)
        self.said.append(bytes(message.get_msgbuf()))

    def greet(self, number=0):
        """Says a heartbeat that can be told from others."""
        state = mavlink2.MAV_STATE_ACTIVE
        self.say(
            "heartbeat",
            type=self.TYPE,
            autopilot=self.AUTOPILOT,
            base_mode=0,
            custom_mode=number,
            system_status=state,
            mavlink_version=3,
        )

    def beat(self):
        """From now on says a heartbeat every second, as programs expect of a vehicle."""
        self.next_heartbeat = time.monotonic()

    def keep_beating(self):
        if self.next_heartbeat is not None and time.monotonic() >= self.next_heartbeat:
            self.next_heartbeat = time.monotonic() + 1.0
            self.greet()

    def has_heard_greeting(self, other, number):
        greetings = (m for m in self.heard_from(other) if m.get_type() == "HEARTBEAT")
        return any(greeting.custom_mode == number for greeting in greetings)

    def heard_from(self, other):
        """The messages of another peer."""
        return [message for message in self.heard if source(message) == other.ids]

    def heard_of(self, name):
        """The messages of one kind."""
        return [message for message in self.heard if message.get_type() == name]

    @property
    def ids(self):
        return (self.system, self.component)

    @property
    def target(self):
        """The fields that address this peer."""
        return {"target_system": self.system, "target_component": self.component}

    def forget(self):
        """Starts its memory anew."""
        for memory in (self.said, self.heard, self.refused):
            memory.clear()

    def __str__(self):
        heard = [message.get_type() for message in self.heard[-5:]]
        refused = f", refused {len(self.refused)}" if self.refused else ""
        return (
            f"{self.name} said {len(self.said)} and heard {len(self.heard)} messages, "
            f"at last {heard}{refused}"
        )


class GroundStation(Peer):
    """A ground station that says what a test tells it to."""

    TYPE = mavlink2.MAV_TYPE_GCS

    def __init__(self, system=255, component=190, **options):
        super().__init__(system, component, **options)

    @property
    def parameters(self):
        """The parameters that it was told, and their values."""
        return {told.param_id: told.param_value for told in self.heard_of("PARAM_VALUE")}


def source(message):
    """Who said a message."""
    return (message.get_srcSystem(), message.get_srcComponent())


def frames(messages):
    """The frames of messages, as they arrived."""
    return [bytes(message.get_msgbuf()) for message in messages]


def assert_heard_byte_for_byte(listener, speaker):
    """All that one said is what the other heard of it: each frame, in order, unaltered."""
    assert frames(listener.heard_from(speaker)) == speaker.said
    assert listener.refused == []
