"""The router as a component, seen by pymavlink: it is there, it answers, and it is answered."""

import json
import subprocess

from peers import GroundStation, mavlink2, source

OWN = (1, 191)


class Companion(GroundStation):
    """Somebody who answers TIMESYNC and PING as the protocol has it."""

    def answer(self, message):
        system, component = source(message)
        asker = {"target_system": system, "target_component": component}
        if message.get_type() == "TIMESYNC" and message.tc1 == 0:
            self.say("timesync", tc1=10**12, ts1=message.ts1, **asker)
        elif message.get_type() == "PING" and message.target_system == 0:
            self.say("ping", time_usec=message.time_usec, seq=message.seq, **asker)


def said_by_router(peer, name):
    return [message for message in peer.heard_of(name) if source(message) == OWN]


def test_pymavlink_sees_an_onboard_controller_and_no_vehicle(stage):
    gcs = stage.peer(GroundStation(), "tcpin")
    stage.open("--system=1")
    stage.until("three heartbeats", lambda: len(said_by_router(gcs, "HEARTBEAT")) >= 3)
    heartbeats = said_by_router(gcs, "HEARTBEAT")
    own = mavlink2.MAVLink(None, *OWN)
    for heartbeat in heartbeats:
        assert heartbeat.type == mavlink2.MAV_TYPE_ONBOARD_CONTROLLER
        assert heartbeat.autopilot == mavlink2.MAV_AUTOPILOT_INVALID
        assert heartbeat.system_status == mavlink2.MAV_STATE_ACTIVE
        assert (heartbeat.base_mode, heartbeat.custom_mode) == (0, 0)
        own.seq = heartbeat.get_seq()
        fields = {name: getattr(heartbeat, name) for name in heartbeat.fieldnames}
        again = type(heartbeat)(**fields).pack(own)
        assert bytes(again) == bytes(heartbeat.get_msgbuf())
    assert gcs.refused == []


def test_pymavlink_has_its_timesync_and_ping_answered(stage):
    gcs = stage.peer(GroundStation(), "udpin")
    other = stage.peer(GroundStation(254), "tcpin")
    stage.open("--system=1")
    gcs.say("timesync", tc1=0, ts1=10**12 + 7, target_system=1, target_component=191)
    gcs.say("ping", time_usec=5, seq=6, target_system=0, target_component=0)
    answers = lambda peer: [
        *(m for m in said_by_router(peer, "TIMESYNC") if m.tc1 != 0),
        *(m for m in said_by_router(peer, "PING") if m.target_system != 0),
    ]
    stage.until("both answers", lambda: len(answers(gcs)) == 2)
    timesync, ping = answers(gcs)
    assert timesync.ts1 == 10**12 + 7 and timesync.tc1 > 0
    assert (ping.time_usec, ping.seq, ping.target_system, ping.target_component) == (5, 6, 255, 190)
    stage.roll_call()
    assert answers(other) == [] and gcs.refused == [] and other.refused == []


def test_the_round_trip_to_pymavlink_is_measured(stage, tmp_path):
    companion = stage.peer(Companion(), "tcpin")
    control = tmp_path / "control"
    stage.open("--system=1", f"--control={control}")

    def round_trips():
        command = [stage.binary, "status", "--json", f"--control={control}"]
        status = json.loads(subprocess.check_output(command))
        endpoint = next(it for it in status["endpoints"] if it["name"] == companion.name)
        return [link["round_trip_ms"] for link in endpoint["links"]]

    questions = lambda: len(said_by_router(companion, "TIMESYNC") + said_by_router(companion, "PING"))
    stage.until("a question", questions)
    stage.until("its answer to be noticed", lambda: round_trips() != [None])
    assert 0.0 < round_trips()[0] < 60_000.0
