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


def messages_of(log):
    """Where each message of a ULog begins, behind the header of the file."""
    at = 16
    while at < len(log):
        yield at
        at += 3 + struct.unpack_from("<H", log, at)[0]


def pieces_of(log):
    """The pieces of a ULog as PX4 sends them: each with where in it the first message begins."""
    starts = [0, *messages_of(log)]
    for at in range(0, len(log), 249):
        data = log[at : at + 249]
        first = next((start - at for start in starts if at <= start < at + len(data)), 255)
        yield data, first


class Flight:
    """A flight of a PX4, from the question for its log on."""

    def __init__(self, vehicle, log):
        self.vehicle = vehicle
        self.pieces = list(pieces_of(log))
        start = mavlink2.MAV_CMD_LOGGING_START
        asked = vehicle.wait_for("COMMAND_LONG", lambda it: it.command == start)
        self.logger = asked.get_srcSystem(), asked.get_srcComponent()

    def send(self, number, wants_ack):
        data, first = self.pieces[number]
        mav = self.vehicle.mav
        encode = mav.logging_data_acked_encode if wants_ack else mav.logging_data_encode
        padded = list(data.ljust(249, b"\0"))
        self.vehicle.send(encode(*self.logger, number, len(data), first, padded))
        if wants_ack:
            self.vehicle.wait_for("LOGGING_ACK", lambda ack: ack.sequence == number)

    def stream(self, numbers, lost=()):
        """The definitions are acknowledged, telemetry is not; the end is, so that all has arrived."""
        numbers = list(numbers)
        for number in numbers:
            if number not in lost:
                self.send(number, wants_ack=number < 3 or number == numbers[-1])


def beat(vehicle, autopilot, mode):
    kind = mavlink2.MAV_TYPE_QUADROTOR
    vehicle.send(vehicle.mav.heartbeat_encode(kind, autopilot, mode, 0, 4))


def heights(path):
    (topic,) = ulog_reader.ULog(path).data_list
    return list(topic.data["metres"])


def test_pyulog_reads_flights_with_dropouts_a_second_arming_and_a_restart(stage, tmp_path):
    records = start(
        stage, tmp_path, "--record-telemetry=false", "--flight-log=auto", "--record-when=armed"
    )
    autopilot = mavlink2.MAV_AUTOPILOT_PX4
    px4 = Vehicle(stage, "fc", 1, autopilot)
    log = ulog()
    pieces = len(list(pieces_of(log)))

    def disarm():
        beat(px4, autopilot, 0)
        stop = mavlink2.MAV_CMD_LOGGING_STOP
        px4.wait_for("COMMAND_LONG", lambda it: it.command == stop)
        px4.send(px4.mav.command_ack_encode(stop, mavlink2.MAV_RESULT_ACCEPTED))

    def boot(since_boot_ms):
        px4.send(px4.mav.system_time_encode(0, since_boot_ms))

    # Two pieces in a row and one by itself are lost; what comes behind them is held for half a
    # second, and taken when it is sure that they will not come.
    lost = {7, 8, 15}
    Flight(px4, log).stream(range(pieces), lost)
    disarm()
    # Armed again: a log of its own, whole.
    beat(px4, autopilot, ARMED)
    boot(90_000)
    Flight(px4, log).stream(range(pieces))
    disarm()
    # Armed, and in mid-flight the autopilot starts again: what it says next is another log.
    beat(px4, autopilot, ARMED)
    Flight(px4, log).stream(range(20))
    boot(1_000)
    Flight(px4, log).stream(range(pieces))
    stop(stage)
    with_gaps, whole, torn, after = sorted(records.glob("*.ulg"))
    every = [number / 2 for number in range(500)]
    assert open(whole, "rb").read() == open(after, "rb").read() == log
    assert heights(str(whole)) == every
    read = ulog_reader.ULog(str(with_gaps))
    assert len(read.dropouts) == 2 and all(dropout.duration > 0 for dropout in read.dropouts)
    left = heights(str(with_gaps))
    # A message is 17 bytes long: what three pieces hold is lost, and what reaches into them.
    missing = sorted(set(every) - set(left))
    assert left == sorted(left) and 3 * 249 // 17 <= len(missing) <= 3 * 249 // 17 + 4
    begun = heights(str(torn))
    assert begun == every[: len(begun)] and len(begun) > 200


def test_dfreader_reads_flights_with_a_lost_block_a_second_arming_and_a_restart(stage, tmp_path):
    records = start(
        stage, tmp_path, "--record-telemetry=false", "--flight-log=auto", "--record-when=armed"
    )
    autopilot = mavlink2.MAV_AUTOPILOT_ARDUPILOTMEGA
    ardupilot = Vehicle(stage, "fc", 1, autopilot)
    mav = ardupilot.mav
    log = dataflash()
    blocks = [list(log[at : at + 200]) for at in range(0, len(log), 200)]
    begin = ardupilotmega.MAV_REMOTE_LOG_DATA_BLOCK_START
    end = ardupilotmega.MAV_REMOTE_LOG_DATA_BLOCK_STOP
    acknowledged = ardupilotmega.MAV_REMOTE_LOG_DATA_BLOCK_ACK

    def status(number):
        return ardupilot.wait_for("REMOTE_LOG_BLOCK_STATUS", lambda it: it.seqno == number)

    def fly(numbers, lost=()):
        """Each block is sent until it is acknowledged, but for what the autopilot has forgotten."""
        asked = status(begin)
        logger = asked.get_srcSystem(), asked.get_srcComponent()
        for number in numbers:
            if number not in lost:
                ardupilot.send(mav.remote_log_data_block_encode(*logger, number, blocks[number]))
                while status(number).status != acknowledged:
                    pass

    beat(ardupilot, autopilot, ARMED)
    fly(range(len(blocks)), lost={20})
    beat(ardupilot, autopilot, 0)
    status(end)
    beat(ardupilot, autopilot, ARMED)
    ardupilot.send(mav.system_time_encode(0, 90_000))
    fly(range(30))
    # It starts again in mid-flight.
    ardupilot.send(mav.system_time_encode(0, 1_000))
    fly(range(len(blocks)))
    stop(stage)
    with_gap, torn, after = sorted(records.glob("*.bin"))
    assert open(with_gap, "rb").read() == log[: 20 * 200] + bytes(200) + log[21 * 200 :]
    assert open(torn, "rb").read() == log[: 30 * 200]
    assert open(after, "rb").read() == log
    every = heights_by_dfreader(after)
    assert every == [number / 2 for number in range(len(every))] and len(every) > 500
    begun = heights_by_dfreader(torn)
    assert begun == every[: len(begun)] and len(begun) > 300
    left = heights_by_dfreader(with_gap)
    # The message that reaches into the gap ends with zeros, and one may be made of its end.
    right = [height for height in left if height in every]
    torn_values = [at for at, height in enumerate(right[1:], 1) if height <= right[at - 1]]
    assert len(torn_values) <= 1
    missing = set(every) - set(left)
    assert 200 // 15 <= len(missing) <= 200 // 15 + 2


def heights_by_dfreader(path):
    reader = DFReader.DFReader_binary(str(path))
    found = []
    while (message := reader.recv_match(type="HGT")) is not None:
        found.append(message.Metres)
    return found
