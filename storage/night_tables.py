"""What a night adds to the tables: selection, environments and their difficulty, trials, policy."""

from dataclasses import replace
from pathlib import Path

from ses_core.evaluation.episodes import episode_columns
from ses_core.evaluation.statistics import summarize
from storage.artifact_store import LocalArtifactStore
from storage.difficulty_files import read_conditions, read_difficulties, write_difficulties
from storage.environment_files import read_environments, write_environments
from storage.evaluation_files import EPISODES_FILE, read_episodes
from storage.night_artifacts import NightArtifacts
from storage.parquet_files import write_table
from storage.policy_files import read_policy
from storage.selection_files import read_selection
from storage.stage_records import read_record
from storage.training_record import TRAINING_FILE, TrainingRecord


def write_night_tables(
    directory: Path, night: NightArtifacts, *, store: LocalArtifactStore
) -> None:
    """Write one file per table that the night adds rows to, every row under its `run_id`."""
    if night.selection is not None:
        pool = read_selection(store.path(night.selection)).pool
        columns = {name: pool[name].tolist() if len(pool) else [] for name in _SELECTED}
        columns["run_id"] = [night.run_id] * len(pool)
        columns["count_kind"] = [night.settings.filter.count_kind] * len(pool)
        write_table(directory / "selections.parquet", "selections", columns)
    if night.environments is not None:
        write_environments(
            directory,
            read_environments(store.path(night.environments)),
            target=night.settings.target_robot,
            run_id=night.run_id,
        )
    if night.difficulty is not None:
        folder = store.path(night.difficulty)
        write_difficulties(
            directory,
            read_difficulties(folder),
            conditions=read_conditions(folder),
            run_id=night.run_id,
        )
    if night.evaluation is not None:
        _write_episodes(directory, night, store=store)
    if night.policy is not None:
        _write_policy_row(directory, night, store=store)


_SELECTED = ("scenario_id", "rank", "count", "environment_id")


def _write_episodes(directory: Path, night: NightArtifacts, *, store: LocalArtifactStore) -> None:
    driven = [
        episode
        for ref in (night.evaluation, night.spot_check)
        if ref is not None
        for episode in read_episodes(store.path(ref))
    ]
    # Two simulators drive the same trials: the id of an episode has to say which one did.
    episodes = [
        replace(
            episode,
            run_id=night.run_id,
            episode_id=f"{episode.episode_id}-{episode.simulator}",
        )
        for episode in driven
    ]
    write_table(directory / EPISODES_FILE, "episodes", episode_columns(episodes))


def _write_policy_row(directory: Path, night: NightArtifacts, *, store: LocalArtifactStore) -> None:
    assert night.policy is not None
    folder = store.path(night.policy)
    record = read_record(folder / TRAINING_FILE, TrainingRecord)
    episodes = read_episodes(store.path(night.evaluation)) if night.evaluation else []
    measured = next(iter(summarize(episodes)), None)
    row = {
        "policy_id": read_policy(folder).policy_id,
        "parent_id": record.parent_id,
        "run_id": night.run_id,
        "algorithm": record.algorithm,
        "steps": record.steps,
        "seed": record.seed,
        "environments": record.environments,
        "created_stamp_ns": record.created_stamp_ns,
        "decision": night.decision,
        "success_rate": measured.success_rate if measured else None,
        "mean_time_s": measured.mean_time_s if measured else None,
    }
    write_table(
        directory / "policies.parquet", "policies", {name: [value] for name, value in row.items()}
    )
