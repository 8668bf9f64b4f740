"""How a task ends: `Cached` in the Prefect UI when it was found, `Completed` when built."""

from typing import Protocol, TypeVar, cast

from prefect.states import Completed


class Concluded(Protocol):
    """What a task of ours returns."""

    @property
    def found(self) -> bool:
        """True when nothing had to be built."""
        ...


Outcome = TypeVar("Outcome", bound=Concluded)


def conclude(outcome: Outcome) -> Outcome:
    """End a task: Prefect takes a returned state as the task's own, with the outcome as its data.

    Call the task with `submit(...).result()`, which unwraps it: a direct call hands the state out.
    """
    if not outcome.found:
        return outcome
    return cast("Outcome", Completed(name="Cached", message="found in the store", data=outcome))
