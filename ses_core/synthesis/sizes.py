"""What synthesis does with few environments: one table, nothing silent.

With N environments to learn from and M = 100 asked for, by default settings:

| N | gan, gan-paper, autoregressive | pca, pca-paper | rs, identity, medoids | mirror |
| --- | --- | --- | --- | --- |
| 0 | refused | refused | refused | refused |
| 1 | 4 by mirror | 1 by identity | 1 | 4 |
| 5 | 20 by mirror | 5 of 4 components | 5 | 20 |
| 30 | 100 | 30 of 29 components | 30 | 100 |
| 99 | 100 | 99 of 98 components | 99 | 100 |
| 300 | 100 | 100 | 100 | 100 |

These are the most: what cannot be crossed, and what equals another one, is passed over. Then
the notes of the result say how many there are.

A generator taught by fewer than `least_environments` places repeats them with noise (measured:
it learns speckle before walls), so these places are given instead, with their mirror images and
both the other way round. A method that hands out recorded places never repeats one. N
environments span N - 1 principal components; a single one spans none and is copied. What was
done stands in the plan, its notes reach the report.
"""

from dataclasses import dataclass

from ses_core.errors import SynthesisError
from ses_core.occupancy import ENVIRONMENT_CELLS
from ses_core.synthesis_settings import (
    IdentitySettings,
    LearnedSettings,
    MirrorSettings,
    PcaPaperSettings,
    PcaSettings,
    SynthesisSettings,
    SynthesizerSettings,
)

COURSES_PER_PLACE = 4
"""A place as it is, mirrored, the other way round, and both (`ses_core.synthesis.mirror`)."""

_Pca = PcaSettings | PcaPaperSettings


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
    if not isinstance(synthesizer, LearnedSettings):
        environments = min(environments, _most_environments(synthesizer, available))
    if environments < settings.environments:
        notes.append(
            f"{environments} environments instead of {settings.environments}: "
            f"{synthesizer.method} never repeats one, and {available} recorded make no more"
        )
    return SynthesisPlan(synthesizer=synthesizer, environments=environments, notes=tuple(notes))


def _fitting_synthesizer(
    asked: SynthesizerSettings, available: int
) -> tuple[SynthesizerSettings, list[str]]:
    if isinstance(asked, LearnedSettings) and available < asked.least_environments:
        return MirrorSettings(), [_instead("mirror", asked, available, asked.least_environments)]
    if isinstance(asked, _Pca):
        if available == 1:
            return IdentitySettings(), [_instead("identity", asked, available, 2)]
        most = min(available - 1, ENVIRONMENT_CELLS**2)
        if asked.components > most:
            return asked.model_copy(update={"components": most}), [
                f"{most} principal components instead of {asked.components}: "
                f"{available} environments have no more"
            ]
    return asked, []


def _instead(used: str, asked: SynthesizerSettings, available: int, least: int) -> str:
    return (
        f"{used} instead of {asked.method}: "
        f"{available} environments to learn from, {asked.method} needs {least}"
    )


def _most_environments(synthesizer: SynthesizerSettings, available: int) -> int:
    """How many it can hand on without a repetition, if no two of the recorded ones are equal."""
    if isinstance(synthesizer, MirrorSettings):
        return COURSES_PER_PLACE * available
    return available
