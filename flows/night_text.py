"""A night's summary for people at a terminal."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from flows.command_context import aligned
from ses_core.recipes import JsonValue

if TYPE_CHECKING:
    from flows.night_summary import NightSummary, ScorecardEntry


def describe_night(summary: "NightSummary") -> str:
    """Say what a night did: the funnel, the stages, the evaluation, the decision."""
    logs = summary.logs
    lines = [
        f"logs          {logs.new} new, {logs.known} known, {logs.quarantined} refused",
        f"scenarios     {summary.scenarios}, challenging {summary.challenging}",
    ]
    if logs.waiting:
        lines.insert(1, f"              {logs.waiting} still arriving, left for the next night")
    if summary.environments:
        lines.append(f"environments  {summary.environments}")
    if summary.scorecard:
        lines.append(f"scorecard     {_scorecard_words(summary.scorecard)}")
    stages: list[dict[str, JsonValue]] = [
        {"stage": name, "built": count.built, "found": count.found, "seconds": count.seconds}
        for name, count in summary.stages.items()
        if count.built or count.found
    ]
    if stages:
        lines += ["", aligned(stages)]
    if summary.evaluation:
        lines += ["", aligned([row.model_dump(mode="json") for row in summary.evaluation])]
    lines += ["", f"decision      {summary.decision}"]
    if summary.reason:
        lines.append(f"              {summary.reason}")
    if not any(count.built for count in summary.stages.values()):
        lines.append("              everything was found in the store; nothing was computed")
    if summary.report:
        lines.append(f"report        {summary.report}")
    return "\n".join(lines)


def _scorecard_words(rows: "Sequence[ScorecardEntry]") -> str:
    """Say how many numbers of the environments are worse than among real ones."""
    judged = [row for row in rows if row.standing != "unknown"]
    marked = [row for row in judged if row.standing != "within"]
    return f"{len(marked)} of {len(judged)} numbers worse than among real environments"
