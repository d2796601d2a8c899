"""The splitter against pymavlink's parser: the same streams, clean and damaged, of every dialect.

DIFFERENTIAL_FRAMES says how many clean frames (100,000).
"""

import importlib
import os
import pkgutil
import random
import struct
import subprocess
from collections import Counter

import pymavlink.dialects.v20 as published
import pytest
from fastcrc.crc16 import mcrf4xx

FRAMES = int(os.environ.get("DIFFERENTIAL_FRAMES", "100000"))
USUAL_SEED = 2012
SEED = int(os.environ.get("DIFFERENTIAL_SEED", USUAL_SEED))
DIALECTS = sorted(module.name for module in pkgutil.iter_modules(published.__path__))


@pytest.fixture(scope="module")
def split(mavswitch):
    """Cuts a stream with the splitter: a list of (frame, whether its check was a full one)."""
    for profile in ("release", "debug"):
        program = mavswitch.parent.parent / profile / "examples" / "split"
        if program.is_file():
            return lambda stream: list(read_frames(program, stream))
    pytest.fail("no examples/split beside the binary: run `cargo build --example split`")


def read_frames(program, stream):
    output = subprocess.run([program], input=stream, stdout=subprocess.PIPE, check=True).stdout
    at = 0
    while at < len(output):
        length, verified = struct.unpack_from("<HB", output, at)
        yield output[at + 3 : at + 3 + length], bool(verified)
        at += 3 + length


def dialect(name):
    return importlib.import_module(f"pymavlink.dialects.v20.{name}")


def frame(rng, message):
    """One frame of a message with any payload: MAVLink 1 or 2, trimmed or not, signed or not."""
    payload = rng.randbytes(message.unpacker.size)
    seq, system, component = rng.randrange(256), rng.randrange(1, 256), rng.randrange(1, 256)
    if message.id < 256 and rng.random() < 0.3:
        start = bytes([0xFE, len(payload), seq, system, component, message.id])
        signature = b""
    else:
        if rng.random() < 0.5:
            payload = payload[: rng.randrange(1, len(payload) + 1)].rstrip(b"\0") or b"\0"
        signature = rng.randbytes(13) if rng.random() < 0.1 else b""
        start = bytes([0xFD, len(payload), bool(signature), 0, seq, system, component])
        start += message.id.to_bytes(3, "little")
    checksum = mcrf4xx((start + payload)[1:] + bytes([message.crc_extra]))
    return start + payload + struct.pack("<H", checksum) + signature


def frames_of(name, count):
    rng = random.Random(f"{SEED} {name}")
    messages = list(dialect(name).mavlink_map.values())
    # Every message at least once, then any.
    chosen = messages + rng.choices(messages, k=max(0, count - len(messages)))
    return [frame(rng, message) for message in chosen]


def by_pymavlink(name, stream):
    """The frames that pymavlink takes from a stream, as bytes."""
    mavlink = dialect(name).MAVLink(None)
    mavlink.robust_parsing = True
    taken = []
    for at in range(0, len(stream), 4096):
        for message in mavlink.parse_buffer(stream[at : at + 4096]) or []:
            if message.get_type() != "BAD_DATA":
                taken.append(bytes(message.get_msgbuf()))
    return taken


def damaged(frames, rng):
    """One frame in ten torn, bent, or with noise before it; and those that were left whole."""
    stream, whole = bytearray(), []
    for each in frames:
        fate = rng.random()
        if fate < 0.03:
            stream += each[: rng.randrange(len(each))]
        elif fate < 0.06:
            bent = bytearray(each)
            bent[rng.randrange(len(bent))] ^= 1 << rng.randrange(8)
            stream += bent
        elif fate < 0.1:
            stream += rng.randbytes(rng.randrange(1, 40)) + each
            whole.append(each)
        else:
            stream += each
            whole.append(each)
    return bytes(stream), whole


def unsigned(frames):
    """Without the signatures, which no checksum covers."""
    return Counter(each[: 12 + each[1]] if each[0] == 0xFD else each for each in frames.elements())


@pytest.mark.parametrize("name", DIALECTS)
def test_clean_frames_of_every_dialect_are_cut_as_pymavlink_cuts_them(split, name):
    frames = frames_of(name, FRAMES // len(DIALECTS))
    stream = b"".join(frames)
    ours = split(stream)
    assert [each for each, _ in ours] == frames
    assert all(verified for _, verified in ours), "each is checked in full"
    assert by_pymavlink(name, stream) == frames


@pytest.mark.parametrize("name", ["common", "ardupilotmega", "all"])
def test_from_a_damaged_stream_no_less_comes_than_from_pymavlink_and_nothing_false(split, name):
    rng = random.Random(f"{SEED} damaged {name}")
    frames = frames_of(name, max(5_000, FRAMES // 10))
    stream, whole = damaged(frames, rng)
    wanted, real = Counter(whole), Counter(frames)
    ours = Counter(each for each, verified in split(stream) if verified)
    theirs = Counter(by_pymavlink(name, stream))
    assert (ours & wanted).total() >= (theirs & wanted).total()
    false = (unsigned(ours) - unsigned(real)).total()
    # Some thousand candidates begin in the wreckage, and each has one chance in 65,536 to pass a full
    # check of 16 bits. With the usual seed none has it; any other one may be lucky once or twice.
    assert false <= (0 if SEED == USUAL_SEED else 2 + len(frames) // 5_000), f"{false} false frames"
    print(f"{name}: {wanted.total()} whole, {(ours & wanted).total()} found, "
          f"{(theirs & wanted).total()} by pymavlink; {false} false")
