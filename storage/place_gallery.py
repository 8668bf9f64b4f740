"""The report's galleries: environments as data that a small script in the page draws and filters.

Packed, four thousand of them are a megabyte and open at once; as pictures they would be files.
"""

import base64
import hashlib
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from markupsafe import Markup

from ses_core.pictures.figures import DARK, LIGHT, Theme
from ses_core.pictures.gallery import packed_places
from storage.night_report import ShownEnvironment

_SCRIPT_FILE = Path(__file__).parent / "templates" / "gallery.js"

_UNSAFE = {"<": "\\u003c", ">": "\\u003e", "&": "\\u0026"}
"""Letters that could end a script element early; within JSON they stand in strings only."""


def gallery_script() -> Markup:
    """Give the script that draws every gallery of a page."""
    return Markup(_SCRIPT_FILE.read_text(encoding="utf-8"))


def script_digest(script: str) -> str:
    """Give what a page's security policy calls the one script that may run."""
    digest = hashlib.sha256(script.encode()).digest()
    return f"sha256-{base64.b64encode(digest).decode()}"


def gallery_data(environments: Sequence[ShownEnvironment], count_words: str) -> Markup:
    """Give environments, at least one, column by column as JSON to stand in a script element.

    Args:
        environments: In the order they are listed in.
        count_words: What their counts count.
    """
    cells = np.stack([one.cells for one in environments])
    observed = np.stack([one.observed for one in environments])
    columns: dict[str, object] = {
        "cells": base64.b64encode(packed_places(cells, observed)).decode(),
        "id": [one.environment_id for one in environments],
        "scenario": [one.scenario_id for one in environments],
        "count": [_short(one.count) for one in environments],
        "traversable": [int(one.is_traversable) for one in environments],
        "chosen": [int(one.is_chosen) for one in environments],
        "occupied": cells.sum(axis=(1, 2)).tolist(),
        "words": count_words,
        "light": _colors(LIGHT),
        "dark": _colors(DARK),
    }
    for name in ("site", "robot", "origin"):
        values = [str(getattr(one, name)) for one in environments]
        known = list(dict.fromkeys(values))
        numbers = {value: number for number, value in enumerate(known)}
        columns[f"{name}s"] = known
        columns[name] = [numbers[value] for value in values]
    text = json.dumps(columns, separators=(",", ":"), allow_nan=False)
    for letter, escaped in _UNSAFE.items():
        text = text.replace(letter, escaped)
    return Markup(text)


def _short(count: float | None) -> float | int | None:
    """Round to what is worth reading: whole counts, seconds to a tenth."""
    if count is None:
        return None
    return int(count) if float(count).is_integer() else round(float(count), 1)


def _colors(theme: Theme) -> list[list[int]]:
    """Give red, green, blue and alpha of free, occupied and unknown cells."""
    return [
        [*bytes.fromhex(color.removeprefix("#")), 255]
        for color in (theme.free, theme.occupied, theme.unknown)
    ]
