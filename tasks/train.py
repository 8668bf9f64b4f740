"""Train: fine-tune the parameter policy from the deployed one in the synthesized environments."""

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, astuple
from pathlib import Path

import numpy as np
from prefect import task
from prefect.cache_policies import NO_CACHE

from ses_core.arrays import Float32Array, FloatArray
from ses_core.evaluation.difficulty import draw_weights
from ses_core.learning.policy_bundle import Lineage
from ses_core.learning.reward import reward_of
from ses_core.navigation import NavigationTask, environment_task
from ses_core.recipes import ArtifactRef, JsonValue, Recipe, digest_json, settings_json
from ses_core.settings import Settings
from ses_core.worlds.identity import content_digest
from storage.artifact_store import LocalArtifactStore
from storage.checkpoint_files import CheckpointFile
from storage.difficulty_files import read_difficulties
from storage.environment_files import read_environments
from storage.materialize import Materialized, materialize
from storage.policy_files import (
    NamedPolicy,
    find_policy,
    read_critic,
    write_critic,
    write_curve,
    write_policy,
)
from storage.stage_records import write_record
from storage.stages import TRAIN
from storage.training_record import TRAINING_FILE, TrainingRecord
from storage.world_sets import read_worlds
from tasks.difficulty import drive_again
from tasks.outcome import conclude
from tasks.progress import report_progress


def stop_at(deadline_stamp_s: float | None) -> Callable[[], bool]:
    """Give the question a training asks after every decision: is it time to stop?"""
    return lambda: deadline_stamp_s is not None and time.time() >= deadline_stamp_s


@task(name="train the policy", cache_policy=NO_CACHE)
def train_policy(
    environments: ArtifactRef,
    *,
    parent: str,
    run_id: str,
    store: LocalArtifactStore,
    settings: Settings,
    difficulty: ArtifactRef | None = None,
    deadline_stamp_s: float | None = None,
    anew: bool = False,
) -> Materialized:
    """Go on from the parent in the synthesized environments, and bundle what was learned.

    Args:
        environments: What episodes are drawn from.
        parent: Name of the policy to go on from.
        run_id: The night that asks.
        store: Where the bundle goes.
        settings: Training, simulation and target robot.
        difficulty: How hard the parent finds them; it counts only where training uses it.
        deadline_stamp_s: Unix time at which training stops where it is [s].
        anew: Train although it was done before.
    """
    source = find_policy(parent, store.layout)
    asked: dict[str, JsonValue] = {
        "training": settings_json(settings.training),
        "simulation": settings_json(settings.simulation),
        "target_robot": settings_json(settings.target_robot),
        "parent": source.policy_id,
        "has_deadline": deadline_stamp_s is not None,
    }
    use = settings.training.difficulty
    inputs: tuple[ArtifactRef, ...] = (environments,)
    if use != "ignore" and difficulty is not None:
        inputs += (difficulty,)

    recipe = Recipe(TRAIN, asked, inputs=inputs)

    def build(directory: Path) -> None:
        domain = read_environments(store.path(environments))
        tasks = [environment_task(environment) for environment in domain.environments]
        found = [row for ref in inputs[1:] for row in read_difficulties(store.path(ref))]
        made_by = sorted({environment.origin for environment in domain.environments})
        save_training(
            directory,
            tasks,
            parent=source,
            run_id=run_id,
            trained_in=f"environments of 5 m synthesized by {', '.join(made_by)}",
            settings=settings,
            weights=draw_weights(domain.environments, found, use),
            checkpoint=store.layout.staging / f"{recipe.key()}.checkpoint",
            deadline=stop_at(deadline_stamp_s),
        )

    return conclude(materialize(store, recipe, build, anew=anew))


@task(name="train the policy in a folder", cache_policy=NO_CACHE)
def train_in_folder(
    environments: Path, *, parent: str, out: Path, store: LocalArtifactStore, settings: Settings
) -> TrainingRecord:
    """Go on from the parent in a folder of environments, and write the bundle into another."""
    domain = read_environments(environments)
    source, use = find_policy(parent, store.layout), settings.training.difficulty
    found = [] if use == "ignore" else drive_again(domain.environments, source, settings=settings)
    return save_training(
        out,
        [environment_task(environment) for environment in domain.environments],
        parent=source,
        run_id="",
        trained_in=f"{len(domain.environments)} environments of 5 m",
        settings=settings,
        weights=draw_weights(domain.environments, found, use),
    )


@task(name="pretrain the original policy", cache_policy=NO_CACHE)
def pretrain_policy(
    worlds: tuple[Path, ...],
    *,
    part: str | None,
    resolution: float | None,
    steps: int | None,
    seed: int | None,
    out: Path,
    settings: Settings,
) -> TrainingRecord:
    """Train from random weights, by default as the shipped original policy was."""
    from ses_core.learning.pretraining import (
        PRETRAINING_SIMULATION,
        generated_worlds,
        pretraining,
        training_tasks,
    )

    training = pretraining(settings.training, steps=steps, seed=seed)
    chosen = (
        read_worlds(worlds, part=part, resolution=resolution)
        if worlds
        else generated_worlds("train")
    )
    return save_training(
        out,
        training_tasks(chosen, profile=settings.target_robot, seed=training.seed),
        parent=None,
        run_id="",
        trained_in=f"{len(chosen)} worlds " + ("given" if worlds else "of the BARN generator"),
        settings=settings.model_copy(
            update={"training": training, "simulation": PRETRAINING_SIMULATION}
        ),
    )


def save_training(
    directory: Path,
    tasks: Sequence[NavigationTask],
    *,
    parent: NamedPolicy | None,
    run_id: str,
    trained_in: str,
    settings: Settings,
    weights: FloatArray | None = None,
    checkpoint: Path | None = None,
    deadline: Callable[[], bool] = lambda: False,
) -> TrainingRecord:
    """Train and write bundle, learning curve and record into a folder.

    A training that was killed goes on from its last checkpoint when it is asked for again.

    Args:
        directory: Where to; it is made if it is missing.
        tasks: What episodes are drawn from.
        parent: The policy to go on from; None for random weights.
        run_id: The run that asks, for the lineage.
        trained_in: What the tasks are, in words, for the card.
        settings: Training, simulation and target robot.
        weights: How often each task is drawn; equally often without.
        checkpoint: File that checkpoints are kept in; without one, a file in the folder.
        deadline: Asked after every decision whether to stop.
    """
    # torch and stable-baselines3 take seconds to import: only a training pays for them.
    from ses_core.learning.pretraining import generated_worlds, training_tasks, with_replay
    from ses_core.learning.training import train

    bundle = parent.bundle if parent else None
    own_count = len(tasks) if weights is None else int(np.count_nonzero(weights))
    if bundle and settings.training.replay_share:
        tasks, weights = with_replay(
            tasks,
            weights,
            training_tasks(generated_worlds("train"), profile=settings.target_robot, seed=0),
            share=settings.training.replay_share,
        )
    directory.mkdir(parents=True, exist_ok=True)
    kept = CheckpointFile(
        checkpoint or directory / "training.checkpoint",
        asked=_training_digest(tasks, weights, bundle.policy_id if bundle else "", settings),
    )
    result = train(
        tasks,
        parent=bundle.policy if bundle else None,
        critic=_kept_critic(parent, settings),
        settings=settings.training,
        simulation=settings.simulation,
        profile=settings.target_robot,
        weights=weights,
        checkpoint=kept.found(),
        keep=kept.keep,
        progress=report_progress("train"),
        deadline=deadline,
    )
    record = TrainingRecord(
        algorithm=settings.training.algorithm,
        steps=result.steps,
        seed=settings.training.seed,
        environments=own_count,
        seconds=round(result.seconds, 1),
        ended=result.reason,
        parent=parent.name if parent else "",
        parent_id=bundle.policy_id if bundle else "",
        created_stamp_ns=time.time_ns(),
    )
    write_policy(
        directory,
        result.policy,
        lineage=Lineage(
            parent_id=record.parent_id,
            run_id=run_id,
            algorithm=record.algorithm,
            steps=record.steps,
            seed=record.seed,
            environments=record.environments,
            trained_in=trained_in,
        ),
        profile=settings.target_robot,
        simulation=settings.simulation,
        reward=reward_of(settings.training),
    )
    write_critic(directory, result.critic)
    write_curve(directory, result.curve)
    write_record(directory / TRAINING_FILE, asdict(record))
    kept.drop()
    return record


def _kept_critic(parent: NamedPolicy | None, settings: Settings) -> dict[str, Float32Array] | None:
    """Give the parent's critic where the settings ask for it; None where none was kept."""
    if parent is None or parent.folder is None or not settings.training.keep_critic:
        return None
    return read_critic(parent.folder)


def _training_digest(
    tasks: Sequence[NavigationTask],
    weights: FloatArray | None,
    parent_id: str,
    settings: Settings,
) -> str:
    """Digest everything that decides what a training gives."""
    courses = [
        [content_digest(task.world.grid), *astuple(task.start), *task.goal] for task in tasks
    ]
    return digest_json(
        [
            TRAIN.version,
            courses,
            None if weights is None else weights.tolist(),
            parent_id,
            settings_json(settings.training),
            settings_json(settings.simulation),
            settings_json(settings.target_robot),
        ]
    )
