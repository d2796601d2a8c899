"""Real ground stations find the vehicle through the router: MAVProxy and MAVSDK, if installed."""

import importlib.util
import json
import os
import sys
from pathlib import Path

import pytest
from vehicle import PARAMETERS, Vehicle

HERE = Path(__file__).parent
MAVPROXY = Path(sys.executable).with_name("mavproxy.py")


@pytest.fixture
def vehicle(stage):
    """A vehicle that keeps beating, with an endpoint of each kind for a ground station."""
    vehicle = stage.peer(Vehicle(), "tcpin")
    stage.open("udpin:127.0.0.1:0?name=udp", "tcpin:127.0.0.1:0?name=tcp")
    vehicle.beat()
    return vehicle


@pytest.mark.skipif(not MAVPROXY.is_file(), reason="MAVProxy is not installed")
def test_mavproxy_lists_the_parameters(stage, vehicle, tmp_path):
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
        # Not the settings of whoever runs the test, but the lines as they are printed.
        env={**os.environ, "HOME": str(tmp_path), "PYTHONUNBUFFERED": "1"},
    )
    saved = r"Saved \d+ parameters to (\S+)"
    stage.until("MAVProxy to save them", lambda: mavproxy.says(saved) or mavproxy.ended)
    assert mavproxy.says(saved)[0] == f"Saved {len(PARAMETERS)} parameters to {tmp_path}/mav.parm"
    lines = (tmp_path / "mav.parm").read_text().splitlines()
    assert {name: float(value) for name, value in map(str.split, lines)} == PARAMETERS


@pytest.mark.skipif(not importlib.util.find_spec("mavsdk"), reason="MAVSDK is not installed")
@pytest.mark.parametrize("endpoint", ["udp", "tcp"])
def test_mavsdk_reads_and_sets_parameters_and_arms(stage, vehicle, endpoint):
    address = f"{endpoint}out://127.0.0.1:{stage.port(endpoint)}"
    program = stage.start([sys.executable, HERE / "mavsdk_station.py", address])
    stage.until("the program to end", lambda: program.ended)
    learned = json.loads(program.says(r"^\{.*\}$")[0])
    assert learned == {"system": 1, "parameters": PARAMETERS, "TEST_007": -2.5}
    assert vehicle.parameters["TEST_007"] == -2.5
    assert vehicle.armed
