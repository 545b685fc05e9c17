#!/usr/bin/env bash
# Cyclone DDS matches a reader and a writer of different type names when their members agree: it does not notice a wrong ROS 2 name.
#
# ROS 2's types go by mangled names on the wire: sensor_msgs::msg::dds_::Range_. Who writes a bridge tests it with Cyclone
# DDS's Python package. The guess before running it: a writer that leaves `dds_` and the underscores out, or tells another
# message's name, is not matched.
# Seen: it is matched and its samples arrive: both ends tell their types' structure, and where both do the name does not
# count. What counts is each member's name, type and place: a member `min` instead of `min_range`, or a double for a float,
# and there is no match, no sample and no error.
# For who bridges to ROS 2: a test between two Cyclone ends proves the members, not the name; compare the name as text with
# what ROS 2 uses, for a peer that tells no structure has nothing else to go by.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" -q install --only-binary :all: cyclonedds==11.0.1
cat > "$folder/loopback.xml" <<'XML'
<CycloneDDS><Domain>
  <General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces></General>
  <Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="localhost"/></Peers></Discovery>
</Domain></CycloneDDS>
XML
CYCLONEDDS_URI="file://$folder/loopback.xml" "$folder/venv/bin/python" - <<'PYTHON'
import importlib.metadata
import time
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import make_idl_struct
from cyclonedds.idl.types import float32, float64, uint8
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

print("cyclonedds", importlib.metadata.version("cyclonedds"))
QOS = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.Durability.TransientLocal)
MEMBERS = {"radiation_type": uint8, "min_range": float32, "range": float32}
RANGE = make_idl_struct("Range", "sensor_msgs::msg::dds_::Range_", MEMBERS)
writer_side, reader_side = DomainParticipant(47), DomainParticipant(47)


def through(topic, name, members):
    """How many readers the writer sees, and what the reader gets."""
    other = make_idl_struct("Range", name, members)
    writer = DataWriter(writer_side, Topic(writer_side, f"rt/{topic}", other), qos=QOS)
    reader = DataReader(reader_side, Topic(reader_side, f"rt/{topic}", RANGE), qos=QOS)
    writer.write(other(*range(1, 1 + len(members))))
    for _ in range(20):
        time.sleep(0.1)
        if samples := reader.take(1):
            return len(writer.get_matched_subscriptions()), samples[0].range
    return len(writer.get_matched_subscriptions()), None


renamed = {"radiation_type": uint8, "min": float32, "range": float32}
wider = {"radiation_type": uint8, "min_range": float32, "range": float64}
seen = {
    "ROS 2's name": through("right", "sensor_msgs::msg::dds_::Range_", MEMBERS),
    "not mangled": through("plain", "sensor_msgs::msg::Range", MEMBERS),
    "another message's name": through("other", "geometry_msgs::msg::dds_::Twist_", MEMBERS),
    "a member renamed": through("renamed", "sensor_msgs::msg::dds_::Range_", renamed),
    "a member wider": through("wider", "sensor_msgs::msg::dds_::Range_", wider),
}
for name, (matched, value) in seen.items():
    print(f"{name:23} matched {matched}, received {value}")
expected = [(1, 3.0)] * 3 + [(0, None)] * 2
raise SystemExit(0 if list(seen.values()) == expected else "it behaves otherwise now")
PYTHON
