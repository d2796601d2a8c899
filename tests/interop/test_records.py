"""What the router records is read by the programs that others read such files with: telemetry logs by
pymavlink, ULog by pyulog, DataFlash logs by pymavlink's DFReader.
"""

import socket
import struct

import pytest
from peers import mavlink2
from pymavlink import DFReader, mavutil
from pymavlink.dialects.v20 import ardupilotmega

ulog_reader = pytest.importorskip("pyulog")

ARMED = mavlink2.MAV_MODE_FLAG_SAFETY_ARMED


class Vehicle:
    """A flight stack at a TCP endpoint of the router, one message at a time."""

    def __init__(self, stage, endpoint, system, autopilot):
        self.socket = socket.create_connection(("127.0.0.1", stage.port(endpoint)))
        self.socket.settimeout(60)
        self.mav = ardupilotmega.MAVLink(None, system, 1)
        self.mav.robust_parsing = True
        self.heard = []
        kind = mavlink2.MAV_TYPE_QUADROTOR
        self.send(self.mav.heartbeat_encode(kind, autopilot, ARMED, 0, 4))

    def send(self, message):
        frame = message.pack(self.mav)
        self.socket.sendall(frame)
        return bytes(frame)

    def wait_for(self, kind, is_it=lambda message: True):
        """The next message of a kind."""
        while True:
            while self.heard:
                message = self.heard.pop(0)
                if message.get_type() == kind and is_it(message):
                    return message
            data = self.socket.recv(65536)
            assert data, "the router has closed the connection"
            self.heard += self.mav.parse_buffer(data) or []


def start(stage, tmp_path, *arguments):
    records = tmp_path / "records"
    arguments = ["--record", records, "--record-min-free=0", *arguments]
    stage.start_router(*map(str, arguments), "tcpin:127.0.0.1:0?name=fc", "tcpin:127.0.0.1:0?name=gcs")
    return records


def stop(stage):
    """Ends the router in good order: what waits is written."""
    router, stage.router = stage.router, None
    stage.programs.remove(router)
    assert router.stop() == 0, router


def only_file(records, extension):
    (path,) = records.glob(f"*.{extension}")
    return str(path)


def test_pymavlink_reads_every_record(stage, tmp_path):
    records = start(stage, tmp_path)
    vehicle = Vehicle(stage, "fc", 1, mavlink2.MAV_AUTOPILOT_PX4)
    mav = vehicle.mav
    sent = []
    for number in range(200):
        sent.append(vehicle.send(mav.attitude_encode(number, 0.1, 0.2, 0.3, 0, 0, 0)))
        # Nobody is there to hear it, and it is recorded all the same.
        sent.append(vehicle.send(mav.command_long_encode(9, 1, 512, 0, number, 0, 0, 0, 0, 0, 0)))
    gcs = Vehicle(stage, "gcs", 255, mavlink2.MAV_AUTOPILOT_INVALID)
    # What the vehicle has sent before is with the router when this comes back.
    gcs.send(gcs.mav.ping_encode(1, 1, 0, 0))
    vehicle.wait_for("PING")
    stop(stage)
    log = mavutil.mavlink_connection(only_file(records, "tlog"))
    read, times = [], []
    while (message := log.recv_match(type=["ATTITUDE", "COMMAND_LONG"])) is not None:
        read.append(bytes(message.get_msgbuf()))
        times.append(message._timestamp)
    assert read == sent
    assert times == sorted(times)


def ulog():
    """A small log of a topic with two fields."""
    def message(kind, payload):
        return struct.pack("<HB", len(payload), ord(kind)) + payload

    log = b"\x55\x4c\x6f\x67\x01\x12\x35\x01" + struct.pack("<Q", 1000)
    log += message("B", bytes(40))
    log += message("F", b"height:uint64_t timestamp;float metres;")
    log += message("A", struct.pack("<BH", 0, 7) + b"height")
    for number in range(500):
        log += message("D", struct.pack("<HQf", 7, 1000 + number, number / 2))
    return log


def test_pyulog_reads_what_a_px4_has_sent(stage, tmp_path):
    records = start(stage, tmp_path, "--record-telemetry=false", "--flight-log=auto")
    px4 = Vehicle(stage, "fc", 1, mavlink2.MAV_AUTOPILOT_PX4)
    mav = px4.mav
    command = px4.wait_for("COMMAND_LONG")
    assert (command.command, command.target_system) == (mavlink2.MAV_CMD_LOGGING_START, 1)
    logger = command.get_srcSystem(), command.get_srcComponent()
    log = ulog()
    for number, at in enumerate(range(0, len(log), 249)):
        piece = log[at : at + 249]
        data = list(piece.ljust(249, b"\0"))
        px4.send(mav.logging_data_acked_encode(*logger, number, len(piece), 0, data))
        px4.wait_for("LOGGING_ACK", lambda ack, number=number: ack.sequence == number)
    stop(stage)
    path = only_file(records, "ulg")
    assert open(path, "rb").read() == log
    (topic,) = ulog_reader.ULog(path).data_list
    assert topic.name == "height"
    assert list(topic.data["metres"]) == [number / 2 for number in range(500)]


def dataflash():
    """A small log of one message, in whole blocks."""
    def format_of(kind, length, name, types, labels):
        fields = struct.pack("<BB4s16s64s", kind, length, name, types, labels)
        return b"\xa3\x95\x80" + fields

    log = format_of(128, 89, b"FMT", b"BBnNZ", b"Type,Length,Name,Format,Columns")
    log += format_of(1, 15, b"HGT", b"Qf", b"TimeUS,Metres")
    for number in range(600):
        log += b"\xa3\x95\x01" + struct.pack("<Qf", 1000 * number, number / 2)
    return log[: len(log) // 200 * 200]


def test_dfreader_reads_what_an_ardupilot_has_sent(stage, tmp_path):
    records = start(stage, tmp_path, "--record-telemetry=false", "--flight-log=auto")
    ardupilot = Vehicle(stage, "fc", 1, mavlink2.MAV_AUTOPILOT_ARDUPILOTMEGA)
    mav = ardupilot.mav
    status = ardupilot.wait_for("REMOTE_LOG_BLOCK_STATUS")
    assert status.seqno == ardupilotmega.MAV_REMOTE_LOG_DATA_BLOCK_START
    logger = status.get_srcSystem(), status.get_srcComponent()
    log = dataflash()
    blocks = [list(log[at : at + 200]) for at in range(0, len(log), 200)]

    def send(number):
        ardupilot.send(mav.remote_log_data_block_encode(*logger, number, blocks[number]))

    # Every third is lost at first, but not the last one: nothing comes after that.
    lost = set(range(2, len(blocks) - 1, 3))
    for number in sorted(set(range(len(blocks))) - lost):
        send(number)
    acknowledged = set()
    while len(acknowledged) < len(blocks):
        status = ardupilot.wait_for("REMOTE_LOG_BLOCK_STATUS", lambda it: it.seqno < len(blocks))
        if status.status == ardupilotmega.MAV_REMOTE_LOG_DATA_BLOCK_ACK:
            acknowledged.add(status.seqno)
        else:
            assert status.seqno in lost
            send(status.seqno)
    stop(stage)
    path = only_file(records, "bin")
    assert open(path, "rb").read() == log
    reader = DFReader.DFReader_binary(path)
    heights = []
    while (message := reader.recv_match(type="HGT")) is not None:
        heights.append(message.Metres)
    assert heights == [number / 2 for number in range(len(heights))] and len(heights) > 500
