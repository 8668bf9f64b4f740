"""Evaluate: paired trials of several policies on worlds that none of them was trained in."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from prefect import task
from prefect.cache_policies import NO_CACHE

from ses_core.errors import SesError, WorldError
from ses_core.evaluation.places import crossing_places, sampled_places
from ses_core.evaluation.statistics import summarize
from ses_core.evaluation.trials import EvaluationTask, evaluate
from ses_core.navigation import NavigationTask, environment_task
from ses_core.recipes import ArtifactRef, JsonValue, Recipe, digest_json, settings_json
from ses_core.settings import Settings
from ses_core.simulation.factory import SimulatorName
from ses_core.worlds.identity import content_digest, world_digest
from storage.artifact_store import LocalArtifactStore
from storage.environment_files import read_environments
from storage.evaluation_files import write_evaluation
from storage.materialize import Materialized, materialize
from storage.policy_files import find_policy
from storage.selection_files import read_selection
from storage.stages import EVALUATE
from storage.world_sets import read_worlds
from tasks.outcome import conclude
from tasks.progress import report_progress


@dataclass(frozen=True, slots=True, kw_only=True)
class HeldoutWorlds:
    """Where the worlds come from that policies are measured on.

    Attributes:
        selection: A selection, whose held-out places are crossed; or
        paths: Files and folders of worlds, in which pairs are drawn.
        part: Only this part of a folder, by its `split.csv`.
        resolution: Of images that carry none [m per pixel].
    """

    selection: ArtifactRef | None = None
    paths: tuple[Path, ...] = ()
    part: str | None = None
    resolution: float | None = None


def heldout_digest(source: HeldoutWorlds) -> str:
    """Digest the worlds of some paths; empty where the night holds out places itself.

    Raises:
        WorldError: A path holds no worlds.
    """
    if not source.paths:
        return ""
    worlds = read_worlds(source.paths, part=source.part, resolution=source.resolution)
    return digest_json(
        [[world.world_id, world_digest(world.grid, world.course)] for world in worlds]
    )


def refuse_known_worlds(
    places: Sequence[EvaluationTask], trained_in: Sequence[NavigationTask]
) -> None:
    """Check that nothing is measured where it was trained.

    Raises:
        SesError: A held-out world is one of the training worlds, cell by cell.
    """
    known = {content_digest(one.world.grid) for one in trained_in}
    for place in places:
        if content_digest(place.task.world.grid) in known:
            raise SesError(
                f"held-out world {place.world_id} is also a training world, expected a world "
                "that no policy has seen"
            )


def heldout_places(
    source: HeldoutWorlds, *, store: LocalArtifactStore | None, settings: Settings
) -> list[EvaluationTask]:
    """Give the start-goal pairs of held-out worlds; none where nothing was held out.

    Raises:
        WorldError: A path holds no worlds.
    """
    if source.paths:
        worlds = read_worlds(source.paths, part=source.part, resolution=source.resolution)
        return sampled_places(worlds, settings=settings.evaluation, profile=settings.target_robot)
    if source.selection is None or store is None:
        return []
    selection = read_selection(store.path(source.selection))
    return crossing_places(selection.heldout_environments, settings.target_robot)


@task(name="evaluate policies", task_run_name="evaluate in {simulator}", cache_policy=NO_CACHE)
def evaluate_policies(
    policies: Mapping[str, str],
    heldout: HeldoutWorlds,
    *,
    environments: ArtifactRef,
    simulator: SimulatorName,
    trials: int,
    most_places: int | None = None,
    store: LocalArtifactStore,
    settings: Settings,
    anew: bool = False,
) -> Materialized:
    """Drive every policy through the same trials, and keep every episode.

    Args:
        policies: What each is found by, under the name that tables show, first the one in question.
        heldout: Worlds that none of them was trained in.
        environments: What the first one was trained in.
        simulator: `batch` or `bullet`.
        trials: Trials of each pair and policy.
        most_places: Only the first so many pairs.
        store: Where the episodes go.
        settings: Evaluation, simulation and target robot.
        anew: Drive although it was done before.

    Raises:
        SesError: A held-out world is one of the training worlds.
    """
    named = {label: find_policy(name, store.layout) for label, name in policies.items()}
    places = heldout_places(heldout, store=store, settings=settings)[:most_places]
    trained_in = read_environments(store.path(environments)).environments
    refuse_known_worlds(places, [environment_task(one) for one in trained_in])
    asked: dict[str, JsonValue] = {
        "policies": [[label, policy.policy_id] for label, policy in named.items()],
        "places": digest_json([_place_key(place) for place in places]),
        "trials": trials,
        "simulator": simulator,
        "seed": settings.evaluation.seed,
        "simulation": settings_json(settings.simulation),
        "target_robot": settings_json(settings.target_robot),
    }

    def build(directory: Path) -> None:
        episodes = evaluate(
            {label: policy.policy for label, policy in named.items()},
            places,
            trials=trials,
            seed=settings.evaluation.seed,
            simulation=settings.simulation,
            profile=settings.target_robot,
            simulator=simulator,
            progress=report_progress("evaluate"),
        )
        write_evaluation(directory, episodes)

    return conclude(materialize(store, Recipe(EVALUATE, asked), build, anew=anew))


@task(name="evaluate policies by hand", cache_policy=NO_CACHE)
def evaluate_in_folder(
    policies: tuple[str, ...],
    heldout: HeldoutWorlds,
    *,
    out: Path,
    store: LocalArtifactStore,
    settings: Settings,
) -> None:
    """Drive policies through the same trials; write episodes, summary and figures into a folder.

    Raises:
        WorldError: No world has room for a start and a goal so far apart.
    """
    # matplotlib takes half a second to import: only who draws pays for it.
    from ses_core.pictures.evaluation_figure import draw_evaluation, draw_worlds

    places = heldout_places(heldout, store=store, settings=settings)
    if not places:
        raise WorldError(
            f"no world has two places {settings.evaluation.min_distance_m:g} m apart, expected one"
        )
    episodes = evaluate(
        {name: find_policy(name, store.layout).policy for name in policies},
        places,
        trials=settings.evaluation.trials,
        seed=settings.evaluation.seed,
        simulation=settings.simulation,
        profile=settings.target_robot,
        simulator=settings.evaluation.simulator,
        progress=report_progress("evaluate"),
    )
    write_evaluation(out, episodes)
    (out / "policies.png").write_bytes(draw_evaluation(summarize(episodes)))
    (out / "worlds.png").write_bytes(draw_worlds(episodes))


def _place_key(place: EvaluationTask) -> list[JsonValue]:
    """Give what makes a pair itself: its world's cells, start and goal."""
    start, goal = place.task.start, place.task.goal
    cells = content_digest(place.task.world.grid)
    return [place.world_id, place.pair, cells, start.x, start.y, start.yaw, goal[0], goal[1]]
