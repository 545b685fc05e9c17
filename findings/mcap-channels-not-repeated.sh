#!/usr/bin/env bash
# An MCAP recording that does not repeat its channels at the end: mcap's own reader refuses it, rosbags finds it empty.
#
# MCAP lets a writer leave the copies of channels and schemas out of the summary; mcap's Python writer has repeat_channels
# and repeat_schemas for it. The guess before running it: a reader goes back to the records before the messages, where they
# stand as always.
# Seen: mcap's make_reader raises KeyError for the channel's number, without any message; its NonSeekingReader reads all.
# rosbags, given the same file as a ROS 2 bag, opens it, tells start, end and the number of messages, and yields none.
# For who writes bags on a small computer: leave the repetition on. What we do: `replay` reads from front to back, with or
# without.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" -q install --only-binary :all: mcap==1.6.0 rosbags==0.11.9
cd "$folder"
venv/bin/python - <<'PYTHON'
import importlib.metadata
import json
import pathlib
from mcap.reader import NonSeekingReader, make_reader
from mcap.writer import Writer
from rosbags.rosbag2 import Reader

for name in ("mcap", "rosbags"):
    print(name, importlib.metadata.version(name))


def record(name, **options):
    """A bag of three std_msgs/Int32; metadata.yaml is written as JSON, which is YAML."""
    folder = pathlib.Path(name)
    folder.mkdir()
    with open(folder / "bag.mcap", "wb") as file:
        writer = Writer(file, **options)
        writer.start("ros2", "findings")
        schema = writer.register_schema("std_msgs/msg/Int32", "ros2msg", b"int32 data")
        channel = writer.register_channel("/count", "cdr", schema, {"offered_qos_profiles": ""})
        for count in range(3):
            writer.add_message(channel, 10 + count, b"\0\1\0\0" + count.to_bytes(4, "little"), 10 + count)
        writer.finish()
    start, duration = {"nanoseconds_since_epoch": 10}, {"nanoseconds": 2}
    topic = {"name": "/count", "type": "std_msgs/msg/Int32", "serialization_format": "cdr", "offered_qos_profiles": ""}
    about = {
        "version": 5, "storage_identifier": "mcap", "starting_time": start, "duration": duration, "message_count": 3,
        "topics_with_message_count": [{"topic_metadata": topic, "message_count": 3}],
        "compression_format": "", "compression_mode": "", "relative_file_paths": ["bag.mcap"],
        "files": [{"path": "bag.mcap", "starting_time": start, "duration": duration, "message_count": 3}],
    }
    (folder / "metadata.yaml").write_text(json.dumps({"rosbag2_bagfile_information": about}))
    return folder


def by_mcap(folder, reader):
    with open(folder / "bag.mcap", "rb") as file:
        try:
            return len(list(reader(file).iter_messages()))
        except KeyError as error:
            return f"KeyError {error}"


def by_rosbags(folder):
    with Reader(folder) as reader:
        return reader.message_count, len(list(reader.messages()))


seen = {}
for name, options in {"both repeated": {}, "channels not": {"repeat_channels": False}, "schemas not": {"repeat_schemas": False}}.items():
    folder = record(name, **options)
    seen[name] = by_mcap(folder, make_reader), by_mcap(folder, NonSeekingReader), *by_rosbags(folder)
    print("{:14} make_reader: {}, NonSeekingReader: {}, rosbags: tells {} and yields {}".format(name, *seen[name]))
expected = {"both repeated": (3, 3, 3, 3), "channels not": ("KeyError 1", 3, 3, 0), "schemas not": ("KeyError 1", 3, 3, 0)}
raise SystemExit(0 if seen == expected else "it behaves otherwise now")
PYTHON
