"""Which trial `ses show episode` means: looked up in an evaluation, or described by options."""

import math
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from flows.command_arguments import misuse

if TYPE_CHECKING:
    from ses_core.evaluation.episodes import Episode
    from ses_core.evaluation.trials import Trial
    from ses_core.navigation import World
    from ses_core.settings import Settings

MOST_NAMES = 5
"""Worlds named in an error message."""


def recorded_episode(
    identity: str | None, evaluation: Path | None, *, described: Collection[str]
) -> "Episode | None":
    """Look an episode up in an evaluation; None where no id was given.

    Args:
        identity: Of the episode.
        evaluation: Folder that `ses evaluate` wrote.
        described: Options that describe a trial, which the evaluation does.

    Raises:
        typer.BadParameter: It is not there, or only one of both was given, or both ways.
    """
    from storage.evaluation_files import read_episodes

    if identity is None and evaluation is None:
        return None
    if identity is None or evaluation is None:
        found, lacking = (
            ("--evaluation", "EPISODE_ID") if identity is None else ("EPISODE_ID", "--evaluation")
        )
        raise typer.BadParameter(f"found no {lacking}, expected it with {found}", param_hint=found)
    for option in described:
        raise typer.BadParameter(
            "found it beside EPISODE_ID, expected one of the two", param_hint=option
        )
    with misuse("--evaluation"):
        episodes = read_episodes(evaluation)
    episode = next((one for one in episodes if one.episode_id == identity), None)
    if episode is None:
        raise typer.BadParameter(
            f"found {identity!r}, expected the id of one of the {len(episodes)} episodes in "
            f"{evaluation}",
            param_hint="EPISODE_ID",
        )
    if math.isnan(episode.start_x_m):
        raise typer.BadParameter(
            "found episodes without start and goal, expected an evaluation by this release",
            param_hint="--evaluation",
        )
    return episode


def chosen_trial(
    worlds: "Sequence[World]", settings: "Settings", *, world: str | None, pair: int, trial: int
) -> "Trial":
    """Draw a trial by the rule of `ses evaluate`.

    Raises:
        typer.BadParameter: There is no such world or pair.
    """
    from ses_core.evaluation.places import sampled_places
    from ses_core.evaluation.trials import trial_of

    one = worlds[0] if world is None else _named(worlds, world)
    evaluation = settings.evaluation.model_copy(update={"pairs": pair + 1})
    places = sampled_places([one], settings=evaluation, profile=settings.target_robot)
    if not places:
        raise typer.BadParameter(
            f"found {evaluation.min_distance_m:g} m, expected less: {one.world_id} has no two "
            "places so far apart",
            param_hint="--min-distance",
        )
    if len(places) <= pair:
        raise typer.BadParameter(
            f"found {pair}, expected 0: {one.world_id} has one course", param_hint="--pair"
        )
    return trial_of(places[pair], trial, seed=evaluation.seed)


def recorded_trial(worlds: "Sequence[World]", settings: "Settings", episode: "Episode") -> "Trial":
    """Give the trial of an episode of an evaluation.

    Raises:
        typer.BadParameter: Its world is not among those given.
    """
    from ses_core.evaluation.trials import Trial, evaluation_task
    from ses_core.geometry import Pose2D
    from ses_core.navigation import NavigationTask

    world = next((one for one in worlds if one.world_id == episode.world_id), None)
    if world is None:
        raise typer.BadParameter(
            f"found {len(worlds)} other worlds, expected {episode.world_id}, in which the episode "
            "was driven",
            param_hint="--worlds",
        )
    task = NavigationTask(
        world=world,
        start=Pose2D(episode.start_x_m, episode.start_y_m, episode.start_yaw_rad),
        goal=(episode.goal_x_m, episode.goal_y_m),
    )
    place = evaluation_task(task, pair=episode.pair, profile=settings.target_robot)
    return Trial(place, episode.trial, episode.seed)


def _named(worlds: "Sequence[World]", name: str) -> "World":
    """Find the only world of a name or id.

    Raises:
        typer.BadParameter: There is none, or more than one.
    """
    found = [one for one in worlds if name in (one.world_id, one.name)]
    if len(found) == 1:
        return found[0]
    listed = [one.world_id for one in found or worlds]
    names = ", ".join(listed[:MOST_NAMES]) + (", ..." if len(listed) > MOST_NAMES else "")
    problem = f"{len(found)} worlds named {name!r}" if found else repr(name)
    raise typer.BadParameter(
        f"found {problem}, expected one of {len(listed)} worlds: {names}", param_hint="--world"
    )
