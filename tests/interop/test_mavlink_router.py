"""In the place of mavlink-router: called by its name, with its command line.

Two pingers speak to one UDP server port of the router, one to everybody and one to a responder that
the router has not heard yet; the router calls the two responders. The scenario, and how many pings
and answers everybody has to count, are those of mavlink-router's own routing test.
"""

import contextlib
import os
import socket

import pytest
from peers import Peer, source
from stage import Stage

PINGS = 10


class Pinger(Peer):
    """Asks for answers."""

    def ping(self, seq, system, component):
        target = {"target_system": system, "target_component": component}
        self.say("ping", time_usec=seq, seq=seq, **target)

    @property
    def answers(self):
        """Pings with a target; those without one are questions to everybody."""
        return [ping for ping in self.heard_of("PING") if ping.target_system != 0]


class Responder(Peer):
    """Answers every ping."""

    def answer(self, message):
        if message.get_type() == "PING":
            system, component = source(message)
            target = {"target_system": system, "target_component": component}
            self.say("ping", time_usec=message.time_usec, seq=message.seq, **target)

    @property
    def questions(self):
        return self.heard_of("PING")


@pytest.fixture
def free_port():
    """A port for this test alone: below those that the system gives to who asks for any, and with a
    mark on it by which all our tests know that it is taken."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as mark:
        for port in range(20_000 + os.getpid() * 61 % 5_000, 30_000):
            with contextlib.suppress(OSError):
                mark.bind(f"\0mavswitch-test-port-{port}")
                break
        yield port


@pytest.fixture
def routerd(mavswitch, tmp_path):
    """The stage of a router that is called by mavlink-router's name."""
    link = tmp_path / "mavlink-routerd"
    link.symlink_to(mavswitch)
    stage = Stage(link)
    yield stage
    stage.close()


def test_two_pingers_at_one_port_are_answered_by_two_responders(routerd, free_port):
    to_all, to_one = Pinger(1, 1), Pinger(2, 1)
    first, second = Responder(100, 1), Responder(101, 1)
    for responder in (first, second):
        responder.listen("udpout")
    port = free_port
    called = [word for it in (first, second) for word in ("-e", f"127.0.0.1:{it.port}")]
    # Its TCP server at the usual port is no part of this, and others may have it.
    routerd.start_router(*called, f"127.0.0.1:{port}", "-t", "0", "-c", "/nonexistent")
    for pinger in (to_all, to_one):
        pinger.connect("udpin", port)
    routerd.peers += [to_all, to_one, first, second]

    for seq in range(PINGS):
        # The first of these goes nowhere: nobody has heard of the responder yet.
        to_one.ping(seq, *first.ids)
        routerd.until("its sender to be seen", lambda: routerd.has_seen(to_one))
        if seq > 0:
            routerd.until("the answer of one", lambda: len(to_one.answers) == seq)
        to_all.ping(seq, 0, 0)
        routerd.until("the answers of both", lambda: len(to_all.answers) == 2 * (seq + 1))

    # One more question to everybody comes behind all that was said before.
    to_all.ping(PINGS, 0, 0)
    routerd.until("the last answers", lambda: len(to_all.answers) == 2 * (PINGS + 1))
    for peer in routerd.peers:
        peer.heard = [message for message in peer.heard if message.seq != PINGS]

    assert len(to_all.answers) == 20
    assert len(to_one.answers) == 9
    assert len(second.questions) == 10
    assert len(first.questions) == 19
    assert {source(answer) for answer in to_one.answers} == {first.ids}
    assert all(answer.target_system == 1 for answer in to_all.answers)
    assert all(question.target_system == 0 for question in second.questions)
