import io

import numpy as np
import pytest
from PIL import Image

from ses_core.arrays import BoolArray
from ses_core.pictures.figures import LIGHT
from ses_core.pictures.threshold_sensitivity import threshold_sensitivity_figure


def figure(threshold: float | None, *, scenario_count: int = 400) -> bytes:
    thresholds = np.arange(0.0, 101.0)
    return threshold_sensitivity_figure(
        thresholds,
        {"negative": (300 - 3 * thresholds).astype(np.int64)},
        threshold=threshold,
        scenario_count=scenario_count,
    )


def near(png: bytes, color: str) -> BoolArray:
    """Tell which pixels (H, W) have about a colour."""
    image = np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)
    return np.abs(image - np.array(list(bytes.fromhex(color[1:])))).sum(axis=2) < 60


def column_of(png: bytes, color: str) -> int:
    """Column [pixel] with the most pixels of a colour."""
    return int(near(png, color).sum(axis=0).argmax())


def count_of(png: bytes, color: str) -> int:
    return int(near(png, color).sum())


def test_the_threshold_in_force_is_marked_where_it_is() -> None:
    positions = [column_of(figure(value), LIGHT.series[1]) for value in (25.0, 50.0, 75.0)]
    first, second = np.diff(positions)
    assert first > 50
    assert abs(first - second) <= 2


def test_no_threshold_is_marked_where_a_share_was_chosen() -> None:
    marked, unmarked = figure(50.0), figure(None)
    assert count_of(marked, LIGHT.series[1]) > count_of(unmarked, LIGHT.series[1]) + 100


@pytest.mark.parametrize("scenario_count", [0, 1])
def test_a_night_without_scenarios_is_drawn(scenario_count: int) -> None:
    png = threshold_sensitivity_figure(
        np.arange(0.0, 3.0),
        {"negative": np.zeros(3, dtype=np.int64)},
        threshold=50.0,
        scenario_count=scenario_count,
    )
    assert png.startswith(b"\x89PNG")
