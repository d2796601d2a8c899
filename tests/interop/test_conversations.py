"""A vehicle and a ground station talk through the router, over every kind of socket.

Each conversation is held in MAVLink 1 and in MAVLink 2, and ends with a look at every frame: what
one said is, byte for byte and in order, what the other heard.
"""

import pytest
from peers import GroundStation, assert_heard_byte_for_byte, mavlink2
from vehicle import PARAMETERS, Vehicle, mission, waypoint

# Where the vehicle is, and where the ground station: each kind of endpoint on both sides.
PLACES = [("tcpin", "udpin"), ("udpin", "tcpout"), ("udpout", "tcpin"), ("tcpout", "udpout")]


class Conversation:
    """A vehicle and a ground station that know each other."""

    def __init__(self, stage, vehicle_at, ground_at, version):
        self.stage = stage
        self.vehicle = stage.peer(Vehicle(version=version), vehicle_at)
        self.ground = stage.peer(GroundStation(version=version), ground_at)
        stage.open()

    def ask(self, name, **fields):
        """The ground station says something to the vehicle."""
        self.ground.say(name, **self.vehicle.target, **fields)

    def until_ground_hears(self, name, count=1):
        """The last message of a kind, when there are so many."""
        ground = self.ground
        self.stage.until(f"{count} {name}", lambda: len(ground.heard_of(name)) >= count)
        return ground.heard_of(name)[-1]

    def end(self):
        self.stage.roll_call()
        assert_heard_byte_for_byte(self.ground, self.vehicle)
        assert_heard_byte_for_byte(self.vehicle, self.ground)


@pytest.fixture(params=PLACES, ids=lambda places: "vehicle_{}-ground_{}".format(*places))
def places(request):
    return request.param


@pytest.fixture(params=[1, 2], ids=["mavlink1", "mavlink2"])
def conversation(stage, places, request):
    return Conversation(stage, *places, version=request.param)


def test_the_parameter_list_is_read_and_one_is_set(conversation):
    conversation.ask("param_request_list")
    conversation.until_ground_hears("PARAM_VALUE", len(PARAMETERS))
    assert conversation.ground.parameters == PARAMETERS
    kind = mavlink2.MAV_PARAM_TYPE_REAL32
    conversation.ask("param_set", param_id=b"TEST_007", param_value=-2.5, param_type=kind)
    told = conversation.until_ground_hears("PARAM_VALUE", len(PARAMETERS) + 1)
    assert (told.param_id, told.param_value) == ("TEST_007", -2.5)
    assert conversation.vehicle.parameters["TEST_007"] == -2.5
    conversation.ask("param_request_read", param_id=b"TEST_007", param_index=-1)
    told = conversation.until_ground_hears("PARAM_VALUE", len(PARAMETERS) + 2)
    assert told.param_value == -2.5
    conversation.end()


def test_a_command_is_acknowledged(conversation):
    arm = mavlink2.MAV_CMD_COMPONENT_ARM_DISARM
    others = {f"param{number}": 0.0 for number in range(2, 8)}
    conversation.ask("command_long", command=arm, confirmation=0, param1=1.0, **others)
    ack = conversation.until_ground_hears("COMMAND_ACK")
    assert (ack.command, ack.result) == (arm, mavlink2.MAV_RESULT_ACCEPTED)
    assert conversation.vehicle.armed
    conversation.end()


def test_a_mission_is_uploaded(conversation):
    waypoints = mission(20)
    conversation.ask("mission_count", count=len(waypoints))
    for seq, item in enumerate(waypoints):
        request = conversation.until_ground_hears("MISSION_REQUEST_INT", seq + 1)
        assert request.seq == seq
        conversation.ask("mission_item_int", **item)
    ack = conversation.until_ground_hears("MISSION_ACK")
    assert ack.type == mavlink2.MAV_MISSION_ACCEPTED
    assert conversation.vehicle.mission == waypoints
    conversation.end()


def test_a_mission_is_downloaded(conversation):
    conversation.vehicle.mission = mission(20)
    conversation.ask("mission_request_list")
    count = conversation.until_ground_hears("MISSION_COUNT").count
    for seq in range(count):
        conversation.ask("mission_request_int", seq=seq)
        conversation.until_ground_hears("MISSION_ITEM_INT", seq + 1)
    conversation.ask("mission_ack", type=mavlink2.MAV_MISSION_ACCEPTED)
    downloaded = [waypoint(item) for item in conversation.ground.heard_of("MISSION_ITEM_INT")]
    assert downloaded == mission(20)
    conversation.end()
