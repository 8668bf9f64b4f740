"""`Scenario`: a sub-trajectory eta that gets 5 m away from where it began (section III-B)."""

from dataclasses import dataclass
from typing import Literal

from ses_core.geometry import Pose2D
from ses_core.recipes import digest_json


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """One scenario, or the terminal segment that never got that far.

    Attributes:
        kind: `scenario`, or `terminal` for the unfinished rest of a trajectory.
        first_step: First step within the log; the closing step of the scenario before it.
        last_step: The step that closed it.
        start: Pose at the first step.
        goal: Position at the last step [m].
        negative_velocity_count: Steps with v < 0 after the first step; None where unknown.
        not_forward_count: Steps with v <= 0.05 m/s after the first step; None where unknown.
        reversing_s: Seconds of reversing; None where unknown.
        outcome: For terminal segments `stopped` or `moving` or `cut`; empty otherwise.
    """

    kind: Literal["scenario", "terminal"]
    first_step: int
    last_step: int
    start_stamp_ns: int
    duration_s: float
    arc_length_m: float
    start: Pose2D
    goal: tuple[float, float]
    negative_velocity_count: int | None
    not_forward_count: int | None
    reversing_s: float | None
    outcome: str = ""


def scenario_id(log_id: str, scenario: Scenario) -> str:
    """Identify a scenario by its log and its steps: 16 hexadecimal digits."""
    return digest_json([log_id, scenario.kind, scenario.first_step, scenario.last_step])[:16]
