"""What the filter chose, on disk: the pool, the held-out places, and the funnel."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ses_core.extraction.holdout import Basis
from ses_core.extraction.selection import FilterFunnel, Selection, ThresholdSensitivity
from ses_core.navigation import NavigationDomain
from ses_core.recipes import digest_json
from storage.environment_files import ENVIRONMENTS_FILE, read_environments
from storage.parquet_files import write_table

SELECTION_FILE = "selection.json"
POOL_FOLDER = "pool"
HELDOUT_FOLDER = "heldout"


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredSelection:
    """A selection read back.

    Attributes:
        pool: `POOL_COLUMNS`, hardest first.
        heldout: The same columns, of held-out places.
        pool_environments: Environments of the pool, in its order.
        heldout_environments: Environments of held-out places, hardest first.
        count_kind: The count that chose.
        funnels: By kind of count.
        sensitivity: How the set would change with the threshold.
        holdout_basis: What was held out: a `site`, a `place`, or `nothing`.
        heldout_names: Which ones.
    """

    pool: pd.DataFrame
    heldout: pd.DataFrame
    pool_environments: NavigationDomain
    heldout_environments: NavigationDomain
    count_kind: str
    funnels: Mapping[str, FilterFunnel]
    sensitivity: ThresholdSensitivity
    holdout_basis: Basis
    heldout_names: tuple[str, ...]


def write_selection(directory: Path, selection: Selection, environments: pd.DataFrame) -> None:
    """Write a selection and the environments it names into a folder.

    Args:
        directory: Where to.
        selection: What was chosen.
        environments: Rows of the table of that name; those chosen are copied.
    """
    record = {
        "count_kind": selection.count_kind,
        "pool": _records(selection.pool),
        "heldout": _records(selection.heldout),
        "funnels": {kind: asdict(funnel) for kind, funnel in selection.funnels.items()},
        "sensitivity": {
            "thresholds": selection.sensitivity.thresholds.tolist(),
            "challenging": {
                kind: counts.tolist() for kind, counts in selection.sensitivity.challenging.items()
            },
        },
        "holdout": {"basis": selection.holdout.basis, "names": list(selection.holdout.heldout)},
    }
    text = json.dumps(record, indent=1, sort_keys=True, allow_nan=False)
    (directory / SELECTION_FILE).write_text(text + "\n", encoding="utf-8")
    rows = environments.drop_duplicates("environment_id").set_index("environment_id", drop=False)
    for folder, chosen in ((POOL_FOLDER, selection.pool), (HELDOUT_FOLDER, selection.heldout)):
        (directory / folder).mkdir()
        picked = rows.loc[chosen["environment_id"]]
        # pandas opens an absent text as NaN, which no column of text takes.
        columns = {
            name: picked[name].astype(object).where(picked[name].notna(), None).to_list()
            for name in picked.columns
        }
        write_table(directory / folder / ENVIRONMENTS_FILE, "environments", columns)


def read_selection(directory: Path) -> StoredSelection:
    """Read a selection back, with its environments.

    Raises:
        ArtifactError: A file is missing or damaged.
    """
    record: dict[str, Any] = json.loads((directory / SELECTION_FILE).read_text(encoding="utf-8"))
    sensitivity = record["sensitivity"]
    return StoredSelection(
        pool=pd.DataFrame(record["pool"]),
        heldout=pd.DataFrame(record["heldout"]),
        pool_environments=read_environments(directory / POOL_FOLDER),
        heldout_environments=read_environments(directory / HELDOUT_FOLDER),
        count_kind=record["count_kind"],
        funnels={kind: FilterFunnel(**funnel) for kind, funnel in record["funnels"].items()},
        sensitivity=ThresholdSensitivity(
            thresholds=np.asarray(sensitivity["thresholds"], dtype=np.float64),
            challenging={
                kind: np.asarray(counts, dtype=np.int64)
                for kind, counts in sensitivity["challenging"].items()
            },
        ),
        holdout_basis=record["holdout"]["basis"],
        heldout_names=tuple(record["holdout"]["names"]),
    )


def read_pool(directory: Path) -> NavigationDomain:
    """Read only the environments of the pool, hardest first."""
    return read_environments(directory / POOL_FOLDER)


def domain_digest(domain: NavigationDomain) -> str:
    """Digest which environments a domain holds, in their order, and their cells.

    An id alone would do for extracted ones; a file of the user's own may keep ids of other cells.
    """
    identities = [environment.environment_id for environment in domain.environments]
    cells = np.packbits(domain.cells()).tobytes() if identities else b""
    return digest_json([identities, sha256(cells).hexdigest()])


def _records(rows: pd.DataFrame) -> list[dict[str, Any]]:
    records: list[dict[str, Any]] = json.loads(rows.to_json(orient="records", double_precision=15))
    return records
