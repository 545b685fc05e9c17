#!/usr/bin/env bash
# rosbags finds an MCAP bag without message indexes empty.
#
# Behind each chunk of messages an MCAP file may have an index of them, or not: a writer on a small computer saves memory
# without. The guess before running it: rosbags unpacks the chunks and sorts what is in them, as it needs to for the order
# of times anyway.
# Seen: it tells start, end and the number of messages from metadata.yaml, and yields none, without a word. Without any
# chunk index it does read the file, as long as the messages stand in order of time, and says so where they do not. mcap's
# reader reads all three.
# For who finds a bag empty: look at it with `mcap`'s reader. What we do: `replay` reads from front to back and needs no
# index.
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
from mcap.reader import make_reader
from mcap.writer import IndexType, Writer
from rosbags.rosbag2 import Reader, ReaderError

for name in ("mcap", "rosbags"):
    print(name, importlib.metadata.version(name))


def record(name, times, index):
    """A bag of three std_msgs/Int32; metadata.yaml is written as JSON, which is YAML."""
    folder = pathlib.Path(name)
    folder.mkdir()
    with open(folder / "bag.mcap", "wb") as file:
        writer = Writer(file, index_types=index)
        writer.start("ros2", "findings")
        schema = writer.register_schema("std_msgs/msg/Int32", "ros2msg", b"int32 data")
        channel = writer.register_channel("/count", "cdr", schema, {"offered_qos_profiles": ""})
        for time in times:
            writer.add_message(channel, time, b"\0\1\0\0" + time.to_bytes(4, "little"), time)
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


def by_mcap(folder):
    with open(folder / "bag.mcap", "rb") as file:
        return [message.log_time for _, _, message in make_reader(file).iter_messages()]


def by_rosbags(folder):
    with Reader(folder) as reader:
        assert reader.message_count == 3
        try:
            return [time for _, time, _ in reader.messages()]
        except ReaderError as error:
            return str(error)


seen = {}
for order, times in {"in order": (10, 11, 12), "not in order": (10, 12, 11)}.items():
    for name, index in {"all indexes": IndexType.ALL, "no message index": IndexType.CHUNK, "no index": IndexType.NONE}.items():
        folder = record(f"{order}, {name}", times, index)
        seen[order, name] = by_rosbags(folder)
        assert by_mcap(folder) == [10, 11, 12]
        print(f"{order}, {name}: rosbags yields {seen[order, name]}")
sorted_times = [10, 11, 12]
expected = [sorted_times, [], sorted_times, sorted_times, []]
values = list(seen.values())
right = values[:5] == expected and "not in timestamp order" in values[5]
raise SystemExit(0 if right else "it behaves otherwise now")
PYTHON
