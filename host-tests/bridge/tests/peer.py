"""What Cyclone DDS, an implementation of its own, receives from the bridge, as one object of JSON; it sends the wheels' poses.

    peer.py DOMAIN SECONDS BYTES

BYTES is how long ids are on ROS 2's wire: 16, until Humble 24.
Types and topics are written as ROS 2's interface packages define them and as its middleware mangles their names.
"""

import json
import math
import sys
import tempfile
import time
from dataclasses import dataclass

CONFIGURATION = """<CycloneDDS><Domain>
  <General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces></General>
  <Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="localhost"/></Peers></Discovery>
</Domain></CycloneDDS>"""

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, byte, float32, float64, int8, int32, sequence, uint8, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class Point(IdlStruct, typename="geometry_msgs::msg::dds_::Point_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Pose(IdlStruct, typename="geometry_msgs::msg::dds_::Pose_"):
    position: Point
    orientation: Quaternion


@dataclass
class PoseWithCovariance(IdlStruct, typename="geometry_msgs::msg::dds_::PoseWithCovariance_"):
    pose: Pose
    covariance: array[float64, 36]


@dataclass
class Twist(IdlStruct, typename="geometry_msgs::msg::dds_::Twist_"):
    linear: Point
    angular: Point


@dataclass
class TwistWithCovariance(IdlStruct, typename="geometry_msgs::msg::dds_::TwistWithCovariance_"):
    twist: Twist
    covariance: array[float64, 36]


@dataclass
class Odometry(IdlStruct, typename="nav_msgs::msg::dds_::Odometry_"):
    header: Header
    child_frame_id: str
    pose: PoseWithCovariance
    twist: TwistWithCovariance


@dataclass
class PoseWithCovarianceStamped(IdlStruct, typename="geometry_msgs::msg::dds_::PoseWithCovarianceStamped_"):
    header: Header
    pose: PoseWithCovariance


@dataclass
class Transform(IdlStruct, typename="geometry_msgs::msg::dds_::Transform_"):
    translation: Point
    rotation: Quaternion


@dataclass
class TransformStamped(IdlStruct, typename="geometry_msgs::msg::dds_::TransformStamped_"):
    header: Header
    child_frame_id: str
    transform: Transform


@dataclass
class TFMessage(IdlStruct, typename="tf2_msgs::msg::dds_::TFMessage_"):
    transforms: sequence[TransformStamped]


@dataclass
class LaserScan(IdlStruct, typename="sensor_msgs::msg::dds_::LaserScan_"):
    header: Header
    angle_min: float32
    angle_max: float32
    angle_increment: float32
    time_increment: float32
    scan_time: float32
    range_min: float32
    range_max: float32
    ranges: sequence[float32]
    intensities: sequence[float32]


@dataclass
class MapMetaData(IdlStruct, typename="nav_msgs::msg::dds_::MapMetaData_"):
    map_load_time: Time
    resolution: float32
    width: uint32
    height: uint32
    origin: Pose


@dataclass
class OccupancyGrid(IdlStruct, typename="nav_msgs::msg::dds_::OccupancyGrid_"):
    header: Header
    info: MapMetaData
    data: sequence[int8]


@dataclass
class KeyValue(IdlStruct, typename="diagnostic_msgs::msg::dds_::KeyValue_"):
    key: str
    value: str


@dataclass
class DiagnosticStatus(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticStatus_"):
    level: byte
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValue]


@dataclass
class DiagnosticArray(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticArray_"):
    header: Header
    status: sequence[DiagnosticStatus]


@dataclass
class Gid(IdlStruct, typename="rmw_dds_common::msg::dds_::Gid_"):
    data: array[uint8, int(sys.argv[3])]


@dataclass
class NodeEntitiesInfo(IdlStruct, typename="rmw_dds_common::msg::dds_::NodeEntitiesInfo_"):
    node_namespace: str
    node_name: str
    reader_gid_seq: sequence[Gid]
    writer_gid_seq: sequence[Gid]


@dataclass
class ParticipantEntitiesInfo(IdlStruct, typename="rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"):
    gid: Gid
    node_entities_info_seq: sequence[NodeEntitiesInfo]


RELIABLE = Policy.Reliability.Reliable(duration(seconds=1))
# As nav2, tf2, RViz's sensor profile and the map's readers ask for them.
ASKED = {
    "/odom": (Odometry, Qos(RELIABLE, Policy.Durability.Volatile, Policy.History.KeepLast(50))),
    "/pose": (PoseWithCovarianceStamped, Qos(RELIABLE, Policy.Durability.Volatile, Policy.History.KeepLast(50))),
    "/tf": (TFMessage, Qos(RELIABLE, Policy.Durability.Volatile, Policy.History.KeepLast(100))),
    "/tf_static": (TFMessage, Qos(RELIABLE, Policy.Durability.TransientLocal, Policy.History.KeepLast(1))),
    "/scan": (LaserScan, Qos(Policy.Reliability.BestEffort, Policy.Durability.Volatile, Policy.History.KeepLast(5))),
    "/map": (OccupancyGrid, Qos(RELIABLE, Policy.Durability.TransientLocal, Policy.History.KeepLast(1))),
    "/diagnostics": (DiagnosticArray, Qos(RELIABLE, Policy.Durability.Volatile, Policy.History.KeepLast(10))),
}


# As ROS 2's middleware reads it.
GRAPH = Qos(RELIABLE, Policy.Durability.TransientLocal, Policy.History.KeepAll)


def plain(value):
    """Fields by name; what JSON has no number for by its name."""
    if isinstance(value, IdlStruct):
        return {name: plain(field) for name, field in vars(value).items() if name != "sample_info"}
    if isinstance(value, (list, tuple, bytes)):
        return [plain(one) for one in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value


def main():
    domain, seconds = int(sys.argv[1]), float(sys.argv[2])
    _domain = Domain(domain, CONFIGURATION)
    participant = DomainParticipant(domain)
    readers = {
        name: DataReader(participant, Topic(participant, "rt" + name, kind), qos=quality)
        for name, (kind, quality) in ASKED.items()
    }
    readers["ros_discovery_info"] = DataReader(participant, Topic(participant, "ros_discovery_info", ParticipantEntitiesInfo), qos=GRAPH)
    # What DDS's own discovery tells.
    discovery = {"writers": BuiltinTopicDcpsPublication, "readers": BuiltinTopicDcpsSubscription}
    discovery = {name: BuiltinDataReader(participant, topic) for name, topic in discovery.items()}
    found = {name: [] for name in discovery}
    writer = DataWriter(
        participant,
        Topic(participant, "rt/wheel_odom", Odometry),
        qos=Qos(RELIABLE, Policy.Durability.Volatile, Policy.History.KeepLast(10)),
    )
    received = {name: [] for name in readers}
    sent, end, next_wheels = 0, time.time() + seconds, 0.0
    unknown = [0.0] * 36
    print("listening", file=sys.stderr, flush=True)
    while time.time() < end:
        for name, reader in readers.items():
            for one in reader.take(100):
                if one.sample_info.valid_data:
                    received[name].append({**plain(one), "source_ns": one.sample_info.source_timestamp})
        for name, reader in discovery.items():
            for one in reader.take(100):
                if one.sample_info.valid_data:
                    found[name].append([one.key.hex, one.participant_key.hex, one.topic_name, one.type_name])
        if time.time() >= next_wheels and writer.get_matched_subscriptions():
            next_wheels = time.time() + 0.1
            now, half = time.time(), -0.3
            stamp = Time(int(now), int(now % 1 * 1e9))
            at = Pose(Point(0.25 * sent, -0.5, 0.0), Quaternion(0.0, 0.0, math.sin(half), math.cos(half)))
            still = Twist(Point(0.0, 0.0, 0.0), Point(0.0, 0.0, 0.0))
            message = Odometry(Header(stamp, "odom"), "base_link", PoseWithCovariance(at, unknown), TwistWithCovariance(still, unknown))
            writer.write(message)
            sent += 1
        time.sleep(0.01)
    json.dump({"received": received, "found": found, "sent": sent}, sys.stdout)


main()
