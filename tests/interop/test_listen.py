"""`mavswitch listen`: the fields it shows are those that pymavlink decodes."""

import json
import math
import random
import re
import socket

from conftest import ROOT
from pymavlink.dialects.v20 import common
from test_differential import frame

MESSAGES = ROOT / "src/mavlink/definitions/common.xml"
ROUNDS = 3
SEED = 30


def known_messages():
    """The messages whose fields are built in, but those that pymavlink knows otherwise."""
    ids = map(int, re.findall(r'<message id="(\d+)"', MESSAGES.read_text()))
    return [common.mavlink_map[id] for id in ids]


def same(ours, theirs):
    """Whether two values are one: what is no number is null in JSON, and text ends at a zero."""
    if isinstance(theirs, (list, tuple)):
        return len(ours) == len(theirs) and all(map(same, ours, theirs))
    if isinstance(theirs, float):
        if not math.isfinite(theirs):
            return ours is None
        return math.isclose(ours, theirs, rel_tol=1e-6, abs_tol=1e-45)
    return ours == theirs


def text_of(message, field):
    """The text of a field as it is to be shown: pymavlink drops what is no UTF-8 in its own way."""
    raw = getattr(message, f"_{field}_raw", None)
    return None if raw is None else bytes(raw).split(b"\0")[0].decode(errors="replace")


def test_fields_are_those_that_pymavlink_decodes(mavswitch, stage, tmp_path):
    rng = random.Random(SEED)
    frames = [frame(rng, message) for message in known_messages() * ROUNDS]
    stage.start_router("--control", tmp_path / "control", "tcpin:127.0.0.1:0?name=v", "udpin:127.0.0.1:0")
    count = ["-n", str(len(frames)), "--control", tmp_path / "control"]
    listener = stage.start([mavswitch, "listen", "--json", *count])
    stage.until("a listener", lambda: stage.router.says("somebody listens"))
    with socket.create_connection(("127.0.0.1", stage.port("v"))) as vehicle:
        vehicle.sendall(b"".join(frames))
        stage.until("all frames to be shown", lambda: listener.ended)
    assert len(listener.lines) == len(frames), listener
    parser = common.MAVLink(None)
    for line, sent in zip(map(json.loads, listener.lines), frames):
        assert bytes.fromhex(line["bytes"]) == sent
        message = parser.decode(bytearray(sent))
        assert (line["name"], line["seq"]) == (message.get_type(), message.get_seq())
        assert (line["system"], line["component"]) == (
            message.get_srcSystem(),
            message.get_srcComponent(),
        )
        # It may know fewer extensions than we do.
        assert set(message.fieldnames) <= set(line["fields"])
        for name in message.fieldnames:
            ours = line["fields"][name]
            text = text_of(message, name)
            theirs = getattr(message, name) if text is None else text
            assert same(ours, theirs), f"{message.get_type()}.{name}: {ours} and {theirs}"
