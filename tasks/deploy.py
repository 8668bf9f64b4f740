"""Deploy: a simulated fleet drives, and its logs are written as a real fleet's would be."""

import time
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from datetime import UTC, date, datetime
from itertools import cycle, islice
from pathlib import Path

import numpy as np
from prefect import task
from prefect.cache_policies import NO_CACHE

from ses_core.errors import WorldError
from ses_core.navigation import NavigationTask, World
from ses_core.recipes import Recipe, settings_json
from ses_core.robot_profile import RobotProfile
from ses_core.settings import Settings
from ses_core.worlds.deployment import Deployment, deploy
from ses_core.worlds.homes import generate_homes
from ses_core.worlds.identity import content_digest
from ses_core.worlds.pairs import PairPreset, sample_tasks
from storage.artifact_store import LocalArtifactStore
from storage.deployment_logs import FleetFormat, write_deployments
from storage.materialize import Materialized, materialize
from storage.policy_files import NamedPolicy, find_policy
from storage.stages import DEPLOY
from storage.world_sets import read_worlds
from tasks.outcome import conclude
from tasks.progress import report_progress


@dataclass(slots=True, kw_only=True)
class FleetDay:
    """What a fleet's day came to; `ticks` are control ticks of all robots."""

    deployments: int = 0
    ticks: int = 0
    seconds: float = 0.0
    outcomes: Counter[str] = field(default_factory=Counter)


@dataclass(frozen=True, slots=True, kw_only=True)
class DemonstrationFleet:
    """The embedded default: generated homes, and how often a fleet drives through them."""

    homes: int
    deployments: int
    seed: int
    day: date


def fleet_tasks(
    worlds: Sequence[World],
    count: int,
    *,
    min_distance: float,
    profile: RobotProfile,
    seed: int,
    preset: PairPreset = "default",
) -> list[NavigationTask]:
    """Spread deployments evenly over the worlds that have pairs; those in one follow each other.

    A world of one course is driven again and again, each time with other noise.

    Raises:
        WorldError: No world has room for a start and a goal so far apart.
    """

    def pairs(world: World, number: int) -> list[NavigationTask]:
        # More pairs of a world begin with the same ones.
        rng = np.random.default_rng([seed, int(content_digest(world.grid)[:8], 16)])
        return sample_tasks(
            world, number, profile=profile, min_distance=min_distance, preset=preset, rng=rng
        )

    drawn = [pairs(world, -(-count // len(worlds))) for world in worlds]
    usable = [world for world, tasks in zip(worlds, drawn, strict=True) if tasks]
    if not usable:
        raise WorldError(
            f"none of {len(worlds)} worlds has two places {min_distance:g} m apart, expected one"
        )
    if len(usable) < len(worlds):
        drawn = [pairs(world, -(-count // len(usable))) for world in usable]
    share, more = divmod(count, len(usable))
    # A robot's drives are written together: what waits for its log stays in memory.
    return [
        task
        for place, tasks in enumerate(drawn)
        for task in islice(cycle(tasks), share + (place < more))
    ]


@task(name="deploy the fleet", cache_policy=NO_CACHE)
def deploy_fleet(
    worlds: tuple[Path, ...],
    *,
    part: str | None,
    resolution: float | None,
    policy: str,
    deployments: int,
    out: Path,
    log_format: FleetFormat,
    seed: int,
    day: date | None,
    store: LocalArtifactStore,
    settings: Settings,
) -> FleetDay:
    """Let a fleet drive in worlds and write its logs into a folder."""
    found = read_worlds(worlds, part=part, resolution=resolution)
    tasks = fleet_tasks(
        found,
        deployments,
        min_distance=settings.evaluation.min_distance_m,
        preset=settings.evaluation.pair_preset,
        profile=settings.target_robot,
        seed=seed,
    )
    return _drive(
        tasks,
        find_policy(policy, store.layout),
        out=out,
        log_format=log_format,
        day=day or datetime.now(UTC).date(),
        seed=seed,
        settings=settings,
    )


def demonstration_recipe(fleet: DemonstrationFleet, policy_id: str, settings: Settings) -> Recipe:
    """Name all that decides what the demonstration's logs hold."""
    return Recipe(
        DEPLOY,
        {
            "homes": fleet.homes,
            "deployments": fleet.deployments,
            "seed": fleet.seed,
            "day": fleet.day.isoformat(),
            "policy": policy_id,
            "simulator": settings.evaluation.simulator,
            "min_distance_m": settings.evaluation.min_distance_m,
            "pair_preset": settings.evaluation.pair_preset,
            "simulation": settings_json(settings.simulation),
            "fleet": settings_json(settings.fleet),
            "target_robot": settings_json(settings.target_robot),
        },
    )


@task(name="deploy the demonstration fleet", cache_policy=NO_CACHE)
def deploy_demonstration(
    fleet: DemonstrationFleet, *, store: LocalArtifactStore, settings: Settings
) -> Materialized:
    """Let a small fleet drive through generated homes; its logs are kept as an artifact."""
    policy = find_policy("original", store.layout)
    recipe = demonstration_recipe(fleet, policy.policy_id, settings)

    def build(directory: Path) -> None:
        tasks = fleet_tasks(
            generate_homes(fleet.homes, seed=fleet.seed),
            fleet.deployments,
            min_distance=settings.evaluation.min_distance_m,
            preset=settings.evaluation.pair_preset,
            profile=settings.target_robot,
            seed=fleet.seed,
        )
        _drive(
            tasks,
            policy,
            out=directory,
            log_format="mcap",
            day=fleet.day,
            seed=fleet.seed,
            settings=settings,
        )

    return conclude(materialize(store, recipe, build))


def _drive(
    tasks: Sequence[NavigationTask],
    policy: NamedPolicy,
    *,
    out: Path,
    log_format: FleetFormat,
    day: date,
    seed: int,
    settings: Settings,
) -> FleetDay:
    started, total = time.perf_counter(), FleetDay()
    driven = deploy(
        tasks,
        policy.policy,
        seed=seed,
        simulation=settings.simulation,
        profile=settings.target_robot,
        simulator=settings.evaluation.simulator,
        progress=report_progress("deploy"),
    )
    write_deployments(
        out,
        _counted(driven, total),
        tasks=tasks,
        format=log_format,
        day=day,
        settings=settings,
    )
    total.seconds = round(time.perf_counter() - started, 3)
    return total


def _counted(deployments: Iterable[Deployment], total: FleetDay) -> Iterator[Deployment]:
    for deployment in deployments:
        total.deployments += 1
        total.ticks += len(deployment.times) - 1
        total.outcomes[deployment.outcome.name.lower()] += 1
        yield deployment
