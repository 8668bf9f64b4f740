"""What a night decides about the policy it trained; it reports, and promotes nothing."""

from collections.abc import Sequence
from dataclasses import dataclass

from ses_core.evaluation.comparison import LEAST_ENVIRONMENTS, Comparison, judge


@dataclass(frozen=True, slots=True)
class NightDecision:
    """A verdict in a word or two, and the reasons in sentences."""

    verdict: str
    reasons: tuple[str, ...]


NOT_PROMOTED = "Nothing was promoted: a night reports, and the deployed policy stays."


def decide_without_training(
    *, scenarios: int, challenging: int, usable: int, pool: int, least_pool: int
) -> NightDecision:
    """Say why nothing was trained: the first step of the funnel that left too little."""
    if pool >= least_pool:
        reason = f"Nothing synthesized from {pool} places can be crossed by the target robot."
    elif not scenarios:
        reason = "The logs hold no scenario: no robot got 5 m away from where it began."
    elif not challenging:
        reason = f"None of {scenarios} scenarios is challenging."
    elif not usable:
        reason = (
            f"Of {scenarios} scenarios {challenging} are challenging, but no rebuilt place of "
            "these can be used."
        )
    elif pool:
        reason = (
            f"Of {scenarios} scenarios {challenging} are challenging, and {pool} of their places "
            f"can be learned from: fewer than {least_pool}, which would be learned by heart."
        )
    else:
        reason = (
            f"The {usable} usable challenging scenarios of {scenarios} are all held out for "
            "evaluation."
        )
    return NightDecision("no-training", (reason, "Nothing was trained."))


def decide(comparisons: Sequence[Comparison], *, parent: str) -> NightDecision:
    """Judge the new policy against the one it came from.

    Args:
        comparisons: The new policy against each other one; empty where nothing was held out.
        parent: The policy it came from, as comparisons name it.
    """
    against = next((one for one in comparisons if one.baseline == parent), None)
    if against is None:
        reason = "No world is held out, so the new policy was not measured."
        return NightDecision("insufficient-evidence", (reason, NOT_PROMOTED))
    verdict = judge(against)
    reasons = [
        f"On {against.worlds} held-out worlds ({against.trials} trials) success changed by "
        f"{100.0 * against.success_difference:+.1f} points and the time, failures counted as "
        f"100 s, by {against.time_difference_s:+.1f} s against {parent}."
    ]
    if against.worlds < LEAST_ENVIRONMENTS:
        reasons.append(
            f"{against.worlds} held-out worlds are too few for a verdict: at least "
            f"{LEAST_ENVIRONMENTS} are needed."
        )
    return NightDecision(verdict.replace(" ", "-"), (*reasons, NOT_PROMOTED))
