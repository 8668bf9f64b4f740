"""Where something came from and what became of it, from the tables and the manifests."""

from collections.abc import Iterator

import pandas as pd

from ses_core.recipes import JsonValue
from storage.batch_manifest import RunRecord, batch_dates, read_manifest
from storage.layout import Layout
from storage.table_reader import open_table

Relation = dict[str, JsonValue]

_COLUMNS = {
    "logs": ["log_id", "name", "robot", "site", "batch_date"],
    "scenarios": ["scenario_id", "log_id", "kind", "first_step", "last_step"],
    "environments": ["environment_id", "scenario_id", "origin"],
    "selections": ["run_id", "scenario_id", "rank"],
    "policies": ["policy_id", "run_id", "parent_id", "algorithm", "steps"],
}


def find_run(layout: Layout, run_id: str) -> RunRecord | None:
    """Give what a night recorded, or None where no night has this id."""
    for day in reversed(batch_dates(layout)):
        manifest = read_manifest(layout, day)
        for run in manifest.runs if manifest else ():
            if run.run_id == run_id:
                return run
    return None


def explain(layout: Layout, identity: str) -> list[Relation]:
    """List what an id names, what that was made from and what was made from it, one step each.

    Args:
        layout: The store.
        identity: Of a night, policy, environment, scenario or log.

    Returns:
        Rows of `relation` (`is`, `from`, `into`), `kind`, `id` and `note`; empty for an unknown id.
    """
    return list(_Lineage(layout).relations(identity))


class _Lineage:
    """One look at the tables."""

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        self._tables = {
            name: open_table(layout.root, name, columns=columns)
            for name, columns in _COLUMNS.items()
        }

    def relations(self, identity: str) -> Iterator[Relation]:
        yield from self._of_log(identity)
        yield from self._of_scenario(identity)
        yield from self._of_environment(identity)
        yield from self._of_policy(identity)
        yield from self._of_run(identity)

    def _rows(self, table: str, column: str, value: str) -> pd.DataFrame:
        rows = self._tables[table]
        return rows[rows[column] == value]

    def _of_log(self, identity: str) -> Iterator[Relation]:
        for log in self._rows("logs", "log_id", identity).itertuples():
            note = f"{log.name}, {log.site}/{log.robot}, {log.batch_date}"
            yield _relation("is", "log", identity, note)
            yield from self._scenarios("into", "log_id", identity)

    def _of_scenario(self, identity: str) -> Iterator[Relation]:
        for relation in self._scenarios("is", "scenario_id", identity):
            yield relation
            for scenario in self._rows("scenarios", "scenario_id", identity).itertuples():
                yield from self._log("from", str(scenario.log_id))
            for made in self._rows("environments", "scenario_id", identity).itertuples():
                yield _relation("into", "environment", str(made.environment_id), str(made.origin))
            for chosen in self._rows("selections", "scenario_id", identity).itertuples():
                yield _relation("into", "night", str(chosen.run_id), f"rank {chosen.rank}")

    def _of_environment(self, identity: str) -> Iterator[Relation]:
        for made in self._rows("environments", "environment_id", identity).itertuples():
            yield _relation("is", "environment", identity, str(made.origin))
            yield from self._scenarios("from", "scenario_id", str(made.scenario_id))

    def _of_policy(self, identity: str) -> Iterator[Relation]:
        for policy in self._rows("policies", "policy_id", identity).itertuples():
            yield _relation("is", "policy", identity, f"{policy.algorithm}, {policy.steps} steps")
            yield _relation("from", "night", str(policy.run_id), "")
            if isinstance(policy.parent_id, str) and policy.parent_id:
                yield _relation("from", "policy", policy.parent_id, "parent")
        for child in self._rows("policies", "parent_id", identity).itertuples():
            yield _relation("into", "policy", str(child.policy_id), "trained from it")

    def _of_run(self, identity: str) -> Iterator[Relation]:
        run = find_run(self._layout, identity)
        if run is None:
            return
        yield _relation("is", "night", identity, run.decision)
        for chosen in self._rows("selections", "run_id", identity).itertuples():
            yield _relation("from", "scenario", str(chosen.scenario_id), f"rank {chosen.rank}")
        for stage in run.stages:
            for artifact in stage.artifacts:
                yield _relation("into", "artifact", artifact, stage.stage)
        for policy in self._rows("policies", "run_id", identity).itertuples():
            yield _relation("into", "policy", str(policy.policy_id), str(policy.algorithm))

    def _scenarios(self, relation: str, column: str, value: str) -> Iterator[Relation]:
        for scenario in self._rows("scenarios", column, value).itertuples():
            note = f"{scenario.kind}, steps {scenario.first_step} to {scenario.last_step}"
            yield _relation(relation, "scenario", str(scenario.scenario_id), note)

    def _log(self, relation: str, identity: str) -> Iterator[Relation]:
        for log in self._rows("logs", "log_id", identity).itertuples():
            yield _relation(relation, "log", identity, f"{log.name}, {log.site}/{log.robot}")


def _relation(relation: str, kind: str, identity: str, note: str) -> Relation:
    return {"relation": relation, "kind": kind, "id": identity, "note": note}
