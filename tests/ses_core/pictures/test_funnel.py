import io

import numpy as np
from PIL import Image

from ses_core.extraction.funnel import FunnelStep
from ses_core.pictures.figures import DARK, LIGHT
from ses_core.pictures.funnel import funnel_figure

STEPS = (
    FunnelStep(name="scenarios", count=1000),
    FunnelStep(name="challenging", count=250, other=500),
)


def drawn_width(png: bytes, color: str) -> int:
    """Width [pixel] of the widest run of a colour."""
    image = np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))
    return int((image == tuple(bytes.fromhex(color[1:]))).all(axis=2).sum(axis=1).max())


def test_bars_are_as_long_as_their_counts() -> None:
    png = funnel_figure(STEPS, count_name="a", other_name="b")
    widest = drawn_width(png, LIGHT.series[0])
    assert abs(drawn_width(png, LIGHT.series[4]) / widest - 0.5) < 0.02


def test_dark_twin_is_drawn_on_dark_paper() -> None:
    for theme in (LIGHT, DARK):
        png = funnel_figure(STEPS, count_name="a", other_name="b", theme=theme)
        corner = Image.open(io.BytesIO(png)).convert("RGB").getpixel((0, 0))
        assert corner == tuple(bytes.fromhex(theme.paper[1:]))


def test_a_funnel_of_zeros_is_drawn() -> None:
    empty = tuple(FunnelStep(name=step.name, count=0, other=step.other and 0) for step in STEPS)
    assert funnel_figure(empty, count_name="a", other_name="b").startswith(b"\x89PNG")
