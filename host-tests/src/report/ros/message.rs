//! ROS 2 messages as they are written: the fields of the interface packages, in their order.

use serde::Serialize;

/// Text of a message's definition: its own fields, then those of every type that it is made of.
#[must_use]
pub fn definition(name: &str) -> String {
    let mut text = fields(name).to_owned();
    let mut known = vec![name];
    let mut next = 0;
    while let Some(&parent) = known.get(next) {
        next += 1;
        for line in fields(parent).lines() {
            let kind = line.split([' ', '[']).next().unwrap_or_default();
            let Some((child, body)) = TYPES.iter().find(|(name, _)| *name == kind) else {
                continue;
            };
            if !known.contains(child) {
                known.push(child);
                let rule = "=".repeat(80);
                text += &format!("{rule}\nMSG: {child}\n{body}");
            }
        }
    }
    text
}

fn fields(name: &str) -> &'static str {
    let found = TYPES.iter().find(|(known, _)| *known == name);
    found.map_or("", |(_, fields)| fields)
}

/// Types and their fields, as the interface packages define them.
const TYPES: [(&str, &str); 17] = [
    ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"),
    (
        "std_msgs/Header",
        "builtin_interfaces/Time stamp\nstring frame_id\n",
    ),
    ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"),
    ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"),
    (
        "geometry_msgs/Quaternion",
        "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n",
    ),
    (
        "geometry_msgs/Pose",
        "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n",
    ),
    (
        "geometry_msgs/PoseWithCovariance",
        "geometry_msgs/Pose pose\nfloat64[36] covariance\n",
    ),
    (
        "geometry_msgs/PoseWithCovarianceStamped",
        "std_msgs/Header header\ngeometry_msgs/PoseWithCovariance pose\n",
    ),
    (
        "geometry_msgs/Twist",
        "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n",
    ),
    (
        "geometry_msgs/TwistWithCovariance",
        "geometry_msgs/Twist twist\nfloat64[36] covariance\n",
    ),
    (
        "geometry_msgs/Transform",
        "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
    ),
    (
        "geometry_msgs/TransformStamped",
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
    ),
    (
        "tf2_msgs/TFMessage",
        "geometry_msgs/TransformStamped[] transforms\n",
    ),
    (
        "sensor_msgs/LaserScan",
        "std_msgs/Header header\nfloat32 angle_min\nfloat32 angle_max\nfloat32 angle_increment\nfloat32 time_increment\n\
         float32 scan_time\nfloat32 range_min\nfloat32 range_max\nfloat32[] ranges\nfloat32[] intensities\n",
    ),
    (
        "nav_msgs/Odometry",
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n\
         geometry_msgs/TwistWithCovariance twist\n",
    ),
    (
        "nav_msgs/MapMetaData",
        "builtin_interfaces/Time map_load_time\nfloat32 resolution\nuint32 width\nuint32 height\ngeometry_msgs/Pose origin\n",
    ),
    (
        "nav_msgs/OccupancyGrid",
        "std_msgs/Header header\nnav_msgs/MapMetaData info\nint8[] data\n",
    ),
];

/// A moment.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Time {
    /// Whole seconds.
    pub sec: i32,
    /// The rest.
    pub nanosec: u32,
}

/// What every stamped message begins with.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Header<'a> {
    /// When.
    pub stamp: Time,
    /// In which frame.
    pub frame_id: &'a str,
}

/// `geometry_msgs/Pose`, also `geometry_msgs/Transform`: x, y, z, then a quaternion x, y, z, w.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Placed {
    /// (m)
    pub position: [f64; 3],
    /// x, y, z, w.
    pub orientation: [f64; 4],
}

/// Six by six, row by row: x, y, z and the rotations about them.
pub type Covariance = [[f64; 6]; 6];

/// `sensor_msgs/LaserScan`.
#[derive(Debug, Clone, Serialize)]
pub struct LaserScan<'a> {
    /// Time of the first range, and the lidar's frame.
    pub header: Header<'a>,
    /// Bearing of the first range (rad).
    pub angle_min: f32,
    /// Bearing of the last one.
    pub angle_max: f32,
    /// Between two ranges.
    pub angle_increment: f32,
    /// Between two ranges (s).
    pub time_increment: f32,
    /// Between two scans (s).
    pub scan_time: f32,
    /// (m)
    pub range_min: f32,
    /// (m)
    pub range_max: f32,
    /// (m)
    pub ranges: Vec<f32>,
    /// As the sensor gives it.
    pub intensities: Vec<f32>,
}

/// `nav_msgs/Odometry`.
#[derive(Debug, Clone, Serialize)]
pub struct Odometry<'a> {
    /// When, and the frame of the pose.
    pub header: Header<'a>,
    /// The robot's frame.
    pub child_frame_id: &'a str,
    /// The robot in the frame of the header.
    pub pose: Placed,
    /// Of the pose.
    pub pose_covariance: Covariance,
    /// Velocity along and about the axes.
    pub twist: [[f64; 3]; 2],
    /// Of the velocity.
    pub twist_covariance: Covariance,
}

/// `geometry_msgs/PoseWithCovarianceStamped`.
#[derive(Debug, Clone, Serialize)]
pub struct Estimate<'a> {
    /// When, and the frame of the pose.
    pub header: Header<'a>,
    /// The robot.
    pub pose: Placed,
    /// Of the pose.
    pub covariance: Covariance,
}

/// `geometry_msgs/TransformStamped`.
#[derive(Debug, Clone, Serialize)]
pub struct Transform<'a> {
    /// When, and the parent.
    pub header: Header<'a>,
    /// What is placed.
    pub child_frame_id: &'a str,
    /// Where.
    pub transform: Placed,
}

/// `nav_msgs/OccupancyGrid`.
#[derive(Debug, Clone, Serialize)]
pub struct OccupancyGrid<'a> {
    /// When, and the frame of the map.
    pub header: Header<'a>,
    /// When it was loaded.
    pub map_load_time: Time,
    /// Side of a cell (m).
    pub resolution: f32,
    /// Cells.
    pub width: u32,
    /// Cells.
    pub height: u32,
    /// Lower left corner.
    pub origin: Placed,
    /// Row by row from there: 0 free to 100 occupied, -1 unknown.
    pub data: Vec<i8>,
}

/// `diagnostic_msgs/DiagnosticArray`.
#[derive(Debug, Clone, Serialize)]
pub struct Diagnostics<'a> {
    /// When.
    pub header: Header<'a>,
    /// Of each part.
    pub status: Vec<Status<'a>>,
}

/// `diagnostic_msgs/DiagnosticStatus`.
#[derive(Debug, Clone, Serialize)]
pub struct Status<'a> {
    /// 0 good, 1 a warning, 2 an error.
    pub level: u8,
    /// Of the part.
    pub name: &'a str,
    /// What it is about.
    pub message: String,
    /// Which one of several.
    pub hardware_id: String,
    /// Names and figures.
    pub values: Vec<(&'a str, String)>,
}
