"""Fitted synthesizers on disk: arrays in `.npz` without pickle, the plan beside them in JSON."""

import json
from pathlib import Path
from typing import cast
from zipfile import BadZipFile

import numpy as np
from pydantic import TypeAdapter

from ses_core.errors import ArtifactError, SynthesisError
from ses_core.recipes import JsonValue, canonical_json, settings_json
from ses_core.synthesis.factory import rebuild_synthesizer
from ses_core.synthesis.sizes import SynthesisPlan
from ses_core.synthesis.synthesize import FittedSynthesis
from ses_core.synthesis_settings import SynthesizerSettings

ARRAYS_FILE = "synthesizer.npz"
PLAN_FILE = "plan.json"

_DAMAGES = (OSError, EOFError, ValueError, KeyError, TypeError, BadZipFile, SynthesisError)
"""What reading a damaged file raises; pydantic's errors are `ValueError`s."""

_SETTINGS: TypeAdapter[SynthesizerSettings] = TypeAdapter(SynthesizerSettings)


def write_synthesizer(directory: Path, fitted: FittedSynthesis) -> None:
    """Write a fitted synthesizer into a folder; equal fits give equal bytes."""
    plan = fitted.plan
    np.savez(directory / ARRAYS_FILE, allow_pickle=False, **fitted.synthesizer.arrays())
    described: dict[str, JsonValue] = {
        "synthesizer": settings_json(plan.synthesizer),
        "environments": plan.environments,
        "notes": plan.notes,
    }
    (directory / PLAN_FILE).write_text(canonical_json(described), encoding="utf-8")


def read_synthesizer(directory: Path) -> FittedSynthesis:
    """Read back what `write_synthesizer` wrote; it draws the same samples.

    Raises:
        ArtifactError: A file is missing or damaged.
    """
    try:
        described = json.loads((directory / PLAN_FILE).read_text(encoding="utf-8"))
        plan = SynthesisPlan(
            synthesizer=_SETTINGS.validate_python(described["synthesizer"]),
            environments=int(described["environments"]),
            notes=tuple(described["notes"]),
        )
        with np.load(directory / ARRAYS_FILE, allow_pickle=False) as stored:
            arrays = {name: cast("np.ndarray", stored[name]) for name in stored.files}
        synthesizer = rebuild_synthesizer(plan.synthesizer.method, arrays)
    except _DAMAGES as error:
        raise ArtifactError(f"{directory} holds no fitted synthesizer: {error}") from error
    return FittedSynthesis(plan=plan, synthesizer=synthesizer)
