#!/usr/bin/env bash
# mcap-ros2-support fits arrays to the message's definition without a word: a covariance of 9 values becomes one of 36.
#
# ROS 2's odometry has covariances of exactly 36 values (float64[36]). The guess before running it: the writer refuses a
# list of another length, as ROS 2's own Python messages do.
# Seen: a short one is filled up with zeros, the caller's own list with it, and a long one is cut. Nine values (x, y,
# heading of a planar robot) so become the first row and a half: the variance of y is read as a covariance, and all
# variances but x's are 0, "known exactly". A sequence with an upper bound is cut to it; a string with one is written whole.
# For who writes bags from Python: compare the lengths with the definition before; a filter that is told 0 will believe it.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" -q install --only-binary :all: mcap==1.6.0 mcap-ros2-support==0.6.0
"$folder/venv/bin/python" - <<'PYTHON'
import importlib.metadata
import io
from mcap_ros2.reader import read_ros2_messages
from mcap_ros2.writer import Writer

for name in ("mcap", "mcap-ros2-support"):
    print(name, importlib.metadata.version(name))


def through(definition, value):
    file = io.BytesIO()
    writer = Writer(file)
    writer.write_message("/topic", writer.register_msgdef("findings_msgs/msg/Test", definition), {"value": value})
    writer.finish()
    file.seek(0)
    return next(iter(read_ros2_messages(file))).ros_msg.value


planar = [0.04, 0.0, 0.0, 0.0, 0.04, 0.0, 0.0, 0.0, 0.01]
given = list(planar)
covariance = through("float64[36] value", given)
print("float64[36] from 9 values:", len(covariance), "values, diagonal", [covariance[7 * k] for k in range(6)], "; the caller's list now has", len(given))
seen = {
    "float64[3] from 2": through("float64[3] value", [1, 2]),
    "float64[3] from 5": through("float64[3] value", [1, 2, 3, 4, 5]),
    "int32[<=2] from 3": through("int32[<=2] value", [1, 2, 3]),
    "string<=2 from abc": through("string<=2 value", "abc"),
}
for name, value in seen.items():
    print(f"{name}: {value}")
right = len(given) == 36 and covariance == planar + [0.0] * 27
right &= list(seen.values()) == [[1, 2, 0], [1, 2, 3], [1, 2], "abc"]
raise SystemExit(0 if right else "it behaves otherwise now")
PYTHON
