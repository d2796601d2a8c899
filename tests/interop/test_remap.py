"""Two vehicles with one and the same id, flown side by side by one ground station."""

from peers import GroundStation
from vehicle import Vehicle


class Namesake(Vehicle):
    """Another vehicle 1/1, with other parameters."""

    def __init__(self):
        super().__init__()
        self.parameters = {name: value + 1000.0 for name, value in self.parameters.items()}


def test_both_are_flown_by_one_ground_station(stage):
    one, two, ground = Vehicle(), Namesake(), GroundStation()
    stage.start_router(
        "tcpin:127.0.0.1:0?name=one",
        "tcpin:127.0.0.1:0?name=two&remap=1:7",
        "udpin:127.0.0.1:0?name=ground",
    )
    for peer, scheme, name, seen in [
        (ground, "udpin", "ground", "255/190"),
        (one, "tcpin", "one", "1/1"),
        (two, "tcpin", "two", "7/1"),
    ]:
        peer.connect(scheme, stage.port(name))
        stage.peers.append(peer)
        peer.greet()
        stage.until(f"{seen}", lambda: stage.router.says(rf"component {seen} seen on {name}\b"))
    for system, vehicle in [(1, one), (7, two)]:
        target = {"target_system": system, "target_component": 1}
        ground.say("param_request_list", **target)

        def told():
            messages = ground.heard_of("PARAM_VALUE")
            own = [m for m in messages if m.get_srcSystem() == system]
            return {m.param_id: m.param_value for m in own}

        stage.until("its parameters", lambda: told() == vehicle.parameters)
        assert {m.get_srcSystem() for m in ground.heard_of("PARAM_VALUE")} <= {1, system}
        ground.say(
            "command_long",
            command=400,
            confirmation=0,
            **{f"param{n}": 1.0 if n == 1 else 0.0 for n in range(1, 8)},
            **target,
        )
        acks = lambda: [m for m in ground.heard_of("COMMAND_ACK") if m.get_srcSystem() == system]
        stage.until("its answer", acks)
        assert vehicle.armed
        # It was for the ground station, and only one of them has heard the command so far.
        assert acks()[0].target_system == 255
        assert two.armed == (vehicle is two)
