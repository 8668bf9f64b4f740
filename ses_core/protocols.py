"""The seams: six protocols, each with at least two implementations and one contract test."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ses_core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from ses_core.extraction.recording import Recording
from ses_core.navigation import NavigationDomain, NavigationTask
from ses_core.recipes import ArtifactRef, Recipe
from ses_core.robot_profile import RobotProfile
from ses_core.simulation.trace import Trace


class LogReader(Protocol):
    """Decodes one format of robot log; run only inside the limited decoder process."""

    def read(self, log: Path, *, profile: RobotProfile, pose_source: str) -> Recording:
        """Decode a log.

        Raises:
            LogError: The log cannot be used; its reason is from the closed list.
        """
        ...


class FittedSynthesizer(Protocol):
    """Draws environments like those it was fitted to."""

    @property
    def is_endless(self) -> bool:
        """Whether asking again brings new samples; else `sample` begins again with the same ones.

        What is not endless is asked once, for as many as could be needed.
        """
        ...

    def sample(self, count: int, *, rng: Generator, radius: float | None = None) -> BoolArray:
        """Draw cells (count or fewer, 30, 30), fewer where there are no more distinct ones.

        Args:
            count: How many are wanted.
            rng: Source of chance.
            radius: Of the disc [m] that is to get across, for methods that can see to that. The
                caller checks all the same.
        """
        ...

    def arrays(self) -> Mapping[str, NDArray[np.generic]]:
        """Give what rebuilds it without pickle."""
        ...


class Synthesizer(Protocol):
    """Learns what challenging environments look like (section III-C)."""

    def fit(
        self,
        domain: NavigationDomain,
        *,
        rng: Generator,
        progress: Callable[[float], None],
        start: FittedSynthesizer | None = None,
    ) -> FittedSynthesizer:
        """Fit to a domain, hardest environment first.

        Args:
            domain: What to learn from.
            rng: Source of chance.
            progress: Hears the share that is done, from 0 to 1.
            start: Earlier fit of the same method to go on from (a warm start); methods whose
                fit has no beginning pay it no heed.
        """
        ...


class Simulator(Protocol):
    """N robots, each in its own world, each under the whole navigation stack.

    A slot n holds one episode. `advance` moves every unfinished slot by whole control ticks:
    sense, plan, command, move. A finished slot stays as it ended until it is reset.
    """

    @property
    def slots(self) -> int:
        """N, the number of robots stepped together."""
        ...

    @property
    def time_step(self) -> float:
        """Duration of one control tick [s]."""
        ...

    def reset(self, slots: IntArray, tasks: Sequence[NavigationTask], seeds: IntArray) -> None:
        """Start an episode in each of the slots (S,) from tasks and noise seeds (S,)."""
        ...

    def advance(self, parameters: FloatArray, ticks: int) -> None:
        """Run control ticks under planner parameters (N, 8)."""
        ...

    def trace_into(self, trace: Trace) -> None:
        """Write every tick from now on into arrays of N slots, as long as an episode lasts."""
        ...

    def scans(self) -> Float32Array:
        """Give the newest scan (N, B) [m] of every slot."""
        ...

    def state(self) -> "SimulatorState":
        """Give a copy of every slot's state."""
        ...

    def costmap(self, number: int) -> "Costmap":
        """Give the map that one slot's robot has built, under its inflation radius."""
        ...

    def plan(self, number: int) -> FloatArray:
        """Give one slot's global plan (P, 2) [m], in the frame of its costmap."""
        ...

    def close(self) -> None:
        """Release what is held open."""
        ...


class SimulatorState(Protocol):
    """What is known of N episodes; arrays have a leading axis N."""

    @property
    def poses(self) -> FloatArray:
        """True poses (N, 3) [m, m, rad]."""
        ...

    @property
    def odometry(self) -> FloatArray:
        """Poses (N, 3) [m, m, rad] that the stack believes: at the start the true ones."""
        ...

    @property
    def velocities(self) -> FloatArray:
        """Measured velocities (N, 2) [m/s, rad/s]."""
        ...

    @property
    def commands(self) -> FloatArray:
        """Last commands (N, 2) [m/s, rad/s]."""
        ...

    @property
    def goals(self) -> FloatArray:
        """Goals (N, 2) [m]."""
        ...

    @property
    def local_goals(self) -> FloatArray:
        """Point (N, 2) [m] 1 m ahead on the global plan, in the robot's frame."""
        ...

    @property
    def times(self) -> FloatArray:
        """Time since the start (N,) [s]."""
        ...

    @property
    def path_lengths(self) -> FloatArray:
        """Way driven (N,) [m]."""
        ...

    @property
    def negative_counts(self) -> IntArray:
        """Control ticks with a commanded v < 0 (N,)."""
        ...

    @property
    def not_forward_counts(self) -> IntArray:
        """Control ticks with a commanded v <= 0.05 m/s (N,)."""
        ...

    @property
    def outcomes(self) -> IntArray:
        """`EpisodeOutcome` values (N,); RUNNING while unfinished."""
        ...


class Costmap(Protocol):
    """What a robot believes about its surroundings, for a picture."""

    @property
    def costs(self) -> Float32Array:
        """Costs (H, W) from 0 (free) over 253 (its centre must not be there) to 254 (occupied)."""
        ...

    @property
    def origin(self) -> tuple[float, float]:
        """Lower left corner [m]."""
        ...

    @property
    def resolution(self) -> float:
        """Edge of a cell [m]."""
        ...


class Policy(Protocol):
    """Sets planner parameters from observations."""

    def act(self, observations: FloatArray) -> FloatArray:
        """Map observations (N, D) to planner parameters (N, 8), deterministically."""
        ...


class ArtifactStore(Protocol):
    """Keeps artifacts by what was asked for, and never builds one twice."""

    def find(self, recipe: Recipe) -> ArtifactRef | None:
        """Give the artifact that answers a recipe, or None."""
        ...

    def put(self, recipe: Recipe, build: Callable[[Path], None]) -> ArtifactRef:
        """Build into an empty folder, then commit it as the answer to a recipe."""
        ...

    def forget(self, recipe: Recipe) -> None:
        """Drop the answer to a recipe, so that it is built again; its artifact stays."""
        ...

    def path(self, ref: ArtifactRef) -> Path:
        """Give the folder of an artifact, checked against its digest.

        Raises:
            ArtifactError: It is missing or damaged.
        """
        ...
