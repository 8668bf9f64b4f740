"""The galleries' script, run by node where there is one: what is drawn, found and sorted."""

import json
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ses_core.pictures.figures import LIGHT
from storage.night_report import ShownEnvironment
from storage.place_gallery import gallery_data, gallery_script
from tests.storage.nights import environments

STUB = Path(__file__).with_name("page_stub.js")
WORDS = "steps with v < 0"


def run(shown: Sequence[ShownEnvironment], *steps: tuple[object, ...]) -> list[dict[str, Any]]:
    """Give what a gallery shows at first and after each step: a filter and its value, or more."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed")
    asked = {
        "script": str(gallery_script()),
        "data": json.loads(gallery_data(shown, WORDS)),
        "steps": steps,
    }
    answer = subprocess.run(
        [node, str(STUB)], input=json.dumps(asked), capture_output=True, text=True, check=True
    )
    states: list[dict[str, Any]] = json.loads(answer.stdout)
    return states


def counts(state: dict[str, Any]) -> list[int]:
    return [int(caption) for caption in state["captions"]]


@pytest.fixture(scope="module")
def shown() -> tuple[ShownEnvironment, ...]:
    return environments(120, origin="c", counted=True, chosen=80)


def test_a_place_is_drawn_cell_for_cell(shown: tuple[ShownEnvironment, ...]) -> None:
    noise = np.random.default_rng(3).random((2, 30, 30)) < 0.5
    first = replace(shown[7], cells=noise[0], observed=noise[1])
    (state,) = run((first, shown[8]))
    pixels = np.array(state["pixels"]).reshape(30, 30, 4)
    colors = [
        [*bytes.fromhex(color[1:]), 255] for color in (LIGHT.free, LIGHT.occupied, LIGHT.unknown)
    ]
    kinds = np.where(noise[0], 1, np.where(noise[1], 0, 2))
    assert np.array_equal(pixels, np.array(colors)[kinds])


def test_the_chosen_are_seen_first_and_the_rest_on_asking(
    shown: tuple[ShownEnvironment, ...],
) -> None:
    first, more, everything, others = run(shown, ("more",), ("Chosen", ""), ("Chosen", "no"))
    assert first["filters"] == ["Chosen", "Site", "Can be crossed", "Count", "Sorted"]
    assert (first["status"], first["more"]) == ("33 of 80 shown", "Show 47 more")
    assert counts(first) == list(range(180, 147, -1))
    assert (more["status"], more["more"]) == ("80 of 80 shown", "")
    assert everything["status"] == "33 of 120 shown"
    assert counts(others) == list(range(100, 67, -1))
    assert first["titles"][0] == (
        f"environment c0000 · scenario x0000 · home-0 / jackal-7 · 180 {WORDS} · from scan"
    )
    assert first["titles"][2].endswith("the robot cannot cross it")


def test_filters_narrow_together_and_sorting_keeps_them(
    shown: tuple[ShownEnvironment, ...],
) -> None:
    *_, found, lowest = run(
        shown,
        ("Site", "home-1"),
        ("Can be crossed", "yes"),
        ("Count", "110", 0),
        ("Count", "150", 1),
        ("Sorted", "lowest count first"),
    )
    expected = [
        int(item.count or 0)
        for item in shown
        if item.is_chosen
        and item.site == "home-1"
        and item.is_traversable
        and 110 <= (item.count or 0) <= 150
    ]
    assert len(expected) > 10
    assert counts(found) == expected
    assert counts(lowest) == expected[::-1]
    *_, cleared = run(shown, ("Count", "110", 0), ("Count", "", 0))
    assert cleared["status"] == "33 of 80 shown"


def test_places_sort_by_how_full_they_are(shown: tuple[ShownEnvironment, ...]) -> None:
    _, full, empty = run(shown[:30], ("Sorted", "fullest first"), ("Sorted", "emptiest first"))
    by_title = {item.environment_id: int(item.cells.sum()) for item in shown}
    for state, sign in ((full, -1), (empty, 1)):
        filled = [by_title[title.split(" ")[1]] for title in state["titles"]]
        assert filled == sorted(filled, key=lambda number: sign * number)


def test_unknown_counts_are_last_and_never_within_bounds(
    shown: tuple[ShownEnvironment, ...],
) -> None:
    some = (replace(shown[0], count=None), *shown[1:4], replace(shown[4], count=3.25))
    _, up, down, bounded = run(
        some,
        ("Sorted", "lowest count first"),
        ("Sorted", "highest count first"),
        ("Count", "0", 0),
    )
    assert up["captions"] == ["3.2", "177", "178", "179", ""]
    assert down["captions"] == ["179", "178", "177", "3.2", ""]
    assert bounded["captions"] == ["179", "178", "177", "3.2"]


def test_synthesized_places_have_only_what_tells_them_apart() -> None:
    (state,) = run(environments(40, origin="s"))
    assert state["filters"] == ["Sorted"]
    assert state["titles"][0] == "environment s0000 · from pca"
    (nothing_found,) = run(environments(2, origin="s"), ("Sorted", "emptiest first"))[1:]
    assert nothing_found["status"] == "2 of 2 shown"
