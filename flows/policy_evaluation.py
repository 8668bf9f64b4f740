"""Evaluation by hand: policies on the same worlds, pairs and seeds, side by side."""

from pathlib import Path

from prefect import flow
from pydantic import BaseModel

from flows.night_summary import ComparisonRow, EvaluationRow
from ses_core.evaluation.comparison import compare
from ses_core.evaluation.statistics import summarize
from ses_core.settings import Settings
from storage.artifact_store import LocalArtifactStore
from storage.evaluation_files import read_episodes
from tasks.evaluate import HeldoutWorlds, evaluate_in_folder


class EvaluationSummary(BaseModel):
    """Rows in the order of the policies; the first one against each other one."""

    rows: list[EvaluationRow]
    comparisons: list[ComparisonRow]


@flow(name="policy evaluation", flow_run_name="evaluate {policies}")
def evaluate(
    root: Path,
    worlds: tuple[Path, ...],
    policies: tuple[str, ...],
    out: Path,
    part: str | None = None,
    resolution: float | None = None,
    settings: Settings = Settings(),  # noqa: B008  (frozen; the UI shows it as the form's defaults)
) -> EvaluationSummary:
    """Drive policies through the same trials; writes `episodes.parquet`, `summary.json`, figures.

    Args:
        root: Folder of the store, in which champions and runs are looked for.
        worlds: World sets, maps, or folders of these.
        policies: Names or folders of policies, first the one in question.
        out: Folder that the results go into.
        part: Only this part of a folder of worlds, by its `split.csv`.
        resolution: Of images that carry none [m per pixel].
        settings: Those of `evaluation` and `simulation` and the target robot matter.
    """
    evaluate_in_folder.submit(
        policies,
        HeldoutWorlds(paths=tuple(worlds), part=part, resolution=resolution),
        out=out,
        store=LocalArtifactStore(root),
        settings=settings,
    ).result()
    episodes = read_episodes(out)
    return EvaluationSummary(
        rows=[EvaluationRow.model_validate(row) for row in summarize(episodes)],
        comparisons=[ComparisonRow.model_validate(row) for row in compare(episodes)],
    )
