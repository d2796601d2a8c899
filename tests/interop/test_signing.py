"""A signed session passes the router, which has no key: every signature verifies at the end."""

import hashlib

from peers import GroundStation, Peer, assert_heard_byte_for_byte, frames, mavlink2
from vehicle import PARAMETERS, Vehicle

KEY = hashlib.sha256(b"the key of this vehicle").digest()
ANOTHER_KEY = hashlib.sha256(b"the key of another vehicle").digest()


def open_signed(stage):
    vehicle = stage.peer(Vehicle(key=KEY), "tcpin")
    ground = stage.peer(GroundStation(key=KEY), "udpin")
    return vehicle, ground


def test_signed_frames_verify_at_the_other_end(stage):
    vehicle, ground = open_signed(stage)
    listener = stage.peer(Peer(7, 191, key=KEY), "udpin")
    stage.open()
    verified = ground.link.mav.signing.goodsig_count
    ground.say("param_request_list", **vehicle.target)
    stage.until("the parameters", lambda: ground.parameters == PARAMETERS)
    kind = mavlink2.MAV_PARAM_TYPE_REAL32
    ground.say(
        "param_set", param_id=b"TEST_001", param_value=8.0, param_type=kind, **vehicle.target
    )
    stage.until("the new value", lambda: ground.parameters["TEST_001"] == 8.0)
    stage.roll_call()
    assert all(message.get_signed() for message in [*ground.heard, *vehicle.heard])
    assert ground.link.mav.signing.goodsig_count - verified == len(ground.heard)
    assert_heard_byte_for_byte(ground, vehicle)
    assert_heard_byte_for_byte(vehicle, ground)
    assert_heard_byte_for_byte(listener, vehicle)


def test_a_wrong_signature_is_for_the_vehicle_to_refuse(stage):
    vehicle, _ground = open_signed(stage)
    stage.open()
    impostor = GroundStation(253, 190, key=ANOTHER_KEY)
    impostor.connect("udpin", stage.port("GroundStation-255"))
    stage.peers.append(impostor)
    impostor.greet()
    stage.until("the vehicle to refuse it", lambda: vehicle.refused)
    assert "signature" in vehicle.refused[0].reason.lower()
    assert frames(vehicle.refused) == impostor.said


def test_the_key_itself_is_not_passed_on(stage):
    vehicle, ground = open_signed(stage)
    stage.open()
    ground.say("setup_signing", secret_key=list(KEY), initial_timestamp=0, **vehicle.target)
    stage.roll_call()
    assert vehicle.heard_of("SETUP_SIGNING") == []
    assert frames(vehicle.heard_from(ground)) == ground.said[1:]
