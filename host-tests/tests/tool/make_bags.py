"""Writes the FLASER lines of a CARMEN log as ROS 2 bags, by the Python package rosbags.

    make_bags.py LOG FOLDER

Makes FOLDER/upright (MCAP, packed), FOLDER/messages (SQLite, messages packed), FOLDER/file (SQLite, the file packed)
and FOLDER/down (MCAP, the lidar head down: the readings in mirrored order). Readings of 50 m and more become inf, 0
becomes NaN. A second, blind laser has its own topic. /tf_static holds the lidar's place: here the robot's middle.
"""
import math
import sys
from pathlib import Path

import numpy as np
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_HUMBLE)
TYPES = STORE.types


def message(name, **fields):
    return TYPES[f"{name.replace('/', '/msg/')}"](**fields)


def header(seconds, frame):
    sec = int(seconds)
    stamp = message("builtin_interfaces/Time", sec=sec, nanosec=round((seconds - sec) * 1e9))
    return message("std_msgs/Header", stamp=stamp, frame_id=frame)


def vector(x, y, z):
    return message("geometry_msgs/Vector3", x=x, y=y, z=z)


def quaternion(x, y, z, w):
    return message("geometry_msgs/Quaternion", x=x, y=y, z=z, w=w)


def laser(seconds, frame, ranges):
    step = math.pi / (len(ranges) // 2 * 2)
    return message(
        "sensor_msgs/LaserScan", header=header(seconds, frame), angle_min=-math.pi / 2,
        angle_max=-math.pi / 2 + step * (len(ranges) - 1), angle_increment=step, time_increment=0.0, scan_time=0.0,
        range_min=0.0, range_max=80.0, ranges=np.array(ranges, dtype=np.float32), intensities=np.array([], dtype=np.float32))


def odometry(seconds, x, y, theta):
    zeros = np.zeros(36)
    position = message("geometry_msgs/Point", x=x, y=y, z=0.0)
    pose = message("geometry_msgs/Pose", position=position, orientation=quaternion(0.0, 0.0, math.sin(theta / 2), math.cos(theta / 2)))
    twist = message("geometry_msgs/Twist", linear=vector(0.0, 0.0, 0.0), angular=vector(0.0, 0.0, 0.0))
    return message(
        "nav_msgs/Odometry", header=header(seconds, "odom"), child_frame_id="base_link",
        pose=message("geometry_msgs/PoseWithCovariance", pose=pose, covariance=zeros),
        twist=message("geometry_msgs/TwistWithCovariance", twist=twist, covariance=zeros))


def static(rotation):
    transform = message("geometry_msgs/Transform", translation=vector(0.0, 0.0, 0.2), rotation=quaternion(*rotation))
    stamped = message("geometry_msgs/TransformStamped", header=header(0.0, "base_link"), child_frame_id="laser", transform=transform)
    return message("tf2_msgs/TFMessage", transforms=[stamped])


def scans(log):
    for line in Path(log).read_text().splitlines():
        words = line.split()
        if words[:1] == ["FLASER"]:
            count = int(words[1])
            rest = words[2 + count:]
            ranges = [float(word) for word in words[2:2 + count]]
            ranges = [math.inf if r >= 50 else math.nan if r == 0 else r for r in ranges]
            yield float(rest[6]), ranges, [float(word) for word in rest[3:6]]


def bag(path, log, plugin, packing, is_down):
    packer = Writer(path, version=9, storage_plugin=plugin)
    if packing:
        packer.set_compression(packing, CompressionFormat.ZSTD)
    with packer as writer:
        topics = {
            "/scan": "sensor_msgs/msg/LaserScan", "/blind/scan": "sensor_msgs/msg/LaserScan",
            "/odom": "nav_msgs/msg/Odometry", "/tf_static": "tf2_msgs/msg/TFMessage",
        }
        connections = {name: writer.add_connection(name, kind, typestore=STORE) for name, kind in topics.items()}

        def write(topic, seconds, value):
            data = STORE.serialize_cdr(value, topics[topic])
            writer.write(connections[topic], int(seconds * 1e9), data)

        write("/tf_static", 0.0, static((1.0, 0.0, 0.0, 0.0) if is_down else (0.0, 0.0, 0.0, 1.0)))
        for seconds, ranges, pose in scans(log):
            write("/blind/scan", seconds, laser(seconds, "blind", [math.inf] * 90))
            write("/odom", seconds, odometry(seconds, *pose))
            write("/scan", seconds, laser(seconds, "laser", ranges[::-1] if is_down else ranges))


def main(log, folder):
    folder = Path(folder)
    bag(folder / "upright", log, StoragePlugin.MCAP, CompressionMode.STORAGE, False)
    bag(folder / "messages", log, StoragePlugin.SQLITE3, CompressionMode.MESSAGE, False)
    bag(folder / "file", log, StoragePlugin.SQLITE3, CompressionMode.FILE, False)
    bag(folder / "down", log, StoragePlugin.MCAP, None, True)


main(*sys.argv[1:])
