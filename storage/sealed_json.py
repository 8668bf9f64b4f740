"""JSON that carries its own digest, so that a single flipped bit in it is found."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import cast

from ses_core.errors import ArtifactError
from ses_core.recipes import JsonValue, digest_json

_SEAL = "sha256"


def seal(value: Mapping[str, JsonValue]) -> bytes:
    """Write a JSON object with the digest of everything else in it."""
    sealed = {**value, _SEAL: digest_json(value)}
    return (json.dumps(sealed, sort_keys=True, indent=1, allow_nan=False) + "\n").encode()


def unseal(content: bytes, *, source: Path) -> dict[str, JsonValue]:
    """Read a sealed JSON object back; `source` names the file it comes from in messages.

    Raises:
        ArtifactError: It is not JSON, or not what was sealed.
    """
    try:
        value = json.loads(content)
    except ValueError as error:
        raise ArtifactError(f"{source} is damaged: it holds no JSON") from error
    if not isinstance(value, dict):
        raise ArtifactError(f"{source} is damaged: it holds no JSON object")
    declared = value.pop(_SEAL, None)
    found = digest_json(value)
    if declared != found:
        raise ArtifactError(f"{source} is damaged: its digest is {found}, expected {declared}")
    return cast("dict[str, JsonValue]", value)
