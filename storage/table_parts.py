"""`TablePart`: one Parquet file inside an artifact that a table consists of."""

import re
from dataclasses import asdict, dataclass
from datetime import date

from ses_core.errors import ArtifactError
from ses_core.recipes import ArtifactRef, JsonValue, parse_ref
from storage.artifact_store import LocalArtifactStore
from storage.parquet_files import row_count
from storage.table_schemas import DATED_TABLES, TABLES

_PLAIN_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9.-]*")
"""A leading dot or underscore would hide the part from pandas without a word."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TablePart:
    """A part of a table and where it shows.

    Attributes:
        table: Name of the table.
        name: What it is the rows of: a log, a night. A later part of the same table, folder
            and name replaces it.
        folder: Batch date of the dated tables; empty for the flat ones.
        ref: The artifact that holds the file.
        file: Path of the file below the artifact's folder.
        size: Bytes of the file.
    """

    table: str
    name: str
    ref: ArtifactRef
    file: str
    rows: int
    size: int
    sha256: str
    folder: str = ""

    def __post_init__(self) -> None:
        for text in (self.name, self.folder or "flat"):
            if not _PLAIN_NAME.fullmatch(text):
                raise ValueError(f"part is called {text!r}, expected letters, digits, '.' and '-'")

    @property
    def slot(self) -> str:
        """Path below `tables` where the part shows."""
        return "/".join(filter(None, (self.table, self.folder, f"{self.name}.parquet")))

    def as_json(self) -> dict[str, JsonValue]:
        """Give the part as JSON values."""
        return {**asdict(self), "ref": str(self.ref)}


def part_from_json(value: dict[str, JsonValue]) -> TablePart:
    """Read a part back from JSON values."""
    return TablePart(
        table=str(value["table"]),
        name=str(value["name"]),
        ref=parse_ref(str(value["ref"])),
        file=str(value["file"]),
        rows=int(str(value["rows"])),
        size=int(str(value["size"])),
        sha256=str(value["sha256"]),
        folder=str(value["folder"]),
    )


def artifact_parts(
    store: LocalArtifactStore, ref: ArtifactRef, *, name: str, batch_date: date
) -> list[TablePart]:
    """List what an artifact adds to the tables: its files `<table>.parquet`, by their names.

    Args:
        store: Holds the artifact.
        ref: The artifact.
        name: What its rows are of: the id of a log or of a night.
        batch_date: Day of the batch; the folder of the dated tables.

    Raises:
        ArtifactError: The artifact is damaged, or has no table to add.
    """
    folder = store.layout.object_folder(ref)
    parts = [
        TablePart(
            table=table,
            name=name,
            ref=ref,
            file=file.path,
            rows=row_count(folder / file.path),
            size=file.size,
            sha256=file.sha256,
            folder=batch_date.isoformat() if table in DATED_TABLES else "",
        )
        for file in store.files(ref)
        for table in TABLES
        if file.path == f"{table}.parquet"
    ]
    if not parts:
        raise ArtifactError(f"artifact {ref} holds no file named after a table")
    return parts
