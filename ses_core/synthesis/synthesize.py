"""From challenging environments to the ones a policy trains in (section III-C)."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from ses_core.arrays import BoolArray
from ses_core.navigation import NavigationDomain, NavigationEnvironment
from ses_core.protocols import FittedSynthesizer
from ses_core.recipes import digest_json
from ses_core.robot_profile import RobotProfile
from ses_core.synthesis.factory import make_synthesizer
from ses_core.synthesis.sizes import SynthesisPlan, plan_synthesis
from ses_core.synthesis.taking import Taking
from ses_core.synthesis_settings import LearnedSettings, SynthesisSettings


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedSynthesis:
    """A fitted synthesizer and the plan it was fitted under."""

    plan: SynthesisPlan
    synthesizer: FittedSynthesizer


@dataclass(frozen=True, slots=True, kw_only=True)
class EarlierFit:
    """A fit to go on from, and the name it goes by in the notes."""

    name: str
    fitted: FittedSynthesis


@dataclass(frozen=True, slots=True, kw_only=True)
class SynthesisResult:
    """p_SES, and what it took to get it.

    Attributes:
        environments: Each one can be crossed by the target robot, and no two are equal.
        method_asked: The synthesizer of the settings.
        method_used: The synthesizer that made them; another one where `notes` say so.
        drawn: Samples looked at.
        rejected_share: Share of them that the target robot cannot cross as they were drawn.
        repeated: Samples passed over because they equal one already taken.
        repaired: Environments in which cells were cleared so that it can.
        repaired_cells: Cells cleared in each of these, on average; 0 where there are none.
        beyond_repair: Samples passed over because more cells would have had to be cleared than
            the settings allow.
        copies: By environment, the scenario whose recorded place it equals cell by cell.
        notes: Where the result departs from what was asked, in words.
    """

    environments: NavigationDomain
    method_asked: str
    method_used: str
    drawn: int
    rejected_share: float
    repeated: int
    repaired: int
    repaired_cells: float
    beyond_repair: int
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


def is_training(settings: SynthesisSettings, *, available: int) -> bool:
    """Tell whether the fit to `available` environments is a training.

    A training can begin where an earlier one ended, and however many environments are wanted,
    it is the same.

    Raises:
        SynthesisError: There is nothing to learn from.
    """
    return isinstance(plan_synthesis(settings, available=available).synthesizer, LearnedSettings)


def fit_synthesis(
    domain: NavigationDomain,
    *,
    settings: SynthesisSettings,
    rng: Generator,
    progress: Callable[[float], None],
    start: EarlierFit | None = None,
) -> FittedSynthesis:
    """Fit the synthesizer that the settings and the size of the domain call for.

    Where `start` is of another synthesizer, the fit begins from nothing and is the same as
    without it. What was done is in the notes.

    Raises:
        SynthesisError: The domain is empty.
    """
    plan = plan_synthesis(settings, available=len(domain.environments))
    synthesizer = make_synthesizer(plan.synthesizer, environments=plan.environments)
    earlier, notes = None, plan.notes
    if start is not None and start.fitted.plan.synthesizer == plan.synthesizer:
        earlier = start.fitted.synthesizer
        notes = (*notes, f"went on from the earlier fit {start.name}")
    elif start is not None:
        notes = (*notes, f"began from nothing: the earlier fit {start.name} does not match")
    fitted = synthesizer.fit(domain, rng=rng, progress=progress, start=earlier)
    return FittedSynthesis(plan=replace(plan, notes=notes), synthesizer=fitted)


def draw_environments(
    fitted: FittedSynthesis,
    domain: NavigationDomain,
    *,
    settings: SynthesisSettings,
    target: RobotProfile,
    rng: Generator,
) -> SynthesisResult:
    """Draw until enough distinct environments can be crossed, or the attempts are used up.

    A sample that cannot be crossed is repaired or passed over (`SynthesisSettings.uncrossable`).
    Environments that equal one of the domain it was fitted to are counted and traced.
    """
    plan = fitted.plan
    if isinstance(plan.synthesizer, LearnedSettings):
        # It was perhaps fitted when another number was wanted.
        plan = replace(plan, environments=settings.environments)
    taking = Taking(settings=settings, count=plan.environments, radius=target.inscribed_radius_m)
    for samples in _samples(
        replace(fitted, plan=plan),
        attempts=settings.attempts,
        radius=target.inscribed_radius_m,
        rng=rng,
    ):
        taking.look_at(samples)
        if taking.is_complete:
            break
    recorded = {
        environment.cells.tobytes(): environment.scenario_id
        for environment in reversed(domain.environments)
    }
    method = plan.synthesizer.method
    environments = tuple(_environment(cells, method=method) for cells in taking.taken)
    return SynthesisResult(
        environments=NavigationDomain(environments),
        method_asked=settings.synthesizer.method,
        method_used=method,
        drawn=taking.drawn,
        rejected_share=(taking.drawn - taking.crossable) / taking.drawn,
        repeated=taking.repeated,
        repaired=len(taking.repairs),
        repaired_cells=sum(taking.repairs) / max(len(taking.repairs), 1),
        beyond_repair=taking.beyond_repair,
        copies={
            environment.environment_id: recorded[environment.cells.tobytes()]
            for environment in environments
            if environment.cells.tobytes() in recorded
        },
        notes=plan.notes if taking.is_complete else (*plan.notes, taking.shortage()),
    )


def _samples(
    fitted: FittedSynthesis, *, attempts: int, radius: float, rng: Generator
) -> Iterator[BoolArray]:
    """Draw as many samples at a time as environments are wanted, at most `attempts` times."""
    count = fitted.plan.environments
    if fitted.synthesizer.is_endless:
        for _ in range(attempts):
            yield fitted.synthesizer.sample(count, rng=rng, radius=radius)
        return
    cells = fitted.synthesizer.sample(count * attempts, rng=rng, radius=radius)
    for first in range(0, len(cells), count):
        yield cells[first : first + count]


def _environment(cells: BoolArray, *, method: str) -> NavigationEnvironment:
    """Name an environment by how it was made and by its cells."""
    return NavigationEnvironment(
        environment_id=digest_json([method, "", np.packbits(cells).tobytes().hex()])[:16],
        cells=cells,
        observed=np.ones_like(cells),
        origin=method,
    )
