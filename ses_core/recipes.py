"""What was asked and what came out: stages, recipes, references and canonical digests."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from pydantic import BaseModel

JsonValue = str | int | float | bool | None | Sequence["JsonValue"] | Mapping[str, "JsonValue"]


@dataclass(frozen=True, slots=True)
class Stage:
    """A step of the pipeline; its version changes whenever its output would mean something else."""

    name: str
    version: int


@dataclass(frozen=True, slots=True, order=True)
class ArtifactRef:
    """A few dozen bytes that name an immutable artifact: its kind and its content's digest."""

    kind: str
    digest: str

    def __str__(self) -> str:
        return f"{self.kind}/{self.digest}"


def parse_ref(text: str) -> ArtifactRef:
    """Read back the text form of a reference.

    Raises:
        ValueError: The text is not `kind/digest`.
    """
    kind, separator, digest = text.partition("/")
    if not (separator and kind and digest):
        raise ValueError(f"reference {text!r} is not of the form kind/digest")
    return ArtifactRef(kind, digest)


@dataclass(frozen=True, slots=True)
class Recipe:
    """Everything that decides an artifact's content.

    Attributes:
        settings: The settings actually used, JSON values or frozen pydantic models.
        inputs: Artifacts whose order matters.
        input_set: Artifacts whose order does not matter.
    """

    stage: Stage
    settings: Mapping[str, JsonValue] = field(default_factory=dict)
    inputs: tuple[ArtifactRef, ...] = ()
    input_set: frozenset[ArtifactRef] = frozenset()

    def as_json(self) -> dict[str, JsonValue]:
        """Give the recipe as JSON values, in the form that is digested and stored."""
        return {
            "stage": self.stage.name,
            "version": self.stage.version,
            "settings": dict(self.settings),
            "inputs": [str(ref) for ref in self.inputs],
            "input_set": sorted(str(ref) for ref in self.input_set),
        }

    def key(self) -> str:
        """Digest the recipe: equal keys ask for equal artifacts."""
        return digest_json(self.as_json())


def settings_json(settings: BaseModel) -> dict[str, JsonValue]:
    """Give a settings model as JSON values for a recipe."""
    dumped: dict[str, JsonValue] = settings.model_dump(mode="json")
    return dumped


def canonical_json(value: JsonValue) -> str:
    """Write JSON the one way that is digested: sorted keys, no spaces, no NaN."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)


def digest_json(value: JsonValue) -> str:
    """Digest a JSON value: 64 hexadecimal digits."""
    return digest_bytes(canonical_json(value).encode())


def digest_bytes(content: bytes) -> str:
    """Digest bytes: 64 hexadecimal digits of SHA-256."""
    return hashlib.sha256(content).hexdigest()
