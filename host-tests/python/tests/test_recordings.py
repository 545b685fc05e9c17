"""What a run leaves behind, read by the packages that people have: mcap for Foxglove's recording, rosbags for a ROS 2 bag."""

import base64
import collections
import json

import numpy as np
import pytest
from test_beamfix import CHECKOUT, SHARED, tool

make_reader = pytest.importorskip("mcap.reader").make_reader
rosbags = pytest.importorskip("rosbags.highlevel")
from rosbags.rosbag2 import StoragePlugin, Writer  # noqa: E402
from rosbags.typesys import Stores, get_typestore  # noqa: E402

STORE = get_typestore(Stores.ROS2_HUMBLE)


def test_a_run_is_read_back_by_mcap(tmp_path):
    told = tool("simulate", "--seconds", "10", "--out", str(tmp_path))
    counts = collections.Counter()
    last = {}
    with (tmp_path / "run.mcap").open("rb") as file:
        reader = make_reader(file)
        for schema, channel, message in reader.iter_messages():
            counts[schema.name] += 1
            last[channel.topic] = json.loads(message.data)
        assert reader.get_summary().statistics.message_count == sum(counts.values())
    scans = told["scans"]
    assert counts == {
        "foxglove.PointCloud": scans, "foxglove.FrameTransform": scans, "foxglove.PoseInFrame": 3 * scans, "foxglove.Grid": 1,
    }
    places = [last[f"/pose/{name}"]["pose"]["position"] for name in ("estimate", "truth")]
    error = np.hypot(*(places[0][axis] - places[1][axis] for axis in "xy"))
    assert error == pytest.approx(told["final_error_m"], abs=1e-5)
    cells = np.frombuffer(base64.b64decode(last["/map"]["data"]), np.uint8)
    assert len(cells) % last["/map"]["column_count"] == 0 and {0, 100, 255} == set(cells)


def test_the_layout_in_docs_names_topics_that_a_run_has(tmp_path):
    tool("simulate", "--seconds", "3", "--out", str(tmp_path))
    with (tmp_path / "run.mcap").open("rb") as file:
        topics = {channel.topic for channel in make_reader(file).get_summary().channels.values()}
    layout = (CHECKOUT / "docs/foxglove.json").read_text()
    named = {topic for panel in json.loads(layout)["configById"].values() for topic in panel.get("topics", {})}
    plots = [path["value"].split(".")[0] for panel in json.loads(layout)["configById"].values() for path in panel.get("paths", [])]
    # What `--foxglove` alone serves.
    named.remove("/seen")
    assert named and plots and named | set(plots) <= topics, (named, plots, topics)


def test_a_ros_bag_read_and_written_by_rosbags_gives_the_same_poses(tmp_path):
    told = tool("simulate", "--seconds", "10", "--out", str(tmp_path), "--recording-format", "ros2")
    first = tool("replay", str(tmp_path / "bag"))
    counts = collections.Counter()
    with rosbags.AnyReader([tmp_path / "bag"]) as reader, Writer(
        tmp_path / "copy", version=9, storage_plugin=StoragePlugin.SQLITE3
    ) as writer:
        # Types are compared as text: their hashes vary with ROS's releases.
        types = {connection.topic: connection.msgtype for connection in reader.connections}
        assert types == {
            "/scan": "sensor_msgs/msg/LaserScan", "/odom": "nav_msgs/msg/Odometry", "/tf": "tf2_msgs/msg/TFMessage",
            "/tf_static": "tf2_msgs/msg/TFMessage", "/map": "nav_msgs/msg/OccupancyGrid",
            "/pose": "geometry_msgs/msg/PoseWithCovarianceStamped", "/ground_truth": "geometry_msgs/msg/PoseWithCovarianceStamped",
        }
        written = {name: writer.add_connection(name, kind, typestore=STORE) for name, kind in types.items()}
        for connection, time, raw in reader.messages():
            # Decoded by the definitions in the bag, encoded by the package's own.
            message = reader.deserialize(raw, connection.msgtype)
            writer.write(written[connection.topic], time, STORE.serialize_cdr(message, connection.msgtype))
            counts[connection.topic] += 1
            if connection.topic == "/map":
                assert len(message.data) == message.info.width * message.info.height and {-1, 0, 100} == set(message.data)
            if connection.topic == "/scan":
                assert len(message.ranges) == len(message.intensities) > 400
    scans = told["scans"]
    assert counts == dict.fromkeys(["/scan", "/odom", "/pose", "/ground_truth", "/tf"], scans) | {"/tf_static": 1, "/map": 1}
    second = tool("replay", str(tmp_path / "copy"))
    assert first["pose_hash"] == second["pose_hash"] and first["scans"] == scans
    # A bag holds all that the next bag of it needs.
    tool("replay", str(tmp_path / "bag"), "--out", str(tmp_path / "again"), "--recording-format", "ros2")
    assert tool("replay", str(tmp_path / "again/bag"))["pose_hash"] == first["pose_hash"]
    assert first["mount"] == second["mount"] == pytest.approx({"x": 0.08, "y": 0.0, "theta": 0.0, "upside_down": False})


@pytest.mark.parametrize("log", ["logs/intel.lscan", "lowcost/tinyslam-exp3.log.gz"])
def test_a_log_as_a_ros_bag_gives_the_logs_poses(log, tmp_path):
    path = SHARED / "datasets" / log
    if not path.exists():
        pytest.skip(f"{log} is not there")
    told = tool("replay", str(path), "--scans", "400", "--out", str(tmp_path), "--recording-format", "ros2")
    found = tool("replay", str(tmp_path / "bag"))
    assert found["pose_hash"] == told["pose_hash"] and found["refused"] == told["refused"]
