"""What a night says about the policy it trained, or why it trained none."""

import pytest

from ses_core.evaluation.comparison import Comparison
from ses_core.evaluation.decision import decide, decide_without_training


def comparison(**changes: object) -> Comparison:
    values: dict[str, object] = {
        "policy": "new",
        "baseline": "original",
        "success_difference": 0.02,
        "ci": (-0.01, 0.05),
        "time_difference_s": -3.0,
        "ci_s": (-5.0, -1.0),
        "trials": 400,
        "worlds": 120,
    }
    return Comparison(**{**values, **changes})  # type: ignore[arg-type]  # values by name


@pytest.mark.parametrize(
    ("funnel", "words"),
    [
        ((0, 0, 0, 0), "no scenario"),
        ((9, 0, 0, 0), "None of 9 scenarios"),
        ((9, 3, 0, 0), "no rebuilt place"),
        ((9, 3, 2, 0), "all held out"),
        ((99, 30, 20, 9), "fewer than 10"),
        ((99, 30, 20, 10), "can be crossed"),
    ],
)
def test_the_reason_is_the_first_step_that_left_too_little(
    funnel: tuple[int, int, int, int], words: str
) -> None:
    scenarios, challenging, usable, pool = funnel
    decision = decide_without_training(
        scenarios=scenarios, challenging=challenging, usable=usable, pool=pool, least_pool=10
    )
    assert decision.verdict == "no-training"
    assert words in decision.reasons[0]


def test_without_a_measurement_the_evidence_is_insufficient() -> None:
    assert decide([], parent="original").verdict == "insufficient-evidence"
    elsewhere = comparison(baseline="dwa-slow")
    assert decide([elsewhere], parent="original").verdict == "insufficient-evidence"


def test_a_clear_gain_on_enough_worlds_is_better_but_nothing_is_promoted() -> None:
    decision = decide([comparison()], parent="original")
    assert decision.verdict == "better"
    assert "Nothing was promoted" in decision.reasons[-1]


def test_the_same_gain_on_too_few_worlds_proves_nothing() -> None:
    decision = decide([comparison(worlds=99)], parent="original")
    assert decision.verdict == "insufficient-evidence"
    assert "at least 100" in decision.reasons[1]
