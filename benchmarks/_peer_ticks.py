"""What a control tick costs in PyBullet and in ir-sim, in the same worlds (neither plans)."""

import contextlib
import json
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pybullet
from _batch_ticks import CONTROL_HZ, true_scan

from ses_core.arrays import FloatArray
from ses_core.navigation import NavigationTask
from ses_core.robot_profile import RobotProfile
from ses_core.simulation.bullet import (
    MOTOR_TORQUE_NM,
    PHYSICS_RATE_HZ,
    TRACK_MULTIPLIER,
    PhysicalSlot,
)
from ses_core.simulation.jackal_urdf import WHEELS, robot_frame
from ses_core.simulation.rendering import render
from ses_core.simulation.robot import beam_directions

RAY_M = 5.0
"""Length of PyBullet's rays [m]. A place is 5 m deep; longer rays cost PyBullet more."""

_MAST_M = 0.4  # above the base, where no ray meets the robot itself
_SUBSTEPS = PHYSICS_RATE_HZ // CONTROL_HZ
_ALIKE_M = 0.02
_ALIKE_SHARE = 0.95


class BulletSide:
    """PyBullet: dynamics at 240 Hz on one concave mesh, and 720 rays per control tick.

    One client drives in world after world, which is faster than a client for each. Commands and
    rays are made beforehand, and the rays hang on the robot: a tick is calls to PyBullet only.
    """

    def __init__(
        self, tasks: Sequence[NavigationTask], commands: FloatArray, *, profile: RobotProfile
    ) -> None:
        self._tasks, self._profile = tasks, profile
        self._meshes = [render(task.world.grid) for task in tasks]
        self._body = PhysicalSlot(profile, time_step=1.0 / PHYSICS_RATE_HZ)
        frame = robot_frame(profile)
        half = 0.5 * TRACK_MULTIPLIER * frame.track
        sides = [-half if wheel.endswith("left") else half for wheel in WHEELS]
        wheels = commands[..., :1] + commands[..., 1:] * np.array(sides)
        self._wheels = (wheels / frame.wheel_radius).tolist()
        beams = beam_directions(profile)
        self._from = [[0.0, 0.0, _MAST_M]] * len(beams)
        self._to = np.column_stack((RAY_M * beams, np.full(len(beams), _MAST_M))).tolist()

    def cost(self) -> float:
        """Drive once through all commands in every world; give the CPU time of a tick [us]."""
        spent = 0.0
        for number, (task, mesh) in enumerate(zip(self._tasks, self._meshes, strict=True)):
            self._body.build(mesh, task.start)
            spent += self._drive(number)
        return 1e6 * spent / (len(self._tasks) * len(self._wheels))

    def check(self) -> None:
        """Make sure that the rays see what our laser sees."""
        for task, mesh in zip(self._tasks[:3], self._meshes, strict=False):
            self._body.build(mesh, task.start)
            hits = self._rays(self._body._client, self._body._robot)
            seen = RAY_M * np.array([hit[2] for hit in hits])
            x, y, yaw = self._body.pose()
            expected = np.minimum(true_scan(task, np.array([x, y, yaw]), self._profile), RAY_M)
            _expect_alike("PyBullet", seen, expected)

    def close(self) -> None:
        """Disconnect."""
        self._body.close()

    def _drive(self, number: int) -> float:
        client, robot = self._body._client, self._body._robot
        wheels, forces = list(range(len(WHEELS))), [MOTOR_TORQUE_NM] * len(WHEELS)
        started = time.process_time()
        for speeds in self._wheels:
            pybullet.setJointMotorControlArray(
                robot,
                wheels,
                pybullet.VELOCITY_CONTROL,
                targetVelocities=speeds[number],
                forces=forces,
                physicsClientId=client,
            )
            for _ in range(_SUBSTEPS):
                pybullet.stepSimulation(physicsClientId=client)
            self._rays(client, robot)
        return time.process_time() - started

    def _rays(self, client: int, robot: int) -> Sequence[Sequence[float]]:
        hits: Sequence[Sequence[float]] = pybullet.rayTestBatch(
            self._from,
            self._to,
            numThreads=1,
            parentObjectUniqueId=robot,
            parentLinkIndex=-1,
            physicsClientId=client,
        )
        return hits


class IrSimSide:
    """ir-sim: a kinematic robot with the same laser among merged rectangles, one step per tick."""

    def __init__(
        self,
        tasks: Sequence[NavigationTask],
        commands: FloatArray,
        *,
        profile: RobotProfile,
        scratch: Path,
    ) -> None:
        self._tasks, self._profile = tasks, profile
        self._commands = commands.tolist()
        self._tick = 0
        self._envs = []
        # Importing it prints what windows it cannot open; stdout is for the rows.
        with contextlib.redirect_stdout(sys.stderr):
            import irsim
        for number, task in enumerate(tasks):
            # YAML holds every JSON document.
            file = scratch / f"ir-sim-{number}.yaml"
            file.write_text(json.dumps(_ir_sim_world(task, profile)), encoding="utf-8")
            self._envs.append(
                irsim.make(str(file), headless=True, display=False, log_level="ERROR")
            )

    def cost(self, ticks: int) -> float:
        """Step every world; give the CPU time of a step with its scan [us]."""
        spent = 0.0
        for number, env in enumerate(self._envs):
            for tick in range(self._tick, self._tick + ticks):
                command = self._commands[tick % len(self._commands)][number]
                started = time.process_time()
                env.step(command)
                spent += time.process_time() - started
        self._tick += ticks
        return 1e6 * spent / (ticks * len(self._envs))

    def check(self) -> None:
        """Make sure that the robots have moved, and see what our laser sees from there."""
        for task, env in list(zip(self._tasks, self._envs, strict=True))[:3]:
            pose = env.robot.state.ravel()[:3]
            if np.hypot(pose[0] - task.start.x, pose[1] - task.start.y) == 0.0:
                raise RuntimeError("found ir-sim's robot at its start, expected that it moved")
            seen = np.asarray(env.get_lidar_scan()["ranges"])
            _expect_alike("ir-sim", seen, true_scan(task, pose, self._profile))


def _ir_sim_world(task: NavigationTask, profile: RobotProfile) -> dict[str, object]:
    boxes = render(task.world.grid).boxes
    low, high = boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)
    laser = profile.laser
    length, width = np.ptp(np.array(profile.body()), axis=0).tolist()
    return {
        "world": {
            "width": float(high[0] - low[0]),
            "height": float(high[1] - low[1]),
            "offset": low.tolist(),
            "step_time": 1.0 / CONTROL_HZ,
            # In its other modes a robot that touches something stops, and scans no more.
            "collision_mode": "unobstructed",
        },
        "robot": [
            {
                "kinematics": {"name": "diff"},
                "shape": {"name": "rectangle", "length": length, "width": width},
                "state": [task.start.x, task.start.y, task.start.yaw],
                "vel_max": [profile.max_speed_mps, profile.max_turn_rate_radps],
                "sensors": [
                    {
                        "name": "lidar2d",
                        "number": laser.beams,
                        "angle_range": laser.angle_max_rad - laser.angle_min_rad,
                        "range_min": laser.range_min_m,
                        "range_max": laser.range_max_m,
                    }
                ],
            }
        ],
        "obstacle": [
            {
                "static": True,
                "state": [0.0, 0.0, 0.0],
                "shape": {
                    "name": "polygon",
                    "vertices": [[left, below], [right, below], [right, above], [left, above]],
                },
            }
            for left, below, right, above in boxes.tolist()
        ],
    }


def _expect_alike(name: str, seen: FloatArray, expected: FloatArray) -> None:
    share = float(np.mean(np.abs(seen - expected) < _ALIKE_M))
    if share < _ALIKE_SHARE:
        raise RuntimeError(
            f"found {share:.0%} of {name}'s ranges within {_ALIKE_M} m of ours, "
            f"expected {_ALIKE_SHARE:.0%}"
        )
