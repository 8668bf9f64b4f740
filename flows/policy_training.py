"""Training by hand: the original policy from nothing, or a policy in a folder of environments."""

from pathlib import Path

from prefect import flow
from pydantic import BaseModel

from ses_core.settings import Settings
from storage.artifact_store import LocalArtifactStore
from storage.policy_files import read_policy
from storage.training_record import TrainingRecord
from tasks.train import pretrain_policy, train_in_folder


class TrainingSummary(BaseModel):
    """What was trained; `policy` is the folder of its bundle."""

    steps: int
    seconds: float
    policy: str
    policy_id: str
    ended: str


@flow(name="pretraining", flow_run_name="pretrain into {out}")
def pretrain(
    out: Path,
    worlds: tuple[Path, ...] = (),
    part: str | None = None,
    resolution: float | None = None,
    steps: int | None = None,
    seed: int | None = None,
    settings: Settings = Settings(),  # noqa: B008  (frozen; the UI shows it as the form's defaults)
) -> TrainingSummary:
    """Train the original policy from random weights.

    Args:
        out: Folder that the bundle goes into.
        worlds: Where it is trained; else worlds of the project's own BARN generator.
        part: Only this part of a folder of worlds, by its `split.csv`.
        resolution: Of images that carry none [m per pixel].
        steps: Decisions to train; else those of the shipped policy.
        seed: Of weights, exploration and simulation.
        settings: Those of `training` but its length, and the target robot.
    """
    record = pretrain_policy.submit(
        worlds, part=part, resolution=resolution, steps=steps, seed=seed, out=out, settings=settings
    ).result()
    return _summary(record, out)


@flow(name="policy training", flow_run_name="train into {out}")
def train(
    root: Path,
    environments: Path,
    out: Path,
    parent: str = "champion",
    settings: Settings = Settings(),  # noqa: B008  (frozen; the UI shows it as the form's defaults)
) -> TrainingSummary:
    """Fine-tune a policy in a folder of environments.

    Args:
        root: Folder of the store, in which a champion is looked for.
        environments: Folder of `environments.parquet`.
        out: Folder that the bundle goes into.
        parent: Policy to go on from.
        settings: Those of `training` and `simulation` and the target robot matter.
    """
    record = train_in_folder.submit(
        environments, parent=parent, out=out, store=LocalArtifactStore(root), settings=settings
    ).result()
    return _summary(record, out)


def _summary(record: TrainingRecord, out: Path) -> TrainingSummary:
    return TrainingSummary(
        steps=record.steps,
        seconds=record.seconds,
        policy=str(out),
        policy_id=read_policy(out).policy_id,
        ended=record.ended,
    )
