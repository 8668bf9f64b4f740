"""`BulletSimulator`: the same navigation stack on PyBullet's rigid bodies (leaf: pybullet).

Sensing, costmap and planner are the batch simulator's own kernels; only the motion of a tick is
physics: wheels driven by motors, tyres that slip, a body that bumps into a mesh. One physics
client per slot, 20 to 30 MB each; every call names its client.

What collides with walls is the body of the robot profile, in both simulators. The Jackal's real
wheels stick out 4 cm beyond it on either side; here they roll on the ground and pass through
walls, else the same drive would count as a collision in one simulator and not in the other.
"""

import math
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pybullet

from ses_core.arrays import ByteArray, Float32Array, FloatArray, IntArray
from ses_core.evaluation.outcomes import EpisodeOutcome
from ses_core.geometry import Pose2D
from ses_core.navigation import NavigationTask
from ses_core.occupancy import OccupancyGrid
from ses_core.robot_profile import RobotProfile
from ses_core.settings import SimulationSettings
from ses_core.simulation.batch import BatchSimulator, CostmapView
from ses_core.simulation.jackal_urdf import CHASSIS_LINK, WHEELS, robot_frame, robot_urdf
from ses_core.simulation.rendering import RenderedWorld, render
from ses_core.simulation.state import BatchState
from ses_core.simulation.trace import Trace

PHYSICS_RATE_HZ = 240

# Calibrated on 58 open-loop drives of 2 s against the batch simulator's motion (straight, turns on
# the spot, arcs, random commands up to 1 m/s and 1.6 rad/s): see docs/fidelity.md. With friction
# cones the turn rate depends on the heading by up to a half, because PyBullet scales friction
# along the axes of the world; with pyramids it does not.
WHEEL_FRICTION = 16.0
"""Along the wheel: motors, not tyres, limit how it speeds up."""
LATERAL_SHARE = 0.12
"""Of that across the wheel, where a skid-steered robot must slip to turn."""
TRACK_MULTIPLIER = 1.035
"""Effective over geometric track; Clearpath's controller uses 1.5 on looser tyres."""
MOTOR_TORQUE_NM = 40.0

_STANDING_GAP_M = 0.0005
_TIPPED_RAD = 0.5
_MESHES_KEPT = 256
_MOST_BOXES = 8000
"""Boxes per mesh: PyBullet takes 131072 vertices in one call."""
_MOST_BOXES_SHOWN = 3000


class BulletSimulator:
    """Simulates N robots by rigid-body physics; see `ses_core.protocols.Simulator`."""

    def __init__(self, *, slots: int, profile: RobotProfile, settings: SimulationSettings) -> None:
        self._stack = BatchSimulator(slots=slots, profile=profile, settings=settings)
        self._substeps = max(1, round(PHYSICS_RATE_HZ * self._stack.time_step))
        self._profile = profile
        self._bodies: list[PhysicalSlot | None] = [None] * slots
        self._meshes: dict[int, tuple[OccupancyGrid, RenderedWorld]] = {}

    @property
    def slots(self) -> int:
        """N, the number of robots stepped together."""
        return self._stack.slots

    @property
    def time_step(self) -> float:
        """Duration of one control tick [s]."""
        return self._stack.time_step

    def reset(self, slots: IntArray, tasks: Sequence[NavigationTask], seeds: IntArray) -> None:
        """Start an episode in each of the slots (S,) from tasks and noise seeds (S,)."""
        self._stack.reset(slots, tasks, seeds)
        starts = self._stack.state().poses
        for number, task in zip(slots.tolist(), tasks, strict=True):
            body = self._bodies[number]
            if body is None:
                body = self._bodies[number] = PhysicalSlot(
                    self._profile, time_step=self.time_step / self._substeps
                )
            body.build(self._mesh(task.world.grid), Pose2D(*starts[number].tolist()))

    def advance(self, parameters: FloatArray, ticks: int) -> None:
        """Run control ticks under planner parameters (N, 8)."""
        poses, velocities = np.zeros((self.slots, 3)), np.zeros((self.slots, 2))
        contacts = np.zeros(self.slots, dtype=np.bool_)
        for _ in range(ticks):
            running = np.flatnonzero(self._stack.state().outcomes == EpisodeOutcome.RUNNING)
            if not len(running):
                return
            commands = self._stack.plan_commands(parameters)
            for number in running.tolist():
                body = self._body(number)
                contacts[number] = body.drive(commands[number], substeps=self._substeps)
                poses[number], velocities[number] = body.pose(), body.velocity()
            self._stack.settle(poses, velocities, contacts)

    def trace_into(self, trace: Trace) -> None:
        """Write every tick from now on into arrays of N slots, as long as an episode lasts."""
        self._stack.trace_into(trace)

    def scans(self) -> Float32Array:
        """Give the newest scan (N, B) [m] of every slot."""
        return self._stack.scans()

    def state(self) -> BatchState:
        """Give a copy of every slot's state."""
        return self._stack.state()

    def costmap(self, number: int) -> CostmapView:
        """Give the map one slot has built, under its inflation radius."""
        return self._stack.costmap(number)

    def plan(self, number: int) -> FloatArray:
        """Give one slot's global plan (P, 2) [m] as far as the local planner sees it."""
        return self._stack.plan(number)

    def still(self, number: int, *, width: int = 640, height: int = 480) -> ByteArray:
        """Photograph a slot's robot from behind and above: (height, width, 3)."""
        return self._body(number).still(width, height)

    def close(self) -> None:
        """Disconnect every physics client."""
        for body in self._bodies:
            if body is not None:
                body.close()
        self._bodies = [None] * self.slots

    def _body(self, number: int) -> "PhysicalSlot":
        body = self._bodies[number]
        if body is None:
            raise ValueError(f"slot {number} has no episode, expected one after reset")
        return body

    def _mesh(self, grid: OccupancyGrid) -> RenderedWorld:
        """Render a map once; the grid is kept beside its mesh so that its id stays its own."""
        key = id(grid.cells)
        if key not in self._meshes:
            if len(self._meshes) >= _MESHES_KEPT:
                self._meshes.clear()
            self._meshes[key] = (grid, render(grid))
        return self._meshes[key][1]


class PhysicalSlot:
    """One physics client with one world and one robot in it."""

    def __init__(self, profile: RobotProfile, *, time_step: float) -> None:
        self._client: int = pybullet.connect(pybullet.DIRECT)
        if self._client < 0:
            raise RuntimeError("pybullet opened no further physics client")
        self._time_step = time_step
        self._frame = robot_frame(profile)
        self._most_change = np.array([profile.acc_lim_x_mps2, profile.acc_lim_theta_radps2])
        self._driven = np.zeros(2)
        self._urdf = robot_urdf(self._frame, name=profile.name)
        self._robot = self._ground = -1
        self._walls: list[int] = []
        self._world: RenderedWorld

    def build(self, world: RenderedWorld, start: Pose2D) -> None:
        """Forget everything, then build ground, walls and a robot standing at its start."""
        self._world = world
        self._driven = np.zeros(2)
        client = self._client
        pybullet.resetSimulation(physicsClientId=client)
        pybullet.setGravity(0.0, 0.0, -9.81, physicsClientId=client)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=self._time_step,
            deterministicOverlappingPairs=1,
            enableConeFriction=0,
            physicsClientId=client,
        )
        plane = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client)
        self._ground = pybullet.createMultiBody(0, plane, physicsClientId=client)
        pybullet.changeDynamics(self._ground, -1, lateralFriction=1.0, physicsClientId=client)
        boxes = len(world.boxes)
        self._walls = [
            self._build_walls(world, first, min(first + _MOST_BOXES, boxes))
            for first in range(0, boxes, _MOST_BOXES)
        ]
        self._robot = self._build_robot(start)

    def drive(self, command: FloatArray, *, substeps: int) -> bool:
        """Drive by a command (2,) [m/s, rad/s] for one tick; tell whether the body touched."""
        frame = self._frame
        # The base's own controller: PyBullet's motors alone would jump to any speed.
        most = self._most_change * substeps * self._time_step
        self._driven = np.clip(command, self._driven - most, self._driven + most)
        v, w = self._driven
        half = TRACK_MULTIPLIER * frame.track / 2
        left, right = v - half * w, v + half * w
        pybullet.setJointMotorControlArray(
            self._robot,
            list(range(len(WHEELS))),
            pybullet.VELOCITY_CONTROL,
            targetVelocities=[
                (left if wheel.endswith("left") else right) / frame.wheel_radius for wheel in WHEELS
            ],
            forces=[MOTOR_TORQUE_NM] * len(WHEELS),
            physicsClientId=self._client,
        )
        has_contact = False
        for _ in range(substeps):
            pybullet.stepSimulation(physicsClientId=self._client)
            has_contact = has_contact or self._touches()
        return has_contact

    def pose(self) -> tuple[float, float, float]:
        """Give x, y [m] and heading [rad]."""
        (x, y, _), turn = pybullet.getBasePositionAndOrientation(
            self._robot, physicsClientId=self._client
        )
        return x, y, pybullet.getEulerFromQuaternion(turn)[2]

    def velocity(self) -> tuple[float, float]:
        """Give speed along the heading [m/s] and turn rate [rad/s]."""
        linear, angular = pybullet.getBaseVelocity(self._robot, physicsClientId=self._client)
        yaw = self.pose()[2]
        return linear[0] * math.cos(yaw) + linear[1] * math.sin(yaw), angular[2]

    def still(self, width: int, height: int) -> ByteArray:
        """Photograph the robot from behind and above: (height, width, 3)."""
        x, y, yaw = self.pose()
        shown = self._show_walls(x, y)
        view = pybullet.computeViewMatrix(
            (x - 2.2 * math.cos(yaw), y - 2.2 * math.sin(yaw), 2.6),
            (x + 0.8 * math.cos(yaw), y + 0.8 * math.sin(yaw), 0.0),
            (0.0, 0.0, 1.0),
        )
        lens = pybullet.computeProjectionMatrixFOV(60.0, width / height, 0.05, 30.0)
        *_, pixels, _, _ = pybullet.getCameraImage(
            width,
            height,
            view,
            lens,
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=self._client,
        )
        pybullet.removeBody(shown, physicsClientId=self._client)
        return np.asarray(pixels, dtype=np.uint8).reshape(height, width, 4)[..., :3]

    def close(self) -> None:
        """Disconnect the client."""
        pybullet.disconnect(physicsClientId=self._client)

    def _touches(self) -> bool:
        """Tell whether the body presses against a wall, or the robot has tipped over."""
        for wall in self._walls:
            points = pybullet.getContactPoints(
                self._robot, wall, CHASSIS_LINK, -1, physicsClientId=self._client
            )
            # Bullet also lists what is merely near: place 8 is the distance, 9 the force.
            if any(point[8] <= 0.0 or point[9] > 0.0 for point in points):
                return True
        turn = pybullet.getBasePositionAndOrientation(self._robot, physicsClientId=self._client)[1]
        roll, pitch, _ = pybullet.getEulerFromQuaternion(turn)
        return max(abs(roll), abs(pitch)) > _TIPPED_RAD

    def _show_walls(self, x: float, y: float) -> int:
        """Put up walls to look at, for a moment: a body made from a mesh shows nothing."""
        boxes = self._world.boxes
        nearest = np.clip((x, y), boxes[:, :2], boxes[:, 2:])
        order = np.argsort(np.hypot(*(nearest - (x, y)).T), kind="stable")[:_MOST_BOXES_SHOWN]
        faces = self._world.faces.reshape(len(boxes), -1, 3)[order].reshape(-1, 3)
        # A corner of its own for each triangle, so that light falls on it as on a flat side.
        corners = self._world.vertices[faces].reshape(-1, 3)
        sides = np.cross(corners[1::3] - corners[::3], corners[2::3] - corners[::3])
        normals = np.repeat(sides / np.linalg.norm(sides, axis=1, keepdims=True), 3, axis=0)
        shape = pybullet.createVisualShape(
            pybullet.GEOM_MESH,
            vertices=corners.tolist(),
            indices=list(range(len(corners))),
            normals=normals.tolist(),
            rgbaColor=(0.78, 0.74, 0.66, 1.0),
            physicsClientId=self._client,
        )
        body: int = pybullet.createMultiBody(
            0, baseVisualShapeIndex=shape, physicsClientId=self._client
        )
        return body

    def _build_walls(self, world: RenderedWorld, first: int, last: int) -> int:
        """Build boxes [first, last) as one concave mesh."""
        vertices = world.vertices[8 * first : 8 * last]
        faces = world.faces[12 * first : 12 * last] - 8 * first
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_MESH,
            vertices=vertices.tolist(),
            indices=faces.ravel().tolist(),
            flags=pybullet.GEOM_FORCE_CONCAVE_TRIMESH,
            physicsClientId=self._client,
        )
        body: int = pybullet.createMultiBody(0, shape, physicsClientId=self._client)
        return body

    def _build_robot(self, start: Pose2D) -> int:
        frame, client = self._frame, self._client
        height = frame.ground_clearance + frame.height / 2 + _STANDING_GAP_M
        # PyBullet reads robots from files only.
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "robot.urdf"
            file.write_text(self._urdf, encoding="utf-8")
            robot: int = pybullet.loadURDF(
                str(file),
                (start.x, start.y, height),
                pybullet.getQuaternionFromEuler((0.0, 0.0, start.yaw)),
                flags=pybullet.URDF_USE_INERTIA_FROM_FILE,
                physicsClientId=client,
            )
        for wheel in range(len(WHEELS)):
            pybullet.changeDynamics(
                robot,
                wheel,
                lateralFriction=WHEEL_FRICTION,
                anisotropicFriction=(1.0, 1.0, LATERAL_SHARE),
                physicsClientId=client,
            )
            for wall in self._walls:
                pybullet.setCollisionFilterPair(robot, wall, wheel, -1, 0, physicsClientId=client)
        return robot
