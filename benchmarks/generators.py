"""Every synthesizer, fitted to one set of houses and judged by others.

Reads stores that `ses ingest` and `ses extract` filled from a simulated fleet in the scanned
houses, in the folder `$SES_BENCH_STORES`: `fleet` (deployment and tuning houses) and `validation`;
docs/synthesis.md has the commands. All are fitted to the deployment houses. Choices are made by
the tuning houses; the validation houses judge once, where `$SES_BENCH_PART` is `validation`.

Scorecards, environments and contact sheets are kept beside the stores: what is there is not
computed again, so a broken run goes on.
"""

import json
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import date
from pathlib import Path

import numpy as np
import pandas as pd
from _shared_worlds import shared_path

from ses_core.extraction.selection import FilterFunnel, select_challenging
from ses_core.navigation import NavigationDomain, NavigationEnvironment
from ses_core.pictures.gallery import contact_sheet
from ses_core.recipes import JsonValue, digest_json, settings_json
from ses_core.robot_profile import JACKAL
from ses_core.scorecard.halving import coarsest_grouping
from ses_core.scorecard.result import Scorecard
from ses_core.scorecard.rows import ScorecardRow
from ses_core.scorecard.scorecard import Driver, score_environments
from ses_core.scorecard_settings import ScorecardSettings
from ses_core.settings import FilterSettings, SimulationSettings
from ses_core.synthesis.synthesize import draw_environments, fit_synthesis
from ses_core.synthesis_settings import (
    AutoregressiveSettings,
    GanPaperSettings,
    GanSettings,
    IdentitySettings,
    MedoidsSettings,
    MirrorSettings,
    PcaPaperSettings,
    PcaSettings,
    RandomSamplingSettings,
    SynthesisSettings,
    SynthesizerSettings,
)
from storage.environment_files import read_environments, write_environments
from storage.layout import Layout
from storage.policy_files import find_policy
from storage.scorecard_files import SCORECARD_FILE, read_scorecard, write_scorecard
from storage.selection_files import domain_digest
from storage.table_reader import open_table

FILTER = FilterSettings(
    count_kind="not-forward", heldout_share=0.0, per_robot_limit=100_000, window_days=36_500
)
"""What counts is what the authors' code counts; the parts hold no sites in common."""

SYNTHESIZERS: tuple[SynthesizerSettings, ...] = (
    GanPaperSettings(),
    PcaPaperSettings(),
    RandomSamplingSettings(),
    GanSettings(),
    PcaSettings(),
    MedoidsSettings(),
    AutoregressiveSettings(),
    IdentitySettings(),
    MirrorSettings(),
)
SCORING = ScorecardSettings()
SAMPLES = 1000
SEEDS = 3
SHOWN = 40
DRIVER = "dwa-slow"
COST_FILE = "cost.json"
RAW_SHARE = "raw traversable share"

Row = dict[str, str | float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Places:
    """Challenging environments of one part, their sites, and how many steps left how many."""

    part: str
    domain: NavigationDomain
    sites: list[str]
    funnel: FilterFunnel


def measure(scratch: Path) -> list[Row]:  # noqa: ARG001  (the harness's: results stay)
    """Give the funnels, then a row per metric and synthesizer: mean and range over seeds."""
    stores = Path(os.environ.get("SES_BENCH_STORES", "bench-stores"))
    part = os.environ.get("SES_BENCH_PART", "tuning")
    learned = read_places(stores / "fleet", "deployment")
    judge = read_places(stores / ("fleet" if part == "tuning" else part), part)
    rows = [_funnel_row(learned), _funnel_row(judge)]
    found: dict[str, list[ScoredRun]] = {}
    for settings, seed in _runs():
        run = scored_run(settings, seed, learned, judge, stores)
        found.setdefault(settings.method, []).append(run)
    return rows + _table(found)


def read_places(store: Path, part: str) -> Places:
    """Choose a store's challenging environments in the houses of a part, as a night would.

    Raises:
        SystemExit: There is no such store.
    """
    if not Layout(store).store_file.exists():
        raise SystemExit(f"{store} holds no store: see docs/synthesis.md, or set SES_BENCH_STORES")
    environments = open_table(store, "environments")
    split = pd.read_csv(shared_path("matterport", "split.csv")).set_index("house")["part"]
    scenarios = open_table(store, "scenarios")
    # A site has the name of its house and a digest of its map.
    houses = scenarios["site"].str.split("-").str[0]
    selection = select_challenging(
        scenarios[houses.map(split) == part],
        environments.drop(columns=["cells", "observed"]),
        settings=FILTER,
        last_batch=date.fromisoformat(str(scenarios["batch_date"].max())),
    )
    whole = environments.set_index("environment_id").loc[selection.pool["environment_id"]]
    columns = (whole[name].tolist() for name in ("cells", "observed", "origin", "scenario_id"))
    return Places(
        part=part,
        domain=NavigationDomain(
            tuple(
                NavigationEnvironment(
                    environment_id=identity,
                    cells=cells.astype(np.bool_),
                    observed=observed.astype(np.bool_),
                    origin=origin,
                    scenario_id=scenario,
                )
                for identity, cells, observed, origin, scenario in zip(
                    whole.index.tolist(), *columns, strict=True
                )
            )
        ),
        sites=selection.pool["site"].tolist(),
        funnel=selection.funnels[FILTER.count_kind],
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class ScoredRun:
    """One synthesizer under one seed: its scorecard, and what it cost."""

    rows: list[ScorecardRow]
    cost: dict[str, float]


def scored_run(
    synthesizer: SynthesizerSettings, seed: int, learned: Places, judge: Places, stores: Path
) -> ScoredRun:
    """Fit, draw and score; what was done before, under the same settings, is found."""
    settings = SynthesisSettings(synthesizer=synthesizer, environments=SAMPLES, seed=seed)
    key = digest_json([settings_json(settings), domain_digest(learned.domain)])
    name = f"{synthesizer.method}-{seed}-{key[:8]}"
    drawn = stores / "drawn" / name
    if not (drawn / COST_FILE).exists():
        drawn.mkdir(parents=True, exist_ok=True)
        cost = _draw(settings, learned, drawn)
        (drawn / COST_FILE).write_text(json.dumps(cost))
    cost = json.loads((drawn / COST_FILE).read_text())
    made = read_environments(drawn)
    judged_by: list[JsonValue] = [
        settings_json(SCORING),
        domain_digest(judge.domain),
        domain_digest(made),
    ]
    scored = stores / f"scored-{judge.part}" / f"{name}-{digest_json(judged_by)[:8]}"
    if not (scored / SCORECARD_FILE).exists():
        write_scorecard(scored, _score(made, cost, learned, judge).rows)
        print(f"{name}: scored by {judge.part}", flush=True)
    return ScoredRun(rows=read_scorecard(scored), cost=cost)


def _draw(settings: SynthesisSettings, learned: Places, into: Path) -> dict[str, float]:
    """Fit and draw, keep the environments and a contact sheet, give what it cost."""
    fit_rng, draw_rng = (np.random.default_rng([settings.seed, step]) for step in (0, 1))
    started = time.process_time()
    fitted = fit_synthesis(learned.domain, settings=settings, rng=fit_rng, progress=lambda _: None)
    fitted_at = time.process_time()
    result = draw_environments(
        fitted, learned.domain, settings=settings, target=JACKAL, rng=draw_rng
    )
    drawn_at = time.process_time()
    write_environments(into, result.environments, target=JACKAL)
    shown = result.environments.cells()[:SHOWN]
    title = f"{settings.synthesizer.method}, seed {settings.seed}"
    sheet = contact_sheet(shown, np.ones_like(shown), title=title)
    (into / "sheet.png").write_bytes(sheet)
    shipped = len(result.environments.environments)
    return {
        "environments": float(shipped),
        "fit [processor s]": fitted_at - started,
        "draw and repair [processor s]": drawn_at - fitted_at,
        RAW_SHARE: 1.0 - result.rejected_share,
        "repaired share": result.repaired / max(shipped, 1),
        "repaired cells": result.repaired_cells,
        "beyond repair": float(result.beyond_repair),
    }


def _score(
    made: NavigationDomain, cost: dict[str, float], learned: Places, judge: Places
) -> Scorecard:
    layout = Layout(Path(os.devnull))  # the driver is built in: no store is looked at
    return score_environments(
        judge.domain.cells(),
        made.cells(),
        coarsest_grouping(judge.sites, judge.sites, count=len(judge.sites)),
        settings=SCORING,
        target=JACKAL,
        driver=Driver(
            name=DRIVER,
            policy=find_policy(DRIVER, layout).policy,
            simulation=SimulationSettings(),
        ),
        training=learned.domain.cells(),
        raw_traversable=cost[RAW_SHARE],
    )


def _runs() -> Iterator[tuple[SynthesizerSettings, int]]:
    """Go through all synthesizers before the next seed: a broken run has something of each."""
    for seed in range(SEEDS):
        for settings in SYNTHESIZERS:
            yield settings, seed


def _funnel_row(places: Places) -> Row:
    funnel = places.funnel
    row: Row = {
        "what": f"funnel of {places.part}",
        "sites": len(set(places.sites)),
        "scenarios": funnel.scenarios,
        "challenging": funnel.challenging,
        "usable": funnel.pool,
    }
    return row | {f"rejected: {reason}": count for reason, count in funnel.rejected.items()}


def _table(found: dict[str, list[ScoredRun]]) -> list[Row]:
    """Give a row per metric and synthesizer: mean and range over seeds, beside the real one."""
    rows: list[Row] = []
    for method, runs in found.items():
        for name in runs[0].cost:
            rows.append({"what": name, "method": method, **_spread([r.cost[name] for r in runs])})
        for index, first in enumerate(runs[0].rows):
            values = [run.rows[index].value for run in runs]
            known = [value for value in values if value is not None]
            reals = [run.rows[index].real_value for run in runs]
            real = [value for value in reals if value is not None]
            rows.append(
                {
                    "what": first.metric,
                    "feature": first.feature,
                    "method": method,
                    **(_spread(known) if known else {}),
                    **({"real": float(np.mean(real))} if real else {}),
                }
            )
    return rows


def _spread(values: list[float]) -> Row:
    return {
        "mean": float(np.mean(values)),
        "least": float(np.min(values)),
        "most": float(np.max(values)),
    }
