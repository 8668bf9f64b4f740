"""The scorecard by hand: how well synthesized environments stand for recorded ones."""

from pathlib import Path

from prefect import flow

from ses_core.scorecard.rows import ScorecardRow
from ses_core.settings import Settings
from tasks.scorecard import score_folders


@flow(name="environment scorecard", flow_run_name="score {synthesized}")
def scorecard(
    root: Path,
    real: Path,
    synthesized: Path,
    policy: str = "dwa-slow",
    out: Path | None = None,
    training: Path | None = None,
    settings: Settings = Settings(),  # noqa: B008  (frozen; the UI shows it as the form's defaults)
) -> tuple[ScorecardRow, ...]:
    """Compare synthesized environments with real ones.

    Args:
        root: Folder of the store, in which policies, sites and logs are looked up.
        real: Folder of the real environments: those that were learned from, or held-out ones.
        synthesized: Folder of the synthesized ones.
        policy: Whose drives tell how hard an environment is.
        training: Folder of those that were learned from, where the real ones were held out.
        out: Folder for `scorecard.parquet`, `scorecard.html` and `scorecard.png`.
        settings: Those of `scorecard` and `simulation` and the target robot matter.
    """
    return score_folders.submit(
        real,
        synthesized,
        policy=policy,
        out=out,
        root=root,
        settings=settings,
        training=training,
    ).result()
