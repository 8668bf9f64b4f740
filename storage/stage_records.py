"""Small facts that a stage leaves beside its artifact, as JSON that reads back with its types."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import TypeAdapter, ValidationError

from ses_core.errors import ArtifactError

Record = TypeVar("Record")


def write_record(path: Path, values: Mapping[str, Any]) -> None:
    """Write a record; equal values give equal bytes."""
    text = json.dumps(dict(values), indent=1, sort_keys=True, allow_nan=False)
    path.write_text(text + "\n", encoding="utf-8")


def read_record(path: Path, kind: type[Record]) -> Record:
    """Read a record back as a dataclass or model.

    Raises:
        ArtifactError: It is missing or is not such a record.
    """
    try:
        return TypeAdapter(kind).validate_json(path.read_bytes())
    except (OSError, ValidationError) as error:
        raise ArtifactError(f"{path} is no {kind.__name__}: {error}") from error
