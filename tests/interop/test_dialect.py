"""Definition files: read as pymavlink reads them, and routed by when given with `--dialect`."""

import importlib.util
import subprocess
from pathlib import Path

import pymavlink
import pytest
from conftest import ROOT
from peers import GroundStation, assert_heard_byte_for_byte
from pymavlink.generator import mavgen, mavparse
from vehicle import Vehicle

# The definition files that pymavlink brings along.
SHIPPED = Path(pymavlink.__file__).parent / "dialects" / "v20"
DIALECT_NAMES = ["minimal", "common", "ardupilotmega", "paparazzi", "storm32", "ASLUAV", "all"]
TARGETS = ("target_system", "target_component")

PRIVATE = """<?xml version="1.0"?>
<mavlink>
  <include>{common}</include>
  <messages>
    <message id="49001" name="WINCH_ORDER">
      <description>Known to this file only.</description>
      <field type="uint8_t" name="target_component">Winch.</field>
      <field type="float" name="length">Line to let out.</field>
      <field type="uint8_t" name="target_system">System of the winch.</field>
      <field type="char[10]" name="reason">Why.</field>
    </message>
  </messages>
</mavlink>
"""


def rows(text):
    """The rows of a message table by (msgid, CRC_EXTRA), as far as they describe the message."""
    lines = [line.split("\t") for line in text.splitlines()[1:]]
    return {(int(line[0]), int(line[1])): line[2:7] for line in lines}


def printed_rows(mavswitch, file):
    return rows(subprocess.check_output([mavswitch, "dialect", file], text=True))


def rows_by_pymavlink(file):
    """What pymavlink's own reader makes of a definition file and all it includes."""
    found, waiting, seen = {}, [Path(file)], set()
    while waiting:
        path = waiting.pop()
        seen.add(path)
        definitions = mavparse.MAVXML(str(path), mavparse.PROTOCOL_2_0)
        waiting += {path.parent / name for name in definitions.include} - seen
        for message in definitions.message:
            offsets = {field.name: field.wire_offset for field in message.fields}
            if message.name == "MANUAL_CONTROL":
                # The one message whose target has another name.
                offsets["target_system"] = offsets["target"]
            found[message.id, message.crc_extra] = [
                message.name,
                str(message.wire_min_length),
                str(message.wire_length),
                *(str(offsets.get(target, -1)) for target in TARGETS),
            ]
    return found


@pytest.mark.parametrize("name", DIALECT_NAMES)
def test_a_file_is_read_as_pymavlink_reads_it(mavswitch, name):
    file = SHIPPED / f"{name}.xml"
    assert printed_rows(mavswitch, file) == rows_by_pymavlink(file)


@pytest.mark.parametrize("name", DIALECT_NAMES)
def test_a_file_prints_rows_of_the_built_in_table(mavswitch, name):
    table = rows((ROOT / "src/mavlink/messages.tsv").read_text())
    printed = printed_rows(mavswitch, SHIPPED / f"{name}.xml")
    # Extensions are appended to messages that stay the same otherwise: pymavlink's files may be
    # older than the table or newer, and where they are, name and base length tell.
    of_one_age = {pair for pair in printed if printed[pair][2] == table[pair][2]}
    assert {p: printed[p] for p in of_one_age} == {p: table[p] for p in of_one_age}
    assert {p: printed[p][:2] for p in printed} == {p: table[p][:2] for p in printed}
    assert len(of_one_age) > 0.9 * len(printed)


def test_a_private_message_is_routed_by_its_target(mavswitch, stage, tmp_path):
    file = tmp_path / "winch.xml"
    file.write_text(PRIVATE.format(common=SHIPPED / "common.xml"))
    winch = generated_module(file)
    vehicle = stage.peer(Vehicle(), "tcpin")
    ground = stage.peer(GroundStation(), "udpin")
    bystander = stage.peer(GroundStation(254), "udpin")
    for peer in stage.peers:
        peer.dialect = winch
    stage.open("--dialect", file)
    ground.say("winch_order", length=2.5, reason=b"test", **vehicle.target)
    stage.roll_call()
    assert [order.length for order in vehicle.heard_of("WINCH_ORDER")] == [2.5]
    assert bystander.heard_of("WINCH_ORDER") == []
    assert_heard_byte_for_byte(vehicle, ground)


def generated_module(file):
    """The code that pymavlink generates of a definition file."""
    options = mavgen.Opts(str(file.with_suffix("")), wire_protocol=mavparse.PROTOCOL_2_0)
    assert mavgen.mavgen(options, [str(file)])
    spec = importlib.util.spec_from_file_location("winch", file.with_suffix(".py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
