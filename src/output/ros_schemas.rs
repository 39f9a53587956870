//! Definitions of the ROS 2 messages of a log: fields of common_interfaces and geometry2 (Humble), without their comments.

/// The fields of a message, the messages in it, and the header that each has.
macro_rules! message {
    ($($fields:expr),+) => {
        concat!($($fields,)+ "\
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
")
    };
}

/// The turn in a pose or a transform.
macro_rules! quaternion {
    () => {
        "\
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
"
    };
}

/// `sensor_msgs/msg/Image`.
pub(super) const IMAGE: &str = message!(
    "\
std_msgs/Header header
uint32 height
uint32 width
string encoding
uint8 is_bigendian
uint32 step
uint8[] data
"
);

/// `sensor_msgs/msg/CameraInfo`.
pub(super) const CAMERA_INFO: &str = message!(
    "\
std_msgs/Header header
uint32 height
uint32 width
string distortion_model
float64[] d
float64[9] k
float64[9] r
float64[12] p
uint32 binning_x
uint32 binning_y
sensor_msgs/RegionOfInterest roi
================================================================================
MSG: sensor_msgs/RegionOfInterest
uint32 x_offset
uint32 y_offset
uint32 height
uint32 width
bool do_rectify
"
);

/// `geometry_msgs/msg/PoseStamped`.
pub(super) const POSE_STAMPED: &str = message!(
    "\
std_msgs/Header header
geometry_msgs/Pose pose
================================================================================
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
================================================================================
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
",
    quaternion!()
);

/// `tf2_msgs/msg/TFMessage`.
pub(super) const TF_MESSAGE: &str = message!(
    "\
geometry_msgs/TransformStamped[] transforms
================================================================================
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
================================================================================
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
",
    quaternion!()
);
