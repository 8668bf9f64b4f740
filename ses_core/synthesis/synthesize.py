"""From challenging environments to the ones a policy trains in (section III-C)."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from ses_core.arrays import BoolArray
from ses_core.navigation import NavigationDomain, NavigationEnvironment
from ses_core.protocols import FittedSynthesizer
from ses_core.recipes import digest_json
from ses_core.robot_profile import RobotProfile
from ses_core.synthesis.factory import make_synthesizer
from ses_core.synthesis.sizes import SynthesisPlan, plan_synthesis
from ses_core.synthesis.traversability import traversable
from ses_core.synthesis_settings import SynthesisSettings


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedSynthesis:
    """A fitted synthesizer and the plan it was fitted under."""

    plan: SynthesisPlan
    synthesizer: FittedSynthesizer


@dataclass(frozen=True, slots=True, kw_only=True)
class SynthesisResult:
    """p_SES, and what it took to get it.

    Attributes:
        environments: Each one can be crossed by the target robot, and no two are equal.
        method_asked: The synthesizer of the settings.
        method_used: The synthesizer that made them; another one where `notes` say so.
        drawn: Samples looked at.
        rejected_share: Share of them that the target robot cannot cross.
        repeated: Samples passed over because they equal one already taken.
        copies: By environment, the scenario whose recorded place it equals cell by cell.
        notes: Where the result departs from what was asked, in words.
    """

    environments: NavigationDomain
    method_asked: str
    method_used: str
    drawn: int
    rejected_share: float
    repeated: int
    copies: Mapping[str, str]
    notes: tuple[str, ...]


def synthesize(
    domain: NavigationDomain,
    *,
    settings: SynthesisSettings,
    target: RobotProfile,
    rng: Generator,
    progress: Callable[[float], None],
) -> SynthesisResult:
    """Fit to a domain, hardest environment first, and draw what can be crossed.

    Raises:
        SynthesisError: The domain is empty.
    """
    fit_rng, sample_rng = rng.spawn(2)
    fitted = fit_synthesis(domain, settings=settings, rng=fit_rng, progress=progress)
    return draw_environments(fitted, domain, settings=settings, target=target, rng=sample_rng)


def fit_synthesis(
    domain: NavigationDomain,
    *,
    settings: SynthesisSettings,
    rng: Generator,
    progress: Callable[[float], None],
) -> FittedSynthesis:
    """Fit the synthesizer that the settings and the size of the domain call for.

    Raises:
        SynthesisError: The domain is empty.
    """
    plan = plan_synthesis(settings, available=len(domain.environments))
    synthesizer = make_synthesizer(plan.synthesizer, environments=plan.environments)
    return FittedSynthesis(
        plan=plan, synthesizer=synthesizer.fit(domain, rng=rng, progress=progress)
    )


def draw_environments(
    fitted: FittedSynthesis,
    domain: NavigationDomain,
    *,
    settings: SynthesisSettings,
    target: RobotProfile,
    rng: Generator,
) -> SynthesisResult:
    """Draw until enough distinct environments can be crossed, or the attempts are used up.

    Environments that equal one of the domain it was fitted to are counted and traced.
    """
    plan = fitted.plan
    cells = fitted.synthesizer.sample(plan.environments * settings.attempts, rng=rng)
    taken, drawn, crossable, repeated = _take(
        cells, count=plan.environments, radius=target.inscribed_radius_m
    )
    recorded = {
        environment.cells.tobytes(): environment.scenario_id
        for environment in reversed(domain.environments)
    }
    method = plan.synthesizer.method
    environments = tuple(_environment(cells[index], method=method) for index in taken)
    notes = list(plan.notes)
    if len(taken) < plan.environments:
        notes.append(
            f"{len(taken)} environments instead of {plan.environments}: among {drawn} samples "
            f"{crossable} can be crossed, {repeated} of these repeat another"
        )
    return SynthesisResult(
        environments=NavigationDomain(environments),
        method_asked=settings.synthesizer.method,
        method_used=method,
        drawn=drawn,
        rejected_share=(drawn - crossable) / drawn,
        repeated=repeated,
        copies={
            environment.environment_id: recorded[environment.cells.tobytes()]
            for environment in environments
            if environment.cells.tobytes() in recorded
        },
        notes=tuple(notes),
    )


def _take(cells: BoolArray, *, count: int, radius: float) -> tuple[list[int], int, int, int]:
    """Look at samples (S, 30, 30) in order until `count` are taken.

    Returns:
        Which are taken; how many were looked at, can be crossed, and repeat one taken before.
    """
    taken: list[int] = []
    seen: set[bytes] = set()
    drawn = crossable = repeated = 0
    for first in range(0, len(cells), count):
        chunk = cells[first : first + count]
        for offset in np.flatnonzero(traversable(chunk, radius=radius)):
            crossable += 1
            key = chunk[offset].tobytes()
            if key in seen:
                repeated += 1
                continue
            seen.add(key)
            taken.append(first + int(offset))
            if len(taken) == count:
                return taken, first + int(offset) + 1, crossable, repeated
        drawn = first + len(chunk)
    return taken, drawn, crossable, repeated


def _environment(cells: BoolArray, *, method: str) -> NavigationEnvironment:
    """Name an environment by how it was made and by its cells."""
    return NavigationEnvironment(
        environment_id=digest_json([method, "", np.packbits(cells).tobytes().hex()])[:16],
        cells=cells,
        observed=np.ones_like(cells),
        origin=method,
    )
