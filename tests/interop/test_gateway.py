"""The signing gateway against pymavlink and MAVProxy: who is believed, and who believes us."""

import hashlib
import os
import sys
import time
from pathlib import Path

import pytest
from peers import GroundStation, Peer, mavlink2
from vehicle import PARAMETERS, Vehicle

# One word: MAVProxy takes no more.
PASSPHRASE = "the-key-of-this-vehicle"
KEY = hashlib.sha256(PASSPHRASE.encode()).digest()
ANOTHER_KEY = hashlib.sha256(b"the key of another vehicle").digest()
GUARDED = "name=guarded&sign=radio&verify=radio&strip=true"
MAVPROXY = Path(sys.executable).with_name("mavproxy.py")
FAKETIME = next(Path("/usr/lib").glob("*/faketime/libfaketime.so.1"), None)
EPOCH = 1420070400


def now():
    """The time of signatures."""
    return int((time.time() - EPOCH) * 100_000)


class Signer(GroundStation):
    """A ground station whose signatures are of today."""

    def connect(self, endpoint, port):
        super().connect(endpoint, port)
        self.link.mav.signing.timestamp = now()


@pytest.fixture
def key_file(tmp_path):
    path = tmp_path / "radio.key"
    path.write_text(f"passphrase:{PASSPHRASE}\n")
    path.chmod(0o600)
    return path


@pytest.fixture(autouse=True)
def state_directory(tmp_path, monkeypatch):
    monkeypatch.setenv("STATE_DIRECTORY", str(tmp_path))


@pytest.fixture
def vehicle(stage, key_file):
    """A vehicle that knows nothing of signing, behind a gateway for those who do."""
    vehicle = Vehicle()
    stage.start_router(
        f"--key=radio={key_file}",
        f"udpin:127.0.0.1:0?{GUARDED}",
        "tcpin:127.0.0.1:0?name=wire",
    )
    join(stage, vehicle, "tcpin", "wire")
    return vehicle


def join(stage, peer, scheme, endpoint):
    peer.connect(scheme, stage.port(endpoint))
    stage.peers.append(peer)
    peer.greet()
    if peer.key in (None, KEY) and endpoint != "guarded" or peer.key == KEY:
        stage.until(f"{peer.name} to be seen", lambda: stage.has_seen(peer))
    return peer


def test_a_signed_session_passes_and_each_side_believes_the_other(stage, vehicle):
    ground = join(stage, Signer(key=KEY), "udpin", "guarded")
    ground.say("param_request_list", **vehicle.target)
    stage.until("the parameters", lambda: ground.parameters == PARAMETERS)
    assert not any(message.get_signed() for message in vehicle.heard)
    assert all(message.get_signed() for message in ground.heard)
    assert ground.refused == []
    signing = ground.link.mav.signing
    assert (signing.badsig_count, signing.unsigned_count, signing.reject_count) == (0, 0, 0)
    assert signing.goodsig_count == len(ground.heard)


@pytest.mark.parametrize("key", [None, ANOTHER_KEY])
def test_who_has_not_the_key_is_refused_and_hears_nothing(stage, vehicle, key):
    impostor = join(stage, Signer(254, 190, key=key) if key else GroundStation(254), "udpin", "guarded")
    impostor.say("param_request_list", **vehicle.target)
    stage.until("the refusal", lambda: stage.router.says("refused: .* not signed with the key"))
    ground = join(stage, Signer(key=KEY), "udpin", "guarded")
    ground.say("param_request_list", **vehicle.target)
    stage.until("the parameters", lambda: ground.parameters == PARAMETERS)
    assert vehicle.heard_from(impostor) == []
    assert impostor.heard == []


def test_a_known_peer_that_sends_unsigned_forged_old_or_repeated_frames_is_refused(stage, vehicle):
    ground = join(stage, Signer(key=KEY), "udpin", "guarded")
    signing = ground.link.mav.signing

    def raw(what):
        ground.link.write(what)

    ground.greet(1)
    replay = ground.said[-1]
    raw(replay)
    ground.link.mav.signing.sign_outgoing = False
    ground.greet(2)
    ground.say("radio_status", rssi=7, remrssi=7, txbuf=7, noise=7, remnoise=7, rxerrors=7, fixed=7)
    signing.sign_outgoing, signing.secret_key = True, ANOTHER_KEY
    ground.greet(3)
    signing.secret_key, signing.link_id = KEY, 9
    today, signing.timestamp = signing.timestamp, now() - 61 * 100_000
    ground.greet(4)
    signing.timestamp, signing.link_id = today, 1
    ground.greet(5)
    stage.until("the last", lambda: vehicle.has_heard_greeting(ground, 5))
    greetings = [m.custom_mode for m in vehicle.heard_from(ground) if m.get_type() == "HEARTBEAT"]
    assert greetings == [0, 1, 5]
    assert len(vehicle.heard_of("RADIO_STATUS")) == 1


def test_what_is_signed_is_believed_after_a_restart_with_the_clock_set_back(stage, vehicle, tmp_path):
    ground = join(stage, Signer(key=KEY), "udpin", "guarded")
    vehicle.greet(1)
    stage.until("a greeting", lambda: ground.has_heard_greeting(vehicle, 1))
    assert stage.router.stop() == 0
    state = tmp_path / "signing-time"
    used, shown = map(int, state.read_text().split())
    last = ground.link.mav.signing.stream_timestamps
    # As if a clock of the future had signed an hour ahead: to the router it is as if its own clock
    # had been set back by an hour.
    ahead = 3600 * 100_000
    for stream in last:
        last[stream] += ahead
    state.write_text(f"{used + ahead} {shown}\n")
    stage.peers.clear()
    key = tmp_path / "radio.key"
    stage.start_router(
        f"--key=radio={key}", f"udpin:127.0.0.1:0?{GUARDED}", "tcpin:127.0.0.1:0?name=wire"
    )
    # It remembers what it has heard.
    again = Signer(key=KEY)
    join(stage, again, "udpin", "guarded")
    again.link.mav.signing.stream_timestamps = last
    join(stage, vehicle, "tcpin", "wire")
    vehicle.greet(2)
    stage.until("a greeting", lambda: again.has_heard_greeting(vehicle, 2))
    assert again.link.mav.signing.reject_count == 0


@pytest.fixture
def clock(monkeypatch, tmp_path):
    """A clock for the router alone, set by what is written to this file: `-1h`."""
    file = tmp_path / "clock"
    file.write_text("+0\n")
    monkeypatch.setenv("LD_PRELOAD", str(FAKETIME))
    monkeypatch.setenv("FAKETIME_TIMESTAMP_FILE", str(file))
    monkeypatch.setenv("FAKETIME_NO_CACHE", "1")
    monkeypatch.setenv("FAKETIME_DONT_FAKE_MONOTONIC", "1")
    return file


@pytest.mark.skipif(FAKETIME is None, reason="libfaketime is not installed")
@pytest.mark.parametrize("setting", ["-1d", "@1970-01-01 00:00:10"])
def test_what_is_signed_is_believed_whatever_the_clock_of_the_computer_does(
    stage, key_file, clock, setting
):
    endpoints = f"udpin:127.0.0.1:0?{GUARDED}", "tcpin:127.0.0.1:0?name=wire"
    vehicle = Vehicle()
    stage.start_router(f"--key=radio={key_file}", *endpoints)
    join(stage, vehicle, "tcpin", "wire")
    ground = join(stage, Signer(key=KEY), "udpin", "guarded")
    vehicle.greet(1)
    stage.until("a greeting", lambda: ground.has_heard_greeting(vehicle, 1))
    # While it runs,
    clock.write_text(f"{setting}\n")
    vehicle.greet(2)
    stage.until("a greeting", lambda: ground.has_heard_greeting(vehicle, 2))
    assert stage.router.stop() == 0
    last = ground.link.mav.signing.stream_timestamps
    stage.peers.clear()
    # and when it starts.
    stage.start_router(f"--key=radio={key_file}", *endpoints)
    again = join(stage, Signer(key=KEY), "udpin", "guarded")
    again.link.mav.signing.stream_timestamps = last
    join(stage, vehicle, "tcpin", "wire")
    vehicle.greet(3)
    stage.until("a greeting", lambda: again.has_heard_greeting(vehicle, 3))
    assert ground.link.mav.signing.reject_count == again.link.mav.signing.reject_count == 0
    assert ground.refused == again.refused == []


@pytest.mark.skipif(not MAVPROXY.is_file(), reason="MAVProxy is not installed")
def test_mavproxy_signs_on_and_lists_the_parameters(stage, vehicle, tmp_path):
    vehicle.beat()
    home = tmp_path / "home"
    home.mkdir()
    mavproxy = stage.start(
        [
            sys.executable,
            MAVPROXY,
            f"--master=udpout:127.0.0.1:{stage.port('guarded')}",
            "--default-modules=link,signing,param",
            f"--cmd=signing key {PASSPHRASE}",
            "--non-interactive",
            f"--state-basedir={home}",
        ],
        cwd=home,
        env={**os.environ, "HOME": str(home), "PYTHONUNBUFFERED": "1"},
    )
    saved = r"Saved \d+ parameters to (\S+)"
    stage.until("MAVProxy to save them", lambda: mavproxy.says(saved) or mavproxy.ended)
    lines = (home / "mav.parm").read_text().splitlines()
    assert {name: float(value) for name, value in map(str.split, lines)} == PARAMETERS
