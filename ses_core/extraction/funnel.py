"""The funnel of a night in steps: from logs to synthesized environments, under both counts."""

from dataclasses import dataclass

from ses_core.extraction.holdout import Holdout
from ses_core.extraction.selection import FilterFunnel
from ses_core.settings import FilterSettings

COUNT_WORDS = {
    "negative": "steps with v < 0",
    "not-forward": "steps with v ≤ 0.05 m/s",
    "reversing-seconds": "seconds of reversing",
}

REJECTION_WORDS = {
    "no_environment": "could not be rebuilt",
    "not_traversable": "cannot be crossed by the target robot as rebuilt",
    "path_not_free": "have the robot's own path through walls",
    "hardly_observed": "were hardly seen",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class FunnelStep:
    """One level of the funnel.

    Attributes:
        name: What is counted.
        count: How many, under the count that chose.
        other: How many under the other count, where the two can differ.
    """

    name: str
    count: int
    other: int | None = None


def funnel_steps(
    chosen: FilterFunnel, other: FilterFunnel, *, logs: int, synthesized: int
) -> tuple[FunnelStep, ...]:
    """List the levels, widest first as a rule; `logs` are those of the window."""
    return (
        FunnelStep(name="logs", count=logs),
        FunnelStep(name="scenarios", count=chosen.scenarios),
        FunnelStep(name="challenging", count=chosen.challenging, other=other.challenging),
        FunnelStep(name="usable", count=chosen.usable, other=other.usable),
        FunnelStep(name="to learn from", count=chosen.pool, other=other.pool),
        FunnelStep(name="synthesized", count=synthesized),
    )


def challenging_rule(settings: FilterSettings) -> str:
    """Say what makes a scenario challenging."""
    words = COUNT_WORDS[settings.count_kind]
    if settings.challenging_share is not None:
        return f"the {100.0 * settings.challenging_share:g} % with the most {words}"
    return f"more than {settings.threshold:g} {words}"


def funnel_remarks(funnel: FilterFunnel, holdout: Holdout) -> tuple[str, ...]:
    """Say in sentences where scenarios went that the steps do not name; nothing for zeros."""
    counted = [
        (funnel.terminal, "unfinished rests of drives stand apart and are not scenarios"),
        (funnel.unknown, "scenarios have no known velocity and are never challenging"),
        *(
            (count, f"challenging scenarios {REJECTION_WORDS[reason]}")
            for reason, count in funnel.rejected.items()
        ),
        (funnel.heldout, "usable ones are held out for evaluation"),
        (funnel.straddling, "usable ones lead across the border of a held-out place"),
        (funnel.over_robot_limit, "usable ones are more than one robot may give"),
    ]
    remarks = [f"{count:,}: {words}." for count, words in counted if count]
    if holdout.basis == "nothing":
        remarks.append("Nothing is held out: all scenarios come from one place.")
    else:
        noun = "sites" if holdout.basis == "site" else "places of the only site"
        remarks.append(f"Held out for evaluation: {len(holdout.heldout)} {noun}.")
    return tuple(remarks)
