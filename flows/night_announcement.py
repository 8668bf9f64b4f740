"""What a night leaves on its run in the Prefect UI: one summary, and its tables."""

from collections.abc import Sequence

from prefect.artifacts import create_markdown_artifact, create_table_artifact

from flows.night_summary import NightSummary
from storage.batch_manifest import LogRecord


def announce_night(summary: NightSummary, records: Sequence[LogRecord]) -> None:
    """Create the artifacts of the run that is under way; keys are the same every night."""
    create_markdown_artifact(_markdown(summary), key="night", description="What the night came to")
    create_table_artifact(
        [{"stage": stage, **counts.model_dump()} for stage, counts in summary.stages.items()],
        key="stages",
        description="Built, found and seconds by stage",
    )
    if summary.scorecard:
        create_table_artifact(
            [row.model_dump(mode="json") for row in summary.scorecard],
            key="scorecard",
            description="Do the synthesized environments stand for those learned from?",
        )
    refused = [record for record in records if record.status == "quarantined"]
    if refused:
        create_table_artifact(
            [{"log": one.name, "reason": one.reason, "id": one.log_id[:12]} for one in refused],
            key="quarantine",
            description="Logs that were refused",
        )
    if summary.evaluation:
        create_table_artifact(
            [row.model_dump(mode="json") for row in summary.evaluation],
            key="evaluation",
            description="Trials on held-out worlds",
        )
    if summary.comparisons:
        create_table_artifact(
            [row.model_dump(mode="json") for row in summary.comparisons],
            key="comparisons",
            description="The new policy against the others, on the same trials",
        )


def _markdown(summary: NightSummary) -> str:
    logs = summary.logs
    counts = ", ".join(f"{kind} {count}" for kind, count in summary.challenging_by_count.items())
    lines = [
        f"# Night {summary.run_id or summary.batch_date.isoformat()}",
        f"**{summary.decision}** {summary.reason}".rstrip(),
        "",
        f"- logs: {logs.new} new, {logs.known} known, {logs.quarantined} refused, "
        f"{logs.waiting} still arriving",
        f"- scenarios: {summary.scenarios}, challenging: {summary.challenging} ({counts})",
        f"- environments: {summary.environments}, decisions trained: {summary.decisions_trained}",
        f"- champion: {summary.champion or 'none'}",
    ]
    if summary.report:
        lines.append(f"- report: `{summary.report}`")
    return "\n".join(lines)
