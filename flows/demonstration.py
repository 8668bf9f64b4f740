"""The demonstration: a small simulated fleet, and the nightly run over the logs it leaves."""

import datetime as dt
from pathlib import Path

from prefect import flow

from flows.night_summary import NightSummary
from flows.nightly_batch import nightly
from ses_core.settings import (
    EvaluationSettings,
    FilterSettings,
    IngestSettings,
    RobotRule,
    Settings,
    TrainingSettings,
)
from ses_core.synthesis_settings import AutoregressiveSettings, SynthesisSettings
from storage.artifact_store import LocalArtifactStore
from tasks.deploy import DemonstrationFleet, deploy_demonstration

FLEET = DemonstrationFleet(homes=8, deployments=160, seed=3, day=dt.date(2026, 11, 20))

SETTINGS = Settings(
    ingest=IngestSettings(robots=(RobotRule(match="*", profile="jackal"),)),
    filter=FilterSettings(challenging_share=0.23),
    synthesis=SynthesisSettings(
        environments=40,
        synthesizer=AutoregressiveSettings(updates=1000, least_environments=20),
    ),
    training=TrainingSettings(steps=10_000, parallel_envs=50),
    evaluation=EvaluationSettings(trials=3, min_distance_m=8.0),
)
"""Small enough for ten minutes on two cores; 0.23 is the paper's share of challenging scenarios.

A fleet so small has few hard places: the generator is taught by fewer than it is by default.
"""


@flow(name="demonstration", flow_run_name="demonstration night")
def demonstrate(root: Path, settings: Settings | None = None) -> NightSummary:
    """Let a small fleet drive through generated homes, then run a night over its logs.

    Args:
        root: Folder of the store.
        settings: Of the night; by default small enough to wait for.
    """
    chosen = settings or SETTINGS
    store = LocalArtifactStore(root)
    logs = deploy_demonstration.submit(FLEET, store=store, settings=chosen).result()
    inbox = store.path(logs.ref)
    return nightly(inbox=inbox, root=root, date=FLEET.day, settings=chosen, demonstration=True)
