import pytest
from hypothesis import given
from hypothesis import strategies as st

from ses_core.scorecard.rows import Aim, ScorecardRow
from ses_core.scorecard.standing import Standing, standing

REAL = (0.5, 0.6, 0.7)


def row(
    value: float | None,
    *,
    aim: Aim,
    interval: tuple[float, float] | None = None,
    real: tuple[float, float, float] | None = REAL,
    metric: str = "coverage",
    real_value: float | None = None,
) -> ScorecardRow:
    """Make a row; `real` is low, value and high between real ones."""
    return ScorecardRow(
        metric=metric,
        feature="cells",
        unit="share",
        aim=aim,
        value=value,
        low=interval[0] if interval else None,
        high=interval[1] if interval else None,
        real_value=real[1] if real else real_value,
        real_low=real[0] if real else None,
        real_high=real[2] if real else None,
        n_real=9,
        n_synthesized=9,
        halves="by site (3)",
    )


@pytest.mark.parametrize(
    ("value", "aim", "interval", "expected"),
    [
        (0.4, "high", None, "too low"),
        (0.4, "high", (0.3, 0.55), "too low"),
        # Its own interval reaches the real value: a few environments more could have moved it.
        (0.4, "high", (0.3, 0.65), "within"),
        (0.5, "high", (0.45, 0.55), "within"),
        (0.9, "high", (0.8, 1.0), "within"),
        (0.9, "low", (0.8, 1.0), "too high"),
        (0.9, "low", (0.55, 1.0), "within"),
        (0.4, "low", (0.3, 0.45), "within"),
        (0.9, "as real", (0.8, 1.0), "too high"),
        (0.4, "as real", (0.3, 0.45), "too low"),
        (0.6, "as real", (0.6, 0.6), "within"),
        (None, "high", None, "unknown"),
    ],
)
def test_a_value_is_marked_beyond_the_real_interval_on_the_wrong_side(
    value: float | None, aim: Aim, interval: tuple[float, float] | None, expected: Standing
) -> None:
    assert standing(row(value, aim=aim, interval=interval)) == expected


def test_without_a_ceiling_nothing_is_said() -> None:
    assert standing(row(0.4, aim="high", real=None)) == "unknown"
    assert standing(row(0.4, aim="high", real=None, real_value=0.9)) == "unknown"


def test_memorisation_has_its_ceiling_by_definition() -> None:
    for value, interval, expected in (
        (0.95, (0.9, 1.0), "too high"),
        (0.55, (0.45, 0.65), "within"),
        (0.2, (0.1, 0.3), "too low"),
    ):
        one = row(
            value,
            aim="as real",
            interval=interval,
            real=None,
            real_value=0.5,
            metric="memorisation",
        )
        assert standing(one) == expected


@pytest.mark.parametrize(("value", "expected"), [(1.0, "within"), (0.99, "too low")])
def test_what_is_handed_on_has_to_be_crossed_whatever_real_ones_are(
    value: float, expected: Standing
) -> None:
    one = row(value, aim="high", interval=(0.5, 1.0), metric="traversable, shipped")
    assert standing(one) == expected


@given(
    st.floats(-1, 1),
    st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1)).map(sorted),
    st.tuples(st.floats(0, 1), st.floats(0, 1)),
)
def test_low_is_good_where_its_negative_is_high(
    value: float, real: list[float], spread: tuple[float, float]
) -> None:
    turned: dict[Standing, Standing] = {"too low": "too high", "too high": "too low"}
    sides: tuple[tuple[int, Aim, float, float], ...] = (
        (1, "low", real[0], real[2]),
        (-1, "high", -real[2], -real[0]),
    )
    found, mirrored = (
        standing(
            row(
                sign * value,
                aim=aim,
                interval=(
                    sign * value - spread[sign < 0],
                    sign * value + spread[sign > 0],
                ),
                real=(low, sign * real[1], high),
            )
        )
        for sign, aim, low, high in sides
    )
    assert turned.get(found, found) == mirrored
