"""The simulated vehicle as pymavlink and MAVProxy see it: they know nothing of how it is made."""

import os
import sys
from pathlib import Path

import pytest
from peers import GroundStation, mavlink2, mavutil, source
from stage import PATIENCE
from vehicle import mission, waypoint

MAVPROXY = Path(sys.executable).with_name("mavproxy.py")
VEHICLE = {"target_system": 1, "target_component": 1}
PARAMETERS = 12


@pytest.fixture
def gcs(stage):
    """A ground station beside a simulated vehicle."""
    gcs = stage.peer(GroundStation(), "tcpin")
    stage.open("sim:?rate=10")
    return gcs


def heard(stage, gcs, name, **fields):
    """The first message of this kind with these fields."""

    def found():
        kind = gcs.heard_of(name)
        is_it = lambda m: all(getattr(m, field) == value for field, value in fields.items())
        return next((message for message in kind if is_it(message)), None)

    stage.until(f"{name} {fields}", found)
    return found()


def command(stage, gcs, number, *params):
    """Gives a command, and returns the MAV_RESULT."""
    gcs.heard[:] = [m for m in gcs.heard if m.get_type() != "COMMAND_ACK"]
    params = {f"param{at}": 0.0 for at in range(1, 8)} | {
        f"param{at}": float(param) for at, param in enumerate(params, 1)
    }
    gcs.say("command_long", **VEHICLE, command=number, confirmation=0, **params)
    return heard(stage, gcs, "COMMAND_ACK", command=number).result


def test_every_message_is_made_as_pymavlink_makes_it(stage, gcs):
    requests = [
        ("param_request_read", {"param_id": b"SIM_RADIUS", "param_index": -1}),
        ("mission_request_list", {"mission_type": 0}),
        ("mission_request_int", {"seq": 1, "mission_type": 0}),
        ("mission_set_current", {"seq": 2}),
        ("mission_count", {"count": 1, "mission_type": 0}),
        ("mission_clear_all", {"mission_type": 0}),
    ]
    for name, fields in requests:
        gcs.say(name, **VEHICLE, **fields)
    gcs.say("timesync", tc1=0, ts1=10**12 + 7)
    gcs.say("ping", time_usec=5, seq=6, target_system=0, target_component=0)
    for number, param in [(512, 148), (512, 242), (510, 30)]:
        assert command(stage, gcs, number, param) == mavlink2.MAV_RESULT_ACCEPTED
    kinds = {
        *("HEARTBEAT", "SYS_STATUS", "EXTENDED_SYS_STATE", "GPS_RAW_INT", "ATTITUDE"),
        *("GLOBAL_POSITION_INT", "VFR_HUD", "PARAM_VALUE", "COMMAND_ACK", "AUTOPILOT_VERSION"),
        *("HOME_POSITION", "MESSAGE_INTERVAL", "MISSION_COUNT", "MISSION_ITEM_INT"),
        *("MISSION_CURRENT", "MISSION_REQUEST_INT", "MISSION_ACK", "TIMESYNC", "PING"),
    }
    stage.until("every kind", lambda: kinds <= {m.get_type() for m in gcs.heard})
    own = mavlink2.MAVLink(None, 1, 1)
    for message in gcs.heard:
        assert message.get_type() in kinds and source(message) == (1, 1)
        if message.get_type() == "TIMESYNC":
            # It has a target since 2023, which not every pymavlink knows.
            continue
        fields = {name: getattr(message, name) for name in message.fieldnames}
        fields |= {name: value.encode() for name, value in fields.items() if isinstance(value, str)}
        own.seq = message.get_seq()
        again = type(message)(**fields).pack(own)
        assert bytes(again) == bytes(message.get_msgbuf()), message
    assert gcs.refused == []
    assert heard(stage, gcs, "TIMESYNC").ts1 == 10**12 + 7
    assert heard(stage, gcs, "PING").seq == 6


def test_what_it_tells_of_its_motion_makes_sense(stage, gcs):
    gcs.forget()
    fix, attitude = heard(stage, gcs, "GLOBAL_POSITION_INT"), heard(stage, gcs, "ATTITUDE")
    raw, hud = heard(stage, gcs, "GPS_RAW_INT"), heard(stage, gcs, "VFR_HUD")
    status, landed = heard(stage, gcs, "SYS_STATUS"), heard(stage, gcs, "EXTENDED_SYS_STATE")
    assert abs(fix.lat / 1e7 - 47.397742) < 1e-3 and abs(fix.lon / 1e7 - 8.545594) < 1e-3
    assert (fix.relative_alt, fix.alt) == (30_000, 518_000)
    assert abs((fix.vx**2 + fix.vy**2) ** 0.5 - 800) < 2
    # To the right, as the circle goes: 8 m/s around 50 m.
    assert 0.12 < attitude.roll < 0.14 and abs(attitude.yawspeed - 0.16) < 1e-6
    assert (raw.fix_type, raw.satellites_visible, raw.vel) == (3, 14, 800)
    assert abs(hud.groundspeed - 8.0) < 1e-6 and abs(hud.alt - 518.0) < 1e-3
    assert status.voltage_battery == 15_800
    assert landed.landed_state == mavlink2.MAV_LANDED_STATE_IN_AIR


def test_the_start_of_qgroundcontrol_is_answered(stage, gcs):
    heartbeat = heard(stage, gcs, "HEARTBEAT")
    assert heartbeat.type == mavlink2.MAV_TYPE_QUADROTOR
    assert command(stage, gcs, 512, mavlink2.MAVLINK_MSG_ID_AUTOPILOT_VERSION) == 0
    version = heard(stage, gcs, "AUTOPILOT_VERSION")
    assert version.capabilities & mavlink2.MAV_PROTOCOL_CAPABILITY_MISSION_INT
    # PROTOCOL_VERSION, COMPONENT_INFORMATION and what came after: it says that it has none, so that
    # nobody waits for it.
    for number in (300, 395, 397, 435):
        assert command(stage, gcs, 512, number) == mavlink2.MAV_RESULT_UNSUPPORTED
    gcs.say("param_request_list", target_system=1, target_component=0)
    stage.until("the parameters", lambda: len(gcs.parameters) == PARAMETERS)
    assert {told.param_count for told in gcs.heard_of("PARAM_VALUE")} == {PARAMETERS}
    for kind, count in enumerate([4, 0, 0]):
        gcs.say("mission_request_list", **VEHICLE, mission_type=kind)
        assert heard(stage, gcs, "MISSION_COUNT", mission_type=kind).count == count


def test_parameters_are_set_and_kept(stage, gcs):
    real32 = mavlink2.MAV_PARAM_TYPE_REAL32
    gcs.say(
        "param_set", **VEHICLE, param_id=b"SIM_ALT", param_value=42.0, param_type=real32
    )
    assert heard(stage, gcs, "PARAM_VALUE", param_id="SIM_ALT").param_value == 42.0
    heard(stage, gcs, "GLOBAL_POSITION_INT", relative_alt=42_000)
    gcs.forget()
    gcs.say("param_request_read", **VEHICLE, param_id=b"SIM_ALT", param_index=-1)
    assert heard(stage, gcs, "PARAM_VALUE", param_id="SIM_ALT").param_value == 42.0


def test_a_mission_goes_up_and_comes_down(stage, gcs):
    items = mission(30)
    gcs.say("mission_count", **VEHICLE, count=len(items), mission_type=0)
    for item in items:
        heard(stage, gcs, "MISSION_REQUEST_INT", seq=item["seq"])
        gcs.say("mission_item_int", **VEHICLE, **item, mission_type=0)
    assert heard(stage, gcs, "MISSION_ACK").type == mavlink2.MAV_MISSION_ACCEPTED
    gcs.say("mission_request_list", **VEHICLE, mission_type=0)
    assert heard(stage, gcs, "MISSION_COUNT").count == len(items)
    for item in items:
        gcs.say("mission_request_int", **VEHICLE, seq=item["seq"], mission_type=0)
        told = heard(stage, gcs, "MISSION_ITEM_INT", seq=item["seq"])
        assert waypoint(told) == item
    gcs.say("mission_ack", **VEHICLE, type=0, mission_type=0)


def test_pymavlink_connects_as_to_any_vehicle(stage):
    stage.start_router("sim:", "tcpin:127.0.0.1:0?name=tcp")
    ids = {"source_system": 254, "source_component": 191}
    link = mavutil.mavlink_connection(f"tcp:127.0.0.1:{stage.port('tcp')}", **ids)
    try:
        assert link.wait_heartbeat(timeout=PATIENCE)
        # Until then it may not know who we are.
        link.mav.heartbeat_send(mavlink2.MAV_TYPE_GCS, mavlink2.MAV_AUTOPILOT_INVALID, 0, 0, 0)
        link.param_fetch_all()
        names = set()
        while len(names) < PARAMETERS:
            names.add(link.recv_match(type="PARAM_VALUE", blocking=True, timeout=PATIENCE).param_id)
        link.set_mode("GUIDED")
        while link.flightmode != "GUIDED":
            assert link.recv_match(type="HEARTBEAT", blocking=True, timeout=PATIENCE)
        assert link.motors_armed()
        link.arducopter_disarm()
        ack = link.recv_match(type="COMMAND_ACK", blocking=True, timeout=PATIENCE)
        while ack.command != mavlink2.MAV_CMD_COMPONENT_ARM_DISARM:
            ack = link.recv_match(type="COMMAND_ACK", blocking=True, timeout=PATIENCE)
        assert ack.result == mavlink2.MAV_RESULT_ACCEPTED
        while link.motors_armed():
            assert link.recv_match(type="HEARTBEAT", blocking=True, timeout=PATIENCE)
    finally:
        link.close()


@pytest.mark.skipif(not MAVPROXY.is_file(), reason="MAVProxy is not installed")
def test_mavproxy_sees_it_and_has_its_parameters(stage, tmp_path):
    stage.start_router("sim:", "udpin:127.0.0.1:0?name=udp")
    mavproxy = stage.start(
        [
            sys.executable,
            MAVPROXY,
            f"--master=udpout:127.0.0.1:{stage.port('udp')}",
            "--default-modules=link,param",
            "--non-interactive",
            f"--state-basedir={tmp_path}",
        ],
        cwd=tmp_path,
        env={**os.environ, "HOME": str(tmp_path), "PYTHONUNBUFFERED": "1"},
    )
    saved = r"Saved (\d+) parameters to (\S+)"
    stage.until("MAVProxy to save them", lambda: mavproxy.says(saved) or mavproxy.ended)
    assert mavproxy.says(saved)[1] == str(PARAMETERS)
    assert mavproxy.says(r"online system 1")
