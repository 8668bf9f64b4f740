"""How a fleet's deployments are spread over worlds."""

from collections import Counter
from collections.abc import Sequence
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ses_core.errors import WorldError
from ses_core.navigation import NavigationTask, World
from ses_core.occupancy import OccupancyGrid
from ses_core.robot_profile import JACKAL
from ses_core.settings import EvaluationSettings, Settings
from ses_core.worlds.cellular_automata import generate_barn
from ses_core.worlds.homes import generate_homes
from storage.artifact_store import LocalArtifactStore
from tasks.deploy import DemonstrationFleet, deploy_demonstration, fleet_tasks


def closet() -> World:
    cells = np.zeros((60, 60), dtype=np.bool_)
    return World(world_id="closet", grid=OccupancyGrid(cells=cells, resolution=0.05))


def spread(worlds: list[World], count: int) -> list[NavigationTask]:
    return fleet_tasks(worlds, count, min_distance=6.6, profile=JACKAL, seed=5)


def test_worlds_without_pairs_leave_their_share_to_the_others() -> None:
    homes = generate_homes(2, seed=3)
    tasks = spread([homes[0], closet(), homes[1]], 7)
    driven = Counter(task.world.world_id for task in tasks)
    assert driven == {homes[0].world_id: 4, homes[1].world_id: 3}
    names = [task.world.world_id for task in tasks]
    assert names == sorted(names, key=[home.world_id for home in homes].index)


def test_the_one_course_of_a_world_is_driven_again() -> None:
    world = generate_barn(1, seed=1)[0].world
    tasks = spread([world], 3)
    assert len(tasks) == 3
    assert {(task.start, task.goal) for task in tasks} == {world.course}


def test_more_deployments_begin_with_the_same_pairs() -> None:
    homes = generate_homes(1, seed=3)
    few, many = spread(homes, 3), spread(homes, 8)
    assert [task.start for task in few] == [task.start for task in many[:3]]
    assert len({task.start for task in many}) > 3


def test_without_any_pair_the_fleet_stays_at_home() -> None:
    with pytest.raises(WorldError, match=r"none of 1 worlds has two places 6\.6 m apart"):
        spread([closet()], 3)


@pytest.mark.parametrize(
    "changed", [{"simulator": "bullet"}, {"min_distance_m": 9.0}, {"pair_preset": "long"}]
)
def test_the_demonstration_is_driven_anew_and_as_its_settings_say(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, changed: dict[str, Any]
) -> None:
    driven: list[Sequence[NavigationTask]] = []

    def note(tasks: Sequence[NavigationTask], *_: object, out: Path, **__: object) -> None:
        driven.append(tasks)
        (out / "log").touch()

    monkeypatch.setattr("tasks.deploy._drive", note)
    homes = generate_homes(1, seed=3)
    monkeypatch.setattr("tasks.deploy.generate_homes", lambda count, *, seed: homes)
    monkeypatch.setattr("tasks.deploy.conclude", lambda made: made)
    store = LocalArtifactStore(tmp_path)
    fleet = DemonstrationFleet(homes=1, deployments=2, seed=3, day=date(2026, 11, 20))
    for evaluation in (EvaluationSettings(), EvaluationSettings(**changed)):
        settings = Settings(evaluation=evaluation)
        deploy_demonstration.fn(fleet, store=store, settings=settings)
        expected = fleet_tasks(
            homes,
            2,
            min_distance=evaluation.min_distance_m,
            preset=evaluation.pair_preset,
            profile=JACKAL,
            seed=3,
        )
        assert [task.start for task in driven[-1]] == [task.start for task in expected]
    assert len(driven) == 2
