#!/usr/bin/env bash
# Cyclone DDS's Python package writes a numpy array of one zero as a sequence of one value without the value.
#
# A LaserScan's ranges are a sequence of floats, and in Python they come as a numpy array. The guess before running it: a
# sequence takes numpy arrays as an IDL array does, whatever their length.
# Seen: an IDL array takes them; a sequence takes exactly those of one value. Of two and more, and an empty one, it raises.
# One value that is not 0 is written right; [0.0], a single range without a return, is written as "1 value follows" and
# nothing follows: a message that no reader can read, its own included. Lists, tuples and array.array are right at every
# length.
# For who publishes scans from Python: give sequences `ranges.tolist()` or array.array("f", ranges).
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" -q install --only-binary :all: cyclonedds==11.0.1 numpy==2.4.6
"$folder/venv/bin/python" - <<'PYTHON'
import array
import importlib.metadata
import struct
from dataclasses import dataclass
import numpy as np
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array as idl_array, float32, sequence

print("cyclonedds", importlib.metadata.version("cyclonedds"), "numpy", np.__version__)


@dataclass
class Scan(IdlStruct, typename="findings::Scan"):
    ranges: sequence[float32]


@dataclass
class Fixed(IdlStruct, typename="findings::Fixed"):
    ranges: idl_array[float32, 3]


def through(kind, ranges):
    try:
        wire = kind(ranges).serialize()
    except Exception as error:
        return f"not written: {error}"
    try:
        return kind.deserialize(wire).ranges
    except struct.error:
        return "not readable: " + wire.hex()


floats = lambda *values: np.array(values, np.float32)
seen = {
    "IDL array of 3, numpy": through(Fixed, floats(1, 2, 3)),
    "sequence, list of 3": through(Scan, [1.0, 2.0, 3.0]),
    "sequence, array.array of 3": through(Scan, array.array("f", [1, 2, 3])),
    "sequence, numpy of 3": through(Scan, floats(1, 2, 3)),
    "sequence, numpy of 0": through(Scan, floats()),
    "sequence, numpy [1.5]": through(Scan, floats(1.5)),
    "sequence, numpy [0.0]": through(Scan, floats(0)),
    "sequence, list [0.0]": through(Scan, [0.0]),
}
for name, value in seen.items():
    print(f"{name:27} {value}")
values = list(seen.values())
right = values[:3] == [[1, 2, 3]] * 3 and all(value.startswith("not written") for value in values[3:5])
right &= values[5] == [1.5] and values[6] == "not readable: 0001000001000000" and values[7] == [0]
raise SystemExit(0 if right else "it behaves otherwise now")
PYTHON
