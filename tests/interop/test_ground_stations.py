"""Real ground stations find the vehicle through the router: MAVProxy and MAVSDK, if installed."""

import importlib.util
import json
import os
import subprocess
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


needs_mavproxy = pytest.mark.skipif(not MAVPROXY.is_file(), reason="MAVProxy is not installed")
needs_mavsdk = pytest.mark.skipif(
    not importlib.util.find_spec("mavsdk"), reason="MAVSDK is not installed"
)


def start_mavproxy(stage, directory, *arguments, **popen):
    """MAVProxy at the router, with nothing of whoever runs the test but this directory."""
    command = [
        sys.executable,
        MAVPROXY,
        f"--master=udpout:127.0.0.1:{stage.port('udp')}",
        f"--state-basedir={directory}",
        *arguments,
    ]
    # The lines as they are printed.
    env = {**os.environ, "HOME": str(directory), "PYTHONUNBUFFERED": "1"}
    return stage.start(command, cwd=directory, env=env, **popen)


@needs_mavproxy
def test_mavproxy_lists_the_parameters(stage, vehicle, tmp_path):
    modules = "--default-modules=link,param"
    mavproxy = start_mavproxy(stage, tmp_path, modules, "--non-interactive")
    saved = r"Saved \d+ parameters to (\S+)"
    stage.until("MAVProxy to save them", lambda: mavproxy.says(saved) or mavproxy.ended)
    assert mavproxy.says(saved)[0] == f"Saved {len(PARAMETERS)} parameters to {tmp_path}/mav.parm"
    lines = (tmp_path / "mav.parm").read_text().splitlines()
    assert {name: float(value) for name, value in map(str.split, lines)} == PARAMETERS


@needs_mavproxy
def test_mavproxy_sends_a_mission_up_gets_it_back_and_fetches_a_file(stage, vehicle, tmp_path):
    log = bytes(number * 7 % 251 for number in range(30_000))
    vehicle.ftp.files["/LOG.BIN"] = log
    # Exact in binary: MAVProxy cuts off what it calculates.
    latitudes = [47.25 + number / 64 for number in range(15)]
    rows = [
        f"{number}\t{int(number == 0)}\t3\t16\t0\t0\t0\t0\t{latitude}\t8.5\t{20 + number}\t1"
        for number, latitude in enumerate(latitudes)
    ]
    (tmp_path / "up.txt").write_text("\n".join(["QGC WPL 110", *rows, ""]))
    modules = "--default-modules=link,wp,ftp"
    mavproxy = start_mavproxy(stage, tmp_path, modules, stdin=subprocess.PIPE)

    def says(what, pattern):
        stage.until(what, lambda: mavproxy.says(pattern) or mavproxy.ended)
        assert mavproxy.says(pattern), mavproxy

    says("MAVProxy to find the vehicle", r"[Oo]nline system 1")
    mavproxy.type("wp load up.txt")
    stage.until("the mission to arrive", lambda: len(vehicle.mission) == len(rows))
    places = [(item["x"], item["y"], item["z"]) for item in vehicle.mission]
    assert places == [(x * 1e7, 8.5e7, 20.0 + number) for number, x in enumerate(latitudes)]
    mavproxy.type("wp list")
    says("MAVProxy to get it back", rf"Saved {len(rows)} waypoints to \S+way.txt")
    mavproxy.type("wp save back.txt")
    says("MAVProxy to save it", rf"Saved {len(rows)} waypoints to back.txt")
    up, back = ((tmp_path / name).read_text().split() for name in ("up.txt", "back.txt"))
    # The same numbers, however they are written.
    assert list(map(float, back[3:])) == list(map(float, up[3:]))
    mavproxy.type("ftp get /LOG.BIN got.bin")
    says("MAVProxy to get the file", r"Wrote \d+ bytes to got.bin")
    # It says so before it has closed the file.
    got = tmp_path / "got.bin"
    stage.until("the whole file", lambda: got.read_bytes() == log)


@needs_mavsdk
@pytest.mark.parametrize("endpoint", ["udp", "tcp"])
def test_mavsdk_reads_and_sets_parameters_and_arms(stage, vehicle, endpoint):
    address = f"{endpoint}out://127.0.0.1:{stage.port(endpoint)}"
    program = stage.start([sys.executable, HERE / "mavsdk_station.py", address])
    stage.until("the program to end", lambda: program.ended)
    learned = json.loads(program.says(r"^\{.*\}$")[0])
    assert learned == {"system": 1, "parameters": PARAMETERS, "TEST_007": -2.5}
    assert vehicle.parameters["TEST_007"] == -2.5
    assert vehicle.armed


@needs_mavsdk
def test_mavsdk_serves_mavsdk(stage, tmp_path):
    served, got = tmp_path / "served", tmp_path / "got"
    served.mkdir()
    got.mkdir()
    (served / "log.bin").write_bytes(bytes(number * 7 % 251 for number in range(30_000)))
    stage.start_router("tcpin:127.0.0.1:0?name=air", "udpin:127.0.0.1:0?name=ground")
    air = f"tcpout://127.0.0.1:{stage.port('air')}"
    autopilot = [sys.executable, HERE / "mavsdk_autopilot.py", air, served]
    stage.start(autopilot, stdin=subprocess.PIPE)
    ground = f"udpout://127.0.0.1:{stage.port('ground')}"
    visitor = stage.start([sys.executable, HERE / "mavsdk_visitor.py", ground, got])
    stage.until("the visitor to end", lambda: visitor.ended)
    learned = json.loads(visitor.says(r"^\{.*\}$")[0])
    assert learned["position"] == [47.25, 8.5]
    assert learned["parameters"] == {f"SERVED_{number:02}": number * 0.5 for number in range(20)}
    assert learned["SERVED_03"] == -2.5
    assert learned["mission"] == learned["sent"]
    assert learned["file"] == "SUCCESS"
    assert (got / "log.bin").read_bytes() == (served / "log.bin").read_bytes()
    assert learned["commands"] == "accepted"
