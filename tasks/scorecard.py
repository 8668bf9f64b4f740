"""Scorecard: two folders of environments, and how well one stands for the other."""

from pathlib import Path

from prefect import task
from prefect.cache_policies import NO_CACHE

from ses_core.scorecard.rows import ScorecardRow
from ses_core.scorecard.scorecard import Driver, score_environments
from ses_core.settings import Settings
from storage.durable_files import replace_file
from storage.environment_files import read_environments
from storage.layout import Layout
from storage.policy_files import find_policy
from storage.scorecard_files import group_environments, raw_traversable_share, write_scorecard
from tasks.progress import report_progress

PICTURE_FILE = "scorecard.png"


@task(name="score environments", cache_policy=NO_CACHE)
def score_folders(
    real: Path,
    synthesized: Path,
    *,
    policy: str,
    out: Path | None,
    root: Path,
    settings: Settings,
) -> tuple[ScorecardRow, ...]:
    """Compare a folder of synthesized environments with a folder of real ones.

    Args:
        real: Folder of `environments.parquet`, best with the `scenarios.parquet` they are of.
        synthesized: Folder of `environments.parquet`.
        policy: Who drives through them, by name.
        out: Folder for table and picture, if they are wanted.
        root: Folder of the store, in which policies, sites and logs are looked up.
        settings: Those of `scorecard` and `simulation` and the target robot matter.

    Raises:
        ArtifactError: A folder holds no environments.
        SchemaError: A file is no table of environments.
    """
    recorded, made = read_environments(real), read_environments(synthesized)
    layout = Layout(root)
    found = score_environments(
        recorded.cells(),
        made.cells(),
        group_environments(real, recorded, layout),
        settings=settings.scorecard,
        target=settings.target_robot,
        driver=Driver(
            name=policy,
            policy=find_policy(policy, layout).policy,
            simulation=settings.simulation,
        ),
        raw_traversable=raw_traversable_share(synthesized),
        progress=report_progress("scorecard"),
    )
    if out is not None:
        # matplotlib takes half a second to import: only who draws pays for it.
        from ses_core.pictures.scorecard_figure import draw_scorecard

        write_scorecard(out, found.rows)
        replace_file(out / PICTURE_FILE, draw_scorecard(found.rows, found.measures))
    return found.rows
