"""Messages that only viewers read: the path driven, and markers for what matters along it."""

from typing import Any

import numpy as np

from ses_core.arrays import FloatArray, IntArray
from ses_core.geometry import Pose2D
from storage.bag_messages import MAP_FRAME
from storage.message_types import ros2_types

PATH = "nav_msgs/msg/Path"
MARKERS = "visualization_msgs/msg/MarkerArray"

_MARKER = "visualization_msgs/msg/Marker"
_ARROW, _CYLINDER, _SPHERE_LIST = 0, 3, 7
_START_COLOUR = (0.0, 0.62, 0.45, 1.0)
_GOAL_COLOUR = (0.84, 0.37, 0.0, 1.0)
_REVERSING_COLOUR = (0.8, 0.1, 0.2, 1.0)


def path_message(poses: FloatArray, stamps_ns: IntArray, *, stamp_ns: int) -> bytes:
    """Serialize a path in the frame `map`.

    Args:
        poses: (K, 3) [m, m, rad].
        stamps_ns: (K,) [ns] when each was reached.
        stamp_ns: Of the message.
    """
    stamped = [
        _make(
            "geometry_msgs/msg/PoseStamped",
            header=_header(int(stamp)),
            pose=_pose(Pose2D(*pose.tolist())),
        )
        for pose, stamp in zip(poses, stamps_ns, strict=True)
    ]
    message = _make(PATH, header=_header(stamp_ns), poses=stamped)
    return bytes(ros2_types().serialize_cdr(message, PATH))


def marker_message(
    *,
    start: Pose2D | None,
    goal: tuple[float, float] | None,
    reversing: FloatArray,
    stamp_ns: int,
) -> bytes:
    """Serialize markers in the frame `map`; they stay until the file ends.

    Args:
        start: An arrow where the robot set out, heading as it did.
        goal: A flat disc where it was to get to [m].
        reversing: (R, 2) [m] spheres where it drove backwards.
        stamp_ns: Of the message.
    """
    markers = []
    if start is not None:
        markers.append(_marker("start", _ARROW, stamp_ns, start, (0.5, 0.1, 0.1), _START_COLOUR))
    if goal is not None:
        markers.append(
            _marker("goal", _CYLINDER, stamp_ns, Pose2D(*goal), (0.3, 0.3, 0.05), _GOAL_COLOUR)
        )
    if len(reversing):
        points = [_make("geometry_msgs/msg/Point", x=x, y=y, z=0.0) for x, y in reversing.tolist()]
        markers.append(
            _marker(
                "reversing",
                _SPHERE_LIST,
                stamp_ns,
                Pose2D(0.0, 0.0),
                (0.08, 0.08, 0.08),
                _REVERSING_COLOUR,
                points=points,
            )
        )
    return bytes(ros2_types().serialize_cdr(_make(MARKERS, markers=markers), MARKERS))


def _marker(
    namespace: str,
    kind: int,
    stamp_ns: int,
    pose: Pose2D,
    scale: tuple[float, float, float],
    colour: tuple[float, float, float, float],
    *,
    points: list[Any] | None = None,
) -> Any:
    red, green, blue, alpha = colour
    nothing = np.empty(0, dtype=np.uint8)
    return _make(
        _MARKER,
        header=_header(stamp_ns),
        ns=namespace,
        id=0,
        type=kind,
        action=0,
        pose=_pose(pose),
        scale=_vector(*scale),
        color=_make("std_msgs/msg/ColorRGBA", r=red, g=green, b=blue, a=alpha),
        lifetime=_make("builtin_interfaces/msg/Duration", sec=0, nanosec=0),
        frame_locked=False,
        points=points or [],
        colors=[],
        texture_resource="",
        texture=_make(
            "sensor_msgs/msg/CompressedImage", header=_header(0, frame=""), format="", data=nothing
        ),
        uv_coordinates=[],
        text="",
        mesh_resource="",
        mesh_file=_make("visualization_msgs/msg/MeshFile", filename="", data=nothing),
        mesh_use_embedded_materials=False,
    )


def _header(stamp_ns: int, *, frame: str = MAP_FRAME) -> Any:
    seconds, nanoseconds = divmod(stamp_ns, 10**9)
    stamp = _make("builtin_interfaces/msg/Time", sec=seconds, nanosec=nanoseconds)
    return _make("std_msgs/msg/Header", stamp=stamp, frame_id=frame)


def _pose(pose: Pose2D) -> Any:
    return _make(
        "geometry_msgs/msg/Pose",
        position=_make("geometry_msgs/msg/Point", x=pose.x, y=pose.y, z=0.0),
        orientation=_make(
            "geometry_msgs/msg/Quaternion",
            x=0.0,
            y=0.0,
            z=float(np.sin(pose.yaw / 2.0)),
            w=float(np.cos(pose.yaw / 2.0)),
        ),
    )


def _vector(x: float, y: float, z: float) -> Any:
    return _make("geometry_msgs/msg/Vector3", x=x, y=y, z=z)


def _make(message_type: str, **fields: Any) -> Any:
    """Make a message; rosbags builds these classes while it runs, so they have no static type."""
    return ros2_types().types[message_type](**fields)
