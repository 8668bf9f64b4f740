"""A simulated fleet's day: robots drive in worlds, and real logs land in a folder."""

import datetime as dt
from pathlib import Path

from prefect import flow
from pydantic import BaseModel

from ses_core.settings import Settings
from storage.artifact_store import LocalArtifactStore
from storage.deployment_logs import FleetFormat
from tasks.deploy import deploy_fleet


class DeploymentSummary(BaseModel):
    """What the fleet's day came to."""

    deployments: int
    seconds: float
    ticks: int
    outcomes: dict[str, int]


@flow(name="fleet deployment", flow_run_name="{deployments} deployments of {policy}")
def deploy(
    root: Path,
    worlds: tuple[Path, ...],
    out: Path,
    policy: str = "dwa-slow",
    deployments: int = 40,
    format: FleetFormat = "mcap",  # noqa: A002 - the contract's word
    part: str | None = None,
    resolution: float | None = None,
    seed: int = 0,
    date: dt.date | None = None,
    settings: Settings = Settings(),  # noqa: B008  (frozen; the UI shows it as the form's defaults)
) -> DeploymentSummary:
    """Let a simulated fleet drive and write its logs as `<site>/<robot>/<log>`.

    Args:
        root: Folder of the store, in which a champion is looked for.
        worlds: World sets, maps, or folders of these.
        out: Folder the logs go into.
        policy: Who drives.
        deployments: Drives from a start to a goal.
        format: Of the logs: MCAP, sqlite3 or ROS 1 bags, or tables.
        part: Only this part of a folder of worlds, by its `split.csv`.
        resolution: Of images that carry none [m per pixel].
        seed: Of pairs and imperfections.
        date: Day on which it is said to have driven; today by default.
        settings: Those of `fleet`, `simulation`, `evaluation`, `ingest` and `target_robot` matter.
    """
    day = deploy_fleet.submit(
        worlds,
        part=part,
        resolution=resolution,
        policy=policy,
        deployments=deployments,
        out=out,
        log_format=format,
        seed=seed,
        day=date,
        store=LocalArtifactStore(root),
        settings=settings,
    ).result()
    return DeploymentSummary(
        deployments=day.deployments,
        seconds=day.seconds,
        ticks=day.ticks,
        outcomes=dict(day.outcomes),
    )
