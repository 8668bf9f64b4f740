"""What the batch simulator remembers of its slots, and the copy of it that callers get."""

from dataclasses import dataclass
from typing import NamedTuple, Protocol, get_type_hints

import numpy as np
from numpy.typing import NDArray

from ses_core.arrays import ByteArray, Float32Array, FloatArray, IntArray

Int16Array = NDArray[np.int16]
Int32Array = NDArray[np.int32]
UInt16Array = NDArray[np.uint16]


class Slot(Protocol):
    """One record of the slot table: an episode and the memory of its navigation stack.

    Positions are in the frame of the slot's world [m], headings in radians, times in ticks. The
    stack knows where it believes to be: at the start that is the truth, then odometry drifts.
    """

    # The episode.
    true_x: float
    true_y: float
    true_yaw: float
    odometry_x: float  # what the motion since the start adds up to, with its errors
    odometry_y: float
    odometry_yaw: float
    turn_gain: float  # of the wheels' turning what becomes the robot's
    way_gain: float  # of a way what odometry counts
    odometry_gain: float  # of a turn what odometry counts
    x: float  # where the stack believes to be: odometry with its jitter
    y: float
    yaw: float
    v: float  # measured [m/s]
    w: float  # measured [rad/s]
    command_v: float
    command_w: float
    goal_x: float
    goal_y: float
    path_length: float
    tick: int
    negative_count: int
    not_forward_count: int
    contact_count: int
    outcome: int
    random_state: np.uint64
    anchor_x: float  # where the robot was when it last got away from a place
    anchor_y: float
    anchor_tick: int

    # The true world: a window of `Memory.clearance`.
    world_offset: int
    world_width: int
    world_height: int
    world_x: float  # lower left corner
    world_y: float
    world_resolution: float

    # The newest scan: where the robot believed to be when it was taken.
    scan_x: float
    scan_y: float
    scan_yaw: float

    # What has been seen: a window of `Memory.marks`, `.distances` and `.potential`.
    map_offset: int
    map_width: int
    map_height: int
    map_x: float
    map_y: float
    changed_left: int  # cells whose marks changed and whose distances are stale
    changed_right: int
    changed_bottom: int
    changed_top: int

    # The global plan.
    has_plan: bool
    plan_size: int
    plan_tick: int  # last tick with a valid plan
    search_tick: int  # last tick the potential was computed
    search_needed: bool
    reached_left: int  # cells that the search has given a potential
    reached_right: int
    reached_bottom: int
    reached_top: int
    local_goal_x: float
    local_goal_y: float
    inflation_radius: float
    rollout_reach: float  # farthest a sample can get until the next scan [m]

    # The local planner.
    window_column: int  # map cell at the window's lower left corner
    window_row: int
    oscillation_x: float
    oscillation_y: float
    is_rotating_left: bool
    is_rotating_right: bool
    is_stuck_left: bool
    is_stuck_right: bool
    is_escaping: bool
    escape_x: float
    escape_y: float
    escape_yaw: float
    control_tick: int  # last tick with a valid command
    recovery_angle: float  # still to be turned by the rotate recovery [rad]


_KINDS = {float: np.float64, int: np.int64, bool: np.bool_, np.uint64: np.uint64}

SLOT_DTYPE = np.dtype([(name, _KINDS[kind]) for name, kind in get_type_hints(Slot).items()])
"""Layout of the slot table."""


class Memory(NamedTuple):
    """The arrays behind the slot table; grids of all slots lie end to end in flat arrays."""

    clearance: ByteArray  # chessboard distance to the nearest occupied cell [cells]
    marks: ByteArray  # 1 where the laser has marked an obstacle
    distances: ByteArray  # squared distance to the nearest mark [cells^2], 255 = 16 cells or more
    potential: Float32Array  # cost to the goal
    plans: Float32Array  # (N, P, 2) plan ahead of the robot [map cells]
    costs: Float32Array  # (N, 256) cost of a squared distance, for the slot's inflation radius
    window_distances: ByteArray  # (N, W, W) `distances` around the robot
    path_steps: UInt16Array  # (N, W, W) cells to the plan
    goal_steps: UInt16Array  # (N, W, W) cells to the local goal
    delayed: FloatArray  # (N, D, 2) commands under way to the wheels
    scans: Float32Array  # (N, B) [m], inf where nothing was hit
    past_poses: FloatArray  # (N, D, 6) true and believed poses of the last ticks


class Scratch(NamedTuple):
    """Working arrays of one thread each (leading axis); nothing in them outlives a call."""

    queue: Int32Array  # (T, W * W) cells of a breadth-first search
    columns: Int16Array  # (T, H, W) squared distances along columns
    bucket_ends: Int32Array  # (T, 128, 2) first and last cell of a global planner's bucket or -1
    links: Int32Array  # (T, largest map, 2) cells before and after in the same bucket, or -1
    bucket_of: ByteArray  # (T, largest map) 1 + number of the bucket a cell is in, or 0
    samples: FloatArray  # (T, S) cost of the local planner's samples


@dataclass(frozen=True, slots=True, kw_only=True)
class BatchState:
    """A copy of every slot's state: see `ses_core.protocols.SimulatorState`."""

    poses: FloatArray
    odometry: FloatArray
    velocities: FloatArray
    commands: FloatArray
    goals: FloatArray
    local_goals: FloatArray
    times: FloatArray
    path_lengths: FloatArray
    negative_counts: IntArray
    not_forward_counts: IntArray
    contact_counts: IntArray
    outcomes: IntArray


def snapshot(slots: NDArray[np.void], *, time_step: float) -> BatchState:
    """Copy the public part of the slot table."""
    ahead_x = slots["local_goal_x"] - slots["x"]
    ahead_y = slots["local_goal_y"] - slots["y"]
    cosine, sine = np.cos(slots["yaw"]), np.sin(slots["yaw"])
    return BatchState(
        poses=np.stack([slots["true_x"], slots["true_y"], slots["true_yaw"]], axis=1),
        odometry=np.stack([slots["x"], slots["y"], slots["yaw"]], axis=1),
        velocities=np.stack([slots["v"], slots["w"]], axis=1),
        commands=np.stack([slots["command_v"], slots["command_w"]], axis=1),
        goals=np.stack([slots["goal_x"], slots["goal_y"]], axis=1),
        local_goals=np.stack(
            [cosine * ahead_x + sine * ahead_y, cosine * ahead_y - sine * ahead_x], axis=1
        ),
        times=slots["tick"] * time_step,
        path_lengths=slots["path_length"].copy(),
        negative_counts=slots["negative_count"].copy(),
        not_forward_counts=slots["not_forward_count"].copy(),
        contact_counts=slots["contact_count"].copy(),
        outcomes=slots["outcome"].copy(),
    )
