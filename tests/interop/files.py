"""MAVLink FTP as an autopilot answers it: files are opened, read piece by piece or in bursts, and closed."""

import struct
from dataclasses import dataclass, replace

TERMINATE, RESET, OPEN, READ, BURST = 1, 2, 4, 5, 15
ACK, NACK = 128, 129
END_OF_FILE, UNKNOWN_COMMAND, FILE_NOT_FOUND = 6, 7, 10

HEADER = struct.Struct("<HBBBBBBI")
# What a payload holds, and how many of them an autopilot sends unasked.
PIECE, PIECES = 239, 20


@dataclass
class Operation:
    """One request, or one answer to it."""

    seq: int
    session: int
    opcode: int
    request: int = 0
    is_last: int = 0
    offset: int = 0
    data: bytes = b""

    @classmethod
    def read(cls, payload):
        seq, session, opcode, size, request, is_last, _, offset = HEADER.unpack_from(payload)
        data = bytes(payload[HEADER.size : HEADER.size + size])
        return cls(seq, session, opcode, request, is_last, offset, data)

    def write(self):
        kind = (self.opcode, len(self.data), self.request, self.is_last, 0)
        return HEADER.pack(self.seq, self.session, *kind, self.offset) + self.data


class FileServer:
    """Hands out `files`, by name, one at a time."""

    def __init__(self):
        self.files = {}
        self._open = b""

    def answer(self, payload):
        """The payloads that answer one."""
        asked = Operation.read(bytes(payload))
        answer = replace(asked, seq=asked.seq + 1 & 0xFFFF, opcode=ACK, request=asked.opcode)
        return [each.write().ljust(251, b"\0") for each in self._answers(asked, answer)]

    def _answers(self, asked, answer):
        if asked.opcode in (TERMINATE, RESET):
            return [replace(answer, data=b"")]
        if asked.opcode == OPEN:
            content = self.files.get(asked.data.rstrip(b"\0").decode())
            if content is None:
                return [replace(answer, opcode=NACK, data=bytes([FILE_NOT_FOUND]))]
            self._open = content
            return [replace(answer, data=struct.pack("<I", len(content)))]
        if asked.opcode in (READ, BURST):
            return self._pieces(answer, PIECES if asked.opcode == BURST else 1)
        return [replace(answer, opcode=NACK, data=bytes([UNKNOWN_COMMAND]))]

    def _pieces(self, answer, count):
        end = min(len(self._open), answer.offset + PIECE * count)
        offsets = range(answer.offset, end, PIECE)
        if not offsets:
            return [replace(answer, opcode=NACK, data=bytes([END_OF_FILE]))]
        return [
            replace(
                answer,
                seq=answer.seq + number & 0xFFFF,
                is_last=int(offset == offsets[-1]),
                offset=offset,
                data=self._open[offset : offset + PIECE],
            )
            for number, offset in enumerate(offsets)
        ]
