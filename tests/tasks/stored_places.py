"""Selections and synthesized environments in a store, for what goes on from them."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from ses_core.arrays import BoolArray
from ses_core.extraction.holdout import Holdout
from ses_core.extraction.selection import POOL_COLUMNS, Selection, ThresholdSensitivity
from ses_core.navigation import NavigationDomain
from ses_core.recipes import ArtifactRef, Recipe
from ses_core.robot_profile import JACKAL
from storage.artifact_store import LocalArtifactStore
from storage.environment_files import ENVIRONMENTS_FILE, SYNTHESIS_FILE, write_environments
from storage.parquet_files import read_table
from storage.selection_files import write_selection
from storage.stages import FILTER, SYNTHESIZE
from tests.ses_core.synthesis.places import domain_of

RECORD = (
    '{"method_asked": "gan", "method_used": "gan", "drawn": 10, "rejected_share": 0.25, '
    '"repeated": 0, "copied": 0, "notes": []}'
)


def select(store: LocalArtifactStore, cells: BoolArray, sites: Sequence[str]) -> ArtifactRef:
    """Store a selection whose pool is these places, each of a scenario of its own."""
    domain = domain_of(cells)
    pool = pd.DataFrame(
        [
            (number + 1, one.scenario_id, one.environment_id, 99.0, f"l{number}", "r", site, "d")
            for number, (one, site) in enumerate(zip(domain.environments, sites, strict=True))
        ],
        columns=list(POOL_COLUMNS),
    )
    selection = Selection(
        pool=pool,
        heldout=pool[:0],
        count_kind="negative",
        funnels={},
        sensitivity=ThresholdSensitivity(thresholds=pool["count"].to_numpy(), challenging={}),
        holdout=Holdout(basis="site", heldout=(), sides=pd.Series(dtype=object)),
    )

    def build(directory: Path) -> None:
        write_environments(directory, domain, target=JACKAL)
        places = read_table(directory / ENVIRONMENTS_FILE, "environments")
        write_selection(directory, selection, places)

    return store.put(Recipe(FILTER, {"sites": list(sites)}), build)


def synthesize(store: LocalArtifactStore, domain: NavigationDomain) -> ArtifactRef:
    """Store environments with the record of their draws."""

    def build(directory: Path) -> None:
        write_environments(directory, domain, target=JACKAL)
        (directory / SYNTHESIS_FILE).write_text(RECORD, encoding="utf-8")

    return store.put(Recipe(SYNTHESIZE, {"count": len(domain.environments)}), build)
