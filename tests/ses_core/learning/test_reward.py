"""Tests of the reward, its presets and what the settings put in their place."""

from typing import Literal

import numpy as np
import pytest

from ses_core.arrays import FloatArray
from ses_core.evaluation.outcomes import EpisodeOutcome
from ses_core.learning.reward import (
    AUTHORS_REWARD,
    DEFAULT_REWARD,
    PAPER_REWARD,
    RewardSpec,
    nearness,
    reward_of,
    rewards,
    way_made,
)
from ses_core.settings import TrainingSettings
from tests.ses_core.learning.snapshots import Snapshot

ENDINGS = np.array(list(EpisodeOutcome))
FAR = np.full(5, np.inf)


def given(
    spec: RewardSpec, *, before: float = 2.0, after: float = 2.5, near: FloatArray = FAR
) -> list[float]:
    """Rewards of a decision by the five ways it may end."""
    return rewards(
        spec,
        before=np.full(5, before),
        after=np.full(5, after),
        outcomes=ENDINGS,
        near=near,
    ).tolist()


@pytest.mark.parametrize(
    ("spec", "expected"),
    [
        (DEFAULT_REWARD, [0.5, 20.5, -19.5, -19.5, -19.5]),
        (AUTHORS_REWARD, [0.5, 20.5, 0.5, 0.5, 0.5]),
        # Half of what is left of 2.5 m without its hundredth, and of 2 m.
        (PAPER_REWARD, [0.2375, 10.2375, 0.2375, 0.2375, 0.2375]),
    ],
    ids=lambda value: value.name if isinstance(value, RewardSpec) else "",
)
def test_every_ending_has_its_reward(spec: RewardSpec, expected: list[float]) -> None:
    assert [outcome.name for outcome in EpisodeOutcome] == [
        "RUNNING",
        "SUCCESS",
        "COLLISION",
        "TIMEOUT",
        "STUCK",
    ]
    assert given(spec) == pytest.approx(expected)


def test_going_away_costs_what_coming_back_earns() -> None:
    away = given(DEFAULT_REWARD, before=-1.0, after=-4.0)[0]
    back = given(DEFAULT_REWARD, before=-4.0, after=-1.0)[0]
    assert away == -3.0
    assert away + back == 0.0


def test_standing_still_costs_only_where_the_way_is_discounted() -> None:
    assert given(AUTHORS_REWARD, before=2.0, after=2.0)[0] == 0.0
    assert given(PAPER_REWARD, before=2.0, after=2.0)[0] == pytest.approx(-0.01)


def moved(x: float, y: float) -> Snapshot:
    """A robot that started at the origin, with its goal 3 m along y."""
    return Snapshot(
        poses=np.array([[x, y, 0.3]]),
        goals=np.array([[0.0, 3.0]]),
        local_goals=np.array([[1.0, 0.0]]),
    )


def test_the_way_is_measured_to_the_goal_or_along_the_line_to_it() -> None:
    starts = np.zeros((1, 2))
    for (x, y), to_goal, along in (
        ((0.0, 0.0), -3.0, 0.0),
        ((0.0, 1.0), -2.0, 1.0),
        ((4.0, 0.0), -5.0, 0.0),
        ((0.0, -1.0), -4.0, -1.0),
    ):
        assert way_made(DEFAULT_REWARD, moved(x, y), starts).tolist() == [to_goal]
        assert way_made(AUTHORS_REWARD, moved(x, y), starts).tolist() == [along]
    assert way_made(AUTHORS_REWARD, moved(4.0, 1.0), np.array([[4.0, 3.0]])).tolist() == [0.0]


def test_nearness_costs_below_0_3_m_where_it_has_a_weight() -> None:
    near = np.array([0.1, 0.1, 0.29, 0.31, np.inf])
    spec = AUTHORS_REWARD.model_copy(update={"collision_weight": 0.6})
    free = given(AUTHORS_REWARD, near=near)
    costs = [before - after for before, after in zip(free, given(spec, near=near), strict=True)]
    assert costs == pytest.approx([4.0, 4.0, 0.6 / 0.34, 0.0, 0.0])


def test_nearness_is_the_mean_of_the_ten_nearest_readings() -> None:
    scans = np.full((3, 720), 5.0, dtype=np.float32)
    scans[0, 100:120] = 0.2
    scans[1, 300:305] = 0.5
    scans[2, :] = np.nan
    scans[2, :9] = 0.4
    scans[:, 719] = 0.05  # below the laser's least range: nothing came back
    assert nearness(scans, least_range=0.1).tolist() == pytest.approx([0.2, 2.75, np.inf])


@pytest.mark.parametrize("preset", ["default", "authors", "paper"])
def test_the_preset_chooses_the_reward_and_settings_replace_its_terms(
    preset: Literal["default", "authors", "paper"],
) -> None:
    spec = reward_of(TrainingSettings(preset=preset))
    assert spec.name == preset
    settings = TrainingSettings(preset=preset, failure_penalty=0.0, collision_weight=0.3)
    terms = {"failure_penalty": 0.0, "collision_weight": 0.3}
    assert reward_of(settings) == spec.model_copy(update=terms)
