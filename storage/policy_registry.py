"""`PolicyRegistry`: which policy is champion, and every change of that, never rewritten."""

import time
from collections.abc import Callable
from dataclasses import dataclass

from ses_core.errors import ArtifactError
from ses_core.recipes import ArtifactRef, JsonValue, parse_ref
from storage.layout import Layout
from storage.numbered_log import NO_ENTRY, LogEntry, NumberedLog


@dataclass(frozen=True, slots=True, kw_only=True)
class RegistryEntry:
    """One change of the champion.

    Attributes:
        number: Place in the history, from 1.
        action: `promote` or `rollback`.
        policy: The champion from here on; None where a rollback left none.
        policy_id: Its name in the table of policies; empty for None.
        run_id: The night that asked for it; empty for a rollback.
        restores: For a rollback, the entry whose champion it brings back; 0 for none.
        replaces: The entry whose champion it replaced; 0 for the first.
        reason: In the words of whoever asked for it.
    """

    number: int
    action: str
    policy: ArtifactRef | None
    policy_id: str
    run_id: str
    restores: int
    replaces: int
    reason: str
    created_stamp_ns: int


class PolicyRegistry:
    """The history of champions in one store."""

    def __init__(self, layout: Layout) -> None:
        self._log = NumberedLog(layout.registry)

    def history(self) -> list[RegistryEntry]:
        """List every change, oldest first.

        Raises:
            ArtifactError: An entry is damaged.
        """
        return [_entry(entry) for entry in self._log.after(0, NO_ENTRY)]

    def champion(self) -> RegistryEntry | None:
        """Give the change that made the present champion; None until one is promoted."""
        history = self.history()
        return history[-1] if history and history[-1].policy is not None else None

    def promote(
        self, policy: ArtifactRef, *, policy_id: str, run_id: str, reason: str
    ) -> RegistryEntry:
        """Make a policy the champion; promoting the champion again changes nothing."""

        def content(history: list[RegistryEntry]) -> dict[str, JsonValue] | None:
            if history and history[-1].policy == policy:
                return None
            return {
                "action": "promote",
                "policy": str(policy),
                "policy_id": policy_id,
                "run_id": run_id,
                "restores": 0,
                "replaces": len(history),
                "reason": reason,
            }

        return self._append(content)

    def rollback(self, *, reason: str) -> RegistryEntry:
        """Bring back the champion before the present one; again, the one before that.

        Raises:
            ArtifactError: There is no champion to take back.
        """

        def content(history: list[RegistryEntry]) -> dict[str, JsonValue] | None:
            if not history or history[-1].policy is None:
                raise ArtifactError("there is no champion to roll back: none was promoted yet")
            before = _champion_before(history)
            return {
                "action": "rollback",
                "policy": str(before.policy) if before else "",
                "policy_id": before.policy_id if before else "",
                "run_id": "",
                "restores": before.number if before else 0,
                "replaces": len(history),
                "reason": reason,
            }

        return self._append(content)

    def _append(
        self, content: Callable[[list[RegistryEntry]], dict[str, JsonValue] | None]
    ) -> RegistryEntry:
        """Append what follows from the history, anew if another writer was faster."""
        while True:
            entries = list(self._log.after(0, NO_ENTRY))
            history = [_entry(entry) for entry in entries]
            value = content(history)
            if value is None:
                return history[-1]
            parent = entries[-1].digest if entries else NO_ENTRY
            value = {**value, "created_stamp_ns": time.time_ns()}
            appended = self._log.append(len(entries) + 1, parent, value)
            if appended is not None:
                return _entry(appended)


def _champion_before(history: list[RegistryEntry]) -> RegistryEntry | None:
    """Find the promotion that the present champion took over from."""
    promotion = _promotion(history, history[-1])
    if not promotion.replaces:
        return None
    before = _promotion(history, history[promotion.replaces - 1])
    return before if before.policy is not None else None


def _promotion(history: list[RegistryEntry], entry: RegistryEntry) -> RegistryEntry:
    """Find the promotion behind an entry's champion: a rollback points back at it."""
    return history[entry.restores - 1] if entry.restores else entry


def _entry(entry: LogEntry) -> RegistryEntry:
    value = entry.value
    policy = str(value["policy"])
    return RegistryEntry(
        number=entry.number,
        action=str(value["action"]),
        policy=parse_ref(policy) if policy else None,
        policy_id=str(value["policy_id"]),
        run_id=str(value["run_id"]),
        restores=int(str(value["restores"])),
        replaces=int(str(value["replaces"])),
        reason=str(value["reason"]),
        created_stamp_ns=int(str(value["created_stamp_ns"])),
    )
