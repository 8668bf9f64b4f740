"""What synthesis does with few environments: one table, nothing silent.

With N environments to learn from, M asked for:

| N | `gan` | `pca` | `rs`, `identity` |
| --- | --- | --- | --- |
| 0 | refused | refused | refused |
| 1 | `identity` | `identity` | that one |
| < `least_environments` (30) | `identity` | as below | as below |
| < components + 1 (101) | as asked | N - 1 components | as asked |
| < M | M new ones | N, each once | N, each once |

A generator taught by less than some thirty places repeats them with noise (measured: it
learns speckle before walls), so they are copied instead, as in the paper's own physical
experiment. What was done stands in the plan, its notes reach the report.
"""

from dataclasses import dataclass

from ses_core.errors import SynthesisError
from ses_core.synthesis_settings import (
    GanSettings,
    IdentitySettings,
    PcaSettings,
    SynthesisSettings,
    SynthesizerSettings,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SynthesisPlan:
    """What will be done, given how many environments there are.

    Attributes:
        synthesizer: Settings of the synthesizer actually used, with counts that fit.
        environments: How many environments are to be handed on.
        notes: Where this departs from what was asked, in words.
    """

    synthesizer: SynthesizerSettings
    environments: int
    notes: tuple[str, ...] = ()


def plan_synthesis(settings: SynthesisSettings, *, available: int) -> SynthesisPlan:
    """Decide how many environments are synthesized from `available` ones, and how.

    Raises:
        SynthesisError: There is nothing to learn from.
    """
    if available < 1:
        raise SynthesisError(
            "found no challenging environment to synthesize from, expected at least 1"
        )
    synthesizer, notes = _fitting_synthesizer(settings.synthesizer, available)
    environments = settings.environments
    if synthesizer.method != "gan" and available < environments:
        notes.append(
            f"{available} environments instead of {environments}: "
            f"{synthesizer.method} never repeats one, and there are no more"
        )
        environments = available
    return SynthesisPlan(synthesizer=synthesizer, environments=environments, notes=tuple(notes))


def _fitting_synthesizer(
    asked: SynthesizerSettings, available: int
) -> tuple[SynthesizerSettings, list[str]]:
    least = _least_environments(asked)
    if available < least:
        return IdentitySettings(), [
            f"identity instead of {asked.method}: "
            f"{available} environments to learn from, {asked.method} needs {least}"
        ]
    if isinstance(asked, PcaSettings) and available <= asked.components:
        fewer = available - 1
        return asked.model_copy(update={"components": fewer}), [
            f"{fewer} principal components instead of {asked.components}: "
            f"{available} environments have no more"
        ]
    return asked, []


def _least_environments(asked: SynthesizerSettings) -> int:
    if isinstance(asked, GanSettings):
        return asked.least_environments
    return 2 if isinstance(asked, PcaSettings) else 1
