#!/usr/bin/env python3
"""Reads what a board with beamfix sends and writes the commands that it understands. One file, Python 3.8 or later.

    python3 beamfix_link.py /dev/ttyACM0          a line for every message (needs pyserial)
    python3 beamfix_link.py FILE                  the same of a recorded file, or of - (standard input)
    python3 beamfix_link.py --json FILE           a line of JSON for every message

    import beamfix_link
    link = beamfix_link.Receiver()
    for message in link.push(serial.read(256)):
        if message.kind == "Pose":
            print(message["pose"], message["verdict"])
    serial.write(beamfix_link.wheels(x, y, theta))     # m, m, rad

The format is docs/telemetry.md. Poses are forward, left (m) and heading (rad, counter-clockwise). This file reads VERSION, and messages of
later versions as far as they have not changed; `Receiver.version` is what the board said at its start.
"""

import json
import struct
import sys

VERSION = 8

VERDICTS = [
    "Measured", "Keyframe", "First", "TooFewBeams", "TooFewLines", "TooFewCorrespondences", "Degenerate", "NotConverged",
    "Ambiguous", "TooFar", "Refused", "NothingFound", "Unlikely", "BadGuess", "BadConfig",
    "Doubtful", "Searching", "Choosing",
]
RESETS = ["Power", "Watchdog", "Other", "Asked"]
LIDAR_STATES = ["Unknown", "Silent", "Noise", "Standing", "Turning", "Blind", "Starting", "Defective"]
TASKS = ["Odometry", "Localization"]
MOTOR_STATES = ["Free", "SpinningUp", "Steady", "Off"]


# How each message is laid out. u8, bool: a byte; u16, u32: a varint; f32: four bytes; a list of names: a varint that numbers them;
# ("array", n, of), ("list", of), text: a list of u8, ("option", of), ("result", ok, error), {name: of} for what has fields.
_WEAK = {"direction": ("array", 3, "f32"), "sigma": "f32", "lever": "f32"}
_FOUND = {
    "score": "f32", "inliers": "u16", "overlap": "u16", "beams": "u16", "residual": "f32", "covariance": ("array", 6, "f32"),
    "weak": ("option", _WEAK), "iterations": "u8", "starts": "u8", "rival": "f32",
}
MESSAGES = [
    ("Ready", {"version": "u8", "beams": "u16", "reset": RESETS,
               "mount": {"pose": ("array", 3, "f32"), "upside_down": "bool"}, "lidar": "text", "task": TASKS}),
    ("Pose", {"sequence": "u16", "time_us": "u32", "pose": ("array", 3, "f32"), "covariance": ("array", 6, "f32"),
              "verdict": VERDICTS, "inliers": "u16", "beams": "u16", "residual": "f32"}),
    ("Health", {"packets": "u32", "check_errors": "u32", "skipped_bytes": "u32", "beams_refused": "u32",
                "matches_refused": "u32", "commands": "u32", "command_errors": "u32", "bytes_lost": "u32",
                "lidar": LIDAR_STATES, "motor": MOTOR_STATES, "motor_restarts": "u8"}),
    ("Cost", {"instructions": "u32", "stack_bytes": "u32"}),
    ("Raw", {"time_us": "u32", "bytes": ("list", "u8")}),
    ("Scan", {"turn_start": ("option", "u8"), "first": "u16", "last": "u16", "ranges_mm": ("list", "u16")}),
    ("Truth", {"sequence": "u16", "pose": ("array", 3, "f32")}),
    ("Quality", {"sequence": "u16", "verdict": VERDICTS, "found": ("result", _FOUND, ("array", 2, "f32"))}),
    ("Wheels", {"time_us": "u32", "pose": ("array", 3, "f32")}),
    ("Gyro", {"time_us": "u32", "rate": "f32"}),
    ("Zero", {"time_us": "u32", "zero_cdeg": "u16"}),
]


class Unreadable(ValueError):
    """A message that is none of this version's."""


class Message(dict):
    """The fields of a message; `kind` is its name."""

    def __init__(self, kind, fields):
        super().__init__(fields)
        self.kind = kind


def checksum(data):
    """CRC-16/CCITT-FALSE: polynomial 0x1021, start 0xFFFF, not reflected."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1 ^ 0x1021 if crc & 0x8000 else crc << 1) & 0xFFFF
    return crc


def stuffed(data):
    """COBS: `data` without a zero byte, one byte longer for each 254."""
    out, block = bytearray(), bytearray()
    for byte in data:
        if byte:
            block.append(byte)
        if not byte or len(block) == 254:
            out += bytes([len(block) + 1]) + block
            full = byte and len(block) == 254
            block.clear()
            if full:
                continue
    out += bytes([len(block) + 1]) + block
    return bytes(out)


def unstuffed(frame):
    """What was stuffed into `frame`, which has no zero byte."""
    out, at = bytearray(), 0
    while at < len(frame):
        code = frame[at]
        block = frame[at + 1 : at + code]
        if code == 0 or len(block) != code - 1:
            raise Unreadable("a frame is cut")
        out += block
        at += code
        if code < 255 and at < len(frame):
            out.append(0)
    return bytes(out)


class _Reader:
    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, count):
        piece = self.data[self.at : self.at + count]
        if len(piece) < count:
            raise Unreadable("a message is cut")
        self.at += count
        return piece

    def varint(self, bits):
        value = shift = 0
        while True:
            byte = self.take(1)[0]
            value |= (byte & 0x7F) << shift
            shift += 7
            if not byte & 0x80:
                break
            if shift > bits:
                raise Unreadable("a number is too long")
        if value >> bits:
            raise Unreadable("a number is too large")
        return value

    def read(self, layout):
        if isinstance(layout, dict):
            return {name: self.read(of) for name, of in layout.items()}
        if isinstance(layout, list):
            number = self.varint(32)
            if number >= len(layout):
                raise Unreadable("a name of a later version: number %d" % number)
            return layout[number]
        if isinstance(layout, tuple):
            kind = layout[0]
            if kind == "array":
                return [self.read(layout[2]) for _ in range(layout[1])]
            if kind == "list":
                return [self.read(layout[1]) for _ in range(self.varint(32))]
            if kind == "option":
                return self.read(layout[1]) if self.read("bool") else None
            number = self.varint(32)
            return {["Ok", "Err"][number]: self.read(layout[1 + number])} if number < 2 else self.read([])
        if layout == "text":
            return bytes(self.take(self.varint(32))).decode("utf-8", "replace")
        if layout == "f32":
            return struct.unpack("<f", self.take(4))[0]
        if layout in ("u16", "u32"):
            return self.varint(int(layout[1:]))
        byte = self.take(1)[0]
        if layout == "bool":
            if byte > 1:
                raise Unreadable("neither yes nor no")
            return byte == 1
        return byte


def message(plain):
    """The message of these bytes, without framing; raises Unreadable."""
    reader = _Reader(plain)
    number = reader.varint(32)
    if number >= len(MESSAGES):
        raise Unreadable("a message of a later version: number %d" % number)
    kind, layout = MESSAGES[number]
    return Message(kind, reader.read(layout))


class Receiver:
    """Takes bytes as they come, in pieces of any size."""

    def __init__(self):
        self.rest = bytearray()
        #: Frames whose check code was right, frames that were damaged, messages of a later version.
        self.frames = self.errors = self.unreadable = 0
        #: What the board said at its start; None before.
        self.version = None

    def push(self, data):
        """Takes bytes; gives the messages that they complete."""
        self.rest += data
        *frames, self.rest = self.rest.split(b"\0")
        messages = []
        for frame in frames:
            if not frame:
                continue
            try:
                plain = unstuffed(frame)
            except Unreadable:
                plain = b""
            if len(plain) < 2 or checksum(plain[:-2]) != int.from_bytes(plain[-2:], "little"):
                self.errors += 1
                continue
            self.frames += 1
            try:
                one = message(plain[:-2])
            except Unreadable:
                self.unreadable += 1
                continue
            if one.kind == "Ready":
                self.version = one["version"]
            messages.append(one)
        return messages


def _varint(value):
    out = bytearray()
    while value >= 0x80:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def frame(plain):
    """A message's bytes, framed."""
    return stuffed(plain + checksum(plain).to_bytes(2, "little")) + b"\0"


def wheels(x, y, theta):
    """The command that tells the robot's pose by its wheels now: forward, left (m), heading (rad). Two a second or more."""
    return frame(b"\0" + struct.pack("<fff", x, y, theta))


def lidar(data):
    """The command that hands over bytes of the lidar, at most 94."""
    if len(data) > 94:
        raise ValueError("at most 94 bytes")
    return frame(b"\1" + _varint(len(data)) + bytes(data))


def ask_health():
    """The command that asks for Health."""
    return frame(b"\3")


def send(raw=False, scans=False, quality=False):
    """The command that switches what is sent besides poses and health."""
    return frame(bytes([4, raw, scans, quality]))


def gyro(rate):
    """The command that tells the robot's rate of turn now, counter-clockwise (rad/s). Twenty a second or more."""
    return frame(b"\5" + struct.pack("<f", rate))


def start_at(x, y, theta):
    """The command that tells where the robot is in the map: m, m, rad."""
    return frame(b"\6" + struct.pack("<fff", x, y, theta))


def ask_ready():
    """The command that asks for Ready, for who comes after the board's start; boards before version 7 do not answer."""
    return frame(b"\7")


def choose(name):
    """The command that tells which lidar hangs on the board, for a board that has a choice; others leave it out."""
    data = name.encode()
    return frame(bytes([8]) + _varint(len(data)) + data)


def main(arguments):
    as_json = "--json" in arguments
    names = [name for name in arguments if name != "--json"]
    if len(names) != 1:
        sys.exit("usage: beamfix_link.py [--json] PORT|FILE|-")
    if names[0].startswith("/dev/tty") or names[0].upper().startswith("COM"):
        import serial  # pyserial

        port = serial.Serial(names[0], 921600, timeout=0.1)
        read = lambda: port.read(max(1, port.in_waiting)) or None
    else:
        source = sys.stdin.buffer if names[0] == "-" else open(names[0], "rb")
        read = lambda: source.read(4096)
    receiver = Receiver()
    while True:
        data = read()
        if data == b"":
            break
        for one in receiver.push(data or b""):
            print(json.dumps({one.kind: one}) if as_json else "%s %s" % (one.kind, dict(one)))
    print(
        "%d frames, %d damaged, %d of a later version" % (receiver.frames, receiver.errors, receiver.unreadable),
        file=sys.stderr,
    )


if __name__ == "__main__":
    main(sys.argv[1:])
