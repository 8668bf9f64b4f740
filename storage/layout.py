"""`Layout`: every path the project ever uses under its root, and the version of their form."""

import json
from dataclasses import dataclass
from datetime import date
from pathlib import Path

from ses_core.errors import ArtifactError
from ses_core.recipes import ArtifactRef
from storage.durable_files import disk_errors, make_folder, write_if_absent

STORE_FORMAT = 1
"""Form of the folders and files under a root; raised whenever an older release would misread it."""


@dataclass(frozen=True, slots=True)
class Layout:
    """The folders and files under one root."""

    root: Path

    @property
    def store_file(self) -> Path:
        """Names the form of this store."""
        return self.root / "store.json"

    @property
    def lock_file(self) -> Path:
        """Held by the one night that runs."""
        return self.root / ".lock"

    @property
    def publish_lock(self) -> Path:
        """Held by the one process that brings `tables` up to date."""
        return self.root / ".publish.lock"

    @property
    def sweep_lock(self) -> Path:
        """Held by whoever takes artifacts away; shared by those that put them in place."""
        return self.root / ".sweep.lock"

    @property
    def objects(self) -> Path:
        """Artifacts, immutable, named by their content."""
        return self.root / "objects"

    @property
    def recipes(self) -> Path:
        """What was asked and which artifact answered."""
        return self.root / "recipes"

    @property
    def table_log(self) -> Path:
        """Which parts the tables consist of: the truth of which `tables` is a view."""
        return self.root / "_log"

    @property
    def tables(self) -> Path:
        """What people open with `pandas.read_parquet(folder)`."""
        return self.root / "tables"

    @property
    def staging(self) -> Path:
        """Half-built things; whatever a dead process left here may go."""
        return self.root / "staging"

    @property
    def registry(self) -> Path:
        """Which policy was champion, since when, and why."""
        return self.root / "registry"

    @property
    def ledger(self) -> Path:
        """What is known of the inbox."""
        return self.root / "ledger"

    @property
    def quarantine(self) -> Path:
        """Refused logs, each with its reason."""
        return self.root / "quarantine"

    @property
    def corrupt(self) -> Path:
        """Damaged files, kept for whoever looks for the cause."""
        return self.root / "corrupt"

    @property
    def batches(self) -> Path:
        """One manifest per day."""
        return self.root / "batches"

    @property
    def report(self) -> Path:
        """One folder per day with its page."""
        return self.root / "report"

    @property
    def prefect(self) -> Path:
        """Home of the Prefect server: history only, never truth."""
        return self.root / "prefect"

    @property
    def temporary(self) -> Path:
        """Working folders of child processes."""
        return self.root / "tmp"

    def object_folder(self, ref: ArtifactRef) -> Path:
        """Give the folder of an artifact."""
        # In one step: a night asks this hundreds of times, and every `/` makes a path anew.
        return self.root.joinpath("objects", ref.kind, ref.digest)

    def recipe_file(self, stage: str, key: str) -> Path:
        """Give the file that answers a recipe."""
        return self.root.joinpath("recipes", stage, f"{key}.json")

    def table_folder(self, name: str) -> Path:
        """Give the folder of a table."""
        return self.tables / name

    def batch_file(self, day: date) -> Path:
        """Give the manifest of a day."""
        return self.batches / f"{day.isoformat()}.json"

    def report_page(self, day: date) -> Path:
        """Give the page of a day's night."""
        return self.report / day.isoformat() / "index.html"


def open_layout(root: Path) -> Layout:
    """Open the store under a root, making what is missing.

    Raises:
        ArtifactError: A newer release made this store, or the root cannot be written.
    """
    layout = Layout(root.absolute())
    with disk_errors(layout.root):
        for folder in (
            layout.objects,
            layout.recipes,
            layout.table_log,
            layout.tables,
            layout.staging,
            layout.batches,
        ):
            make_folder(folder)
        if not layout.store_file.exists():
            write_if_absent(layout.store_file, json.dumps({"format": STORE_FORMAT}).encode())
        text = layout.store_file.read_text()
    try:
        found = int(json.loads(text)["format"])
    except (ValueError, KeyError, TypeError) as error:
        raise ArtifactError(
            f"{layout.store_file} does not say which format this store has, "
            f'expected {{"format": {STORE_FORMAT}}}'
        ) from error
    if found > STORE_FORMAT:
        raise ArtifactError(
            f"store {layout.root} has format {found}, this release knows formats up to "
            f"{STORE_FORMAT}: use the release that made it, or a newer one"
        )
    return layout
