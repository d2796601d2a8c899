"""Two ground stations at one port of the router share a vehicle; each gets its own answers only."""

import pytest
from peers import GroundStation, assert_heard_byte_for_byte, mavlink2
from vehicle import PARAMETERS, Vehicle, mission

WAYPOINTS = 5


@pytest.fixture(params=["udpin", "tcpin"])
def everybody(stage, request):
    """The vehicle and the two stations, which are at one port."""
    vehicle = stage.peer(Vehicle(), "tcpin")
    first = stage.peer(GroundStation(255, 190), request.param)
    second = stage.peer_beside(first, GroundStation(254, 190))
    stage.open()
    return vehicle, first, second


def answers(station):
    """The messages that were meant for one: those with a target."""
    return [message for message in station.heard if getattr(message, "target_system", 0)]


def test_each_gets_its_own_answers(stage, everybody):
    vehicle, *stations = everybody
    vehicle.mission = mission(WAYPOINTS)
    # Both at once: each question is asked by both before either is answered.
    for station in stations:
        station.say("mission_request_list", **vehicle.target)
    for seq in range(WAYPOINTS):
        for station in stations:
            station.say("mission_request_int", seq=seq, **vehicle.target)
    # Commands that tell the stations apart by their answers.
    accepted = {"command": mavlink2.MAV_CMD_COMPONENT_ARM_DISARM, "param1": 1.0}
    unsupported = {"command": mavlink2.MAV_CMD_DO_SET_HOME, "param1": 0.0}
    others = {f"param{number}": 0.0 for number in range(2, 8)}
    for station, command in zip(stations, (accepted, unsupported)):
        station.say("command_long", confirmation=0, **command, **others, **vehicle.target)
    stage.until(
        "both to be answered",
        lambda: all(station.heard_of("COMMAND_ACK") for station in stations),
    )
    stage.roll_call()
    for station in stations:
        assert all(answer.target_system == station.system for answer in answers(station))
        kinds = [answer.get_type() for answer in answers(station)]
        assert kinds == ["MISSION_COUNT", *["MISSION_ITEM_INT"] * WAYPOINTS, "COMMAND_ACK"]
    results = [station.heard_of("COMMAND_ACK")[0].result for station in stations]
    assert results == [mavlink2.MAV_RESULT_ACCEPTED, mavlink2.MAV_RESULT_UNSUPPORTED]


def test_both_hear_what_is_for_everybody(stage, everybody):
    vehicle, first, second = everybody
    first.say("param_request_list", **vehicle.target)
    stage.until(
        "both to hear the list",
        lambda: all(s.parameters == PARAMETERS for s in (first, second)),
    )
    stage.roll_call()
    assert_heard_byte_for_byte(first, vehicle)
    assert_heard_byte_for_byte(second, vehicle)
    # The question was for the vehicle alone.
    assert [message.get_type() for message in second.heard_from(first)] == ["HEARTBEAT"]


def test_stations_may_write_to_each_other(stage, everybody):
    vehicle, first, second = everybody
    first.say("ping", time_usec=1, seq=7, **second.target)
    stage.roll_call()
    assert [ping.seq for ping in second.heard_of("PING")] == [7]
    assert vehicle.heard_of("PING") == []
