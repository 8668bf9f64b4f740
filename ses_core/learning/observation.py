"""What a policy sees: a pooled laser scan, the way ahead, and the parameters in force.

Observation (D,), in this order:

| part | length | unit before | range after |
| --- | --- | --- | --- |
| nearest reading of each sector, right to left | S | m, up to `laser_clip_m` | [-0.5, 0.5] |
| angle to the local goal, 1 m ahead on the global plan | 1 | rad, (-pi, pi] | [-0.5, 0.5] |
| straight distance to the goal, if asked for | 1 | m, up to `goal_clip_m` | [-0.5, 0.5] |
| planner parameters in force that it sets, if asked for | A | own bounds | [-1, 1] |

The S sectors are fixed in the robot's frame, so that a policy does not depend on how many beams a
laser has or how it is mounted. A reading that is not finite or below the laser's least range
means that nothing came back.
"""

from dataclasses import dataclass

import numpy as np
from pydantic import Field, model_validator

from ses_core.arrays import Float32Array, FloatArray, IntArray
from ses_core.geometry import wrap_angles
from ses_core.learning.action import ActionSpec
from ses_core.protocols import SimulatorState
from ses_core.robot_profile import LaserProfile, RobotProfile
from ses_core.settings_model import SettingsModel


class ObservationSpec(SettingsModel):
    """Layout of an observation; it travels with every policy."""

    name: str = Field(description="Name of the preset.")
    sectors: int = Field(ge=1, description="Sectors the scan is pooled into.")
    sector_min_rad: float = Field(-2.35619, description="Right edge of the first sector.")
    sector_max_rad: float = Field(2.35619, description="Left edge of the last sector.")
    laser_clip_m: float = Field(gt=0, description="Farther readings count as this far.")
    goal_clip_m: float | None = Field(
        None, gt=0, description="Scale of the distance to the goal; None leaves it out."
    )
    has_parameters: bool = Field(False, description="Whether the parameters in force are seen.")

    @model_validator(mode="after")
    def _sectors_face_somewhere(self) -> "ObservationSpec":
        if not self.sector_min_rad < self.sector_max_rad:
            raise ValueError(
                f"sectors reach from {self.sector_min_rad} to {self.sector_max_rad} rad, "
                "expected the first to be less"
            )
        return self

    def length(self, action: ActionSpec) -> int:
        """Give D, the length of an observation of a policy that sets the action's parameters."""
        parameters = action.length if self.has_parameters else 0
        return self.sectors + 1 + (self.goal_clip_m is not None) + parameters

    def bounds(self, action: ActionSpec) -> Float32Array:
        """Give the upper bounds (D,); the lower ones are their negatives."""
        bounds = np.full(self.length(action), 0.5, dtype=np.float32)
        if self.has_parameters:
            bounds[-action.length :] = 1.0
        return bounds


AUTHORS_OBSERVATION = ObservationSpec(name="authors", sectors=720, laser_clip_m=2.0)
"""721 numbers, as ros_jackal's `dwa_base_envs.py` with the clip of its `configs/laser.yaml`."""

PAPER_OBSERVATION = ObservationSpec(
    name="paper", sectors=720, laser_clip_m=2.0, has_parameters=True
)
"""728 numbers. The paper names no observation and refers to APPLR: `jackal_env_continuous.py` of
its repository with the clip of `td3_condor.json`; angle and parameters are scaled as ours are."""

DEFAULT_OBSERVATION = ObservationSpec(
    name="default", sectors=120, laser_clip_m=4.0, goal_clip_m=10.0, has_parameters=True
)
"""129 numbers: three quarters of a learner's arithmetic is in the 720-wide first layer."""

OBSERVATIONS = {
    spec.name: spec for spec in (DEFAULT_OBSERVATION, AUTHORS_OBSERVATION, PAPER_OBSERVATION)
}


def observation_for(preset: str, profile: RobotProfile) -> ObservationSpec:
    """Give a preset's observation with its sectors over all that a robot's laser sees.

    A laser whose view reaches beyond straight behind the robot is taken to see all round.
    """
    laser = profile.laser
    right = laser.angle_min_rad + laser.mount_yaw_rad
    left = laser.angle_max_rad + laser.mount_yaw_rad
    if not -np.pi < right < left < np.pi:
        right, left = -float(np.pi), float(np.pi)
    return OBSERVATIONS[preset].model_copy(update={"sector_min_rad": right, "sector_max_rad": left})


@dataclass(frozen=True, slots=True, kw_only=True)
class Observer:
    """An observation's layout applied to one laser.

    Attributes:
        action: What the policy sets, for the parameters in force.
        beams: (sectors, K) beam numbers of each sector, repeated to the longest; number B, one
            past the last beam, stands for "no beam looks there" and reads as nothing in sight.
        least_range: Shorter readings mean that nothing came back [m].
    """

    spec: ObservationSpec
    action: ActionSpec
    beams: IntArray
    least_range: float

    def pool(self, scans: Float32Array) -> FloatArray:
        """Give the nearest reading (N, sectors) [m] of scans (N, B) [m], clipped."""
        clip = self.spec.laser_clip_m
        readings = np.full((scans.shape[0], scans.shape[1] + 1), clip)
        # A comparison with NaN is false: such a reading counts as nothing in sight too.
        readings[:, :-1] = np.where(scans >= self.least_range, np.minimum(scans, clip), clip)
        nearest: FloatArray = readings[:, self.beams].min(axis=2)
        return nearest

    def observe(
        self, scans: Float32Array, state: SimulatorState, parameters: FloatArray
    ) -> FloatArray:
        """Build observations (N, D) from scans (N, B) [m], state and parameters (N, 8) in force."""
        clip = self.spec.laser_clip_m
        ahead = state.local_goals
        parts = [
            (self.pool(scans) - clip / 2.0) / clip,
            np.arctan2(ahead[:, 1:], ahead[:, :1]) / (2.0 * np.pi),
        ]
        if self.spec.goal_clip_m is not None:
            # From where the robot believes to be: it knows no other place.
            away = np.linalg.norm(state.goals - state.odometry[:, :2], axis=1, keepdims=True)
            parts.append(np.minimum(away, self.spec.goal_clip_m) / self.spec.goal_clip_m - 0.5)
        if self.spec.has_parameters:
            parts.append(self.action.encode(parameters))
        return np.hstack(parts)


def make_observer(spec: ObservationSpec, profile: RobotProfile, *, action: ActionSpec) -> Observer:
    """Assign the beams of a robot's laser to the sectors of an observation."""
    laser = profile.laser
    angles = _beam_angles(laser)
    edges = np.linspace(spec.sector_min_rad, spec.sector_max_rad, spec.sectors + 1)
    # The last beam often lies exactly on the last edge: it belongs to the last sector.
    tolerance = 1e-9
    inside = (angles >= edges[0] - tolerance) & (angles <= edges[-1] + tolerance)
    sector = np.clip(np.searchsorted(edges, angles, side="right") - 1, 0, spec.sectors - 1)
    groups = [np.flatnonzero(inside & (sector == number)) for number in range(spec.sectors)]
    centres = (edges[:-1] + edges[1:]) / 2.0
    spacing = (laser.angle_max_rad - laser.angle_min_rad) / (laser.beams - 1)
    longest = max(1, *(len(group) for group in groups))
    beams = np.full((spec.sectors, longest), laser.beams, dtype=np.int64)
    for number, group in enumerate(groups):
        if len(group):
            beams[number] = np.resize(group, longest)
            continue
        distances = np.abs(wrap_angles(angles - centres[number]))
        if distances.min() <= spacing:
            beams[number] = int(distances.argmin())
    return Observer(spec=spec, action=action, beams=beams, least_range=laser.range_min_m)


def goal_distances(state: SimulatorState) -> FloatArray:
    """Give the true straight distance (N,) [m] of every robot to its goal."""
    offsets = state.goals - state.poses[:, :2]
    return np.hypot(offsets[:, 0], offsets[:, 1])


def _beam_angles(laser: LaserProfile) -> FloatArray:
    """Angles (B,) [rad] of the beams in the robot's frame."""
    own = np.linspace(laser.angle_min_rad, laser.angle_max_rad, laser.beams)
    return wrap_angles(own + laser.mount_yaw_rad)
