"""Nights to show: a full one, one without training, one without any log."""

import numpy as np

from ses_core.evaluation.comparison import Comparison
from ses_core.evaluation.episodes import Episode
from ses_core.evaluation.label_agreement import agreement_by_group, label_agreement
from ses_core.evaluation.statistics import PolicySummary
from ses_core.extraction.funnel import FunnelStep
from ses_core.learning.training_curve import CurvePoint
from ses_core.robot_profile import JACKAL
from ses_core.scorecard.result import Measured, Scorecard
from ses_core.scorecard.rows import Aim, ScorecardRow
from storage.night_report import (
    Decision,
    DifficultyUse,
    EvaluationUse,
    Funnel,
    NightReport,
    RefusedLog,
    Sensitivity,
    ShownEnvironment,
    StageUse,
    SynthesisUse,
    TakenLog,
    TrainingUse,
)
from tests.ses_core.synthesis.places import rooms

STAGES = ("ingest", "extract", "filter", "synthesize", "render", "train", "evaluate", "report")


def full_night() -> NightReport:
    """A night with everything in it, a hostile log name included."""
    return NightReport(
        run_id="20261122-1f2e3d",
        batch_date="2026-11-22",
        robot=JACKAL,
        decision=Decision(
            verdict="insufficient evidence",
            reasons=("12 held-out worlds, at least 100 are needed.",),
        ),
        logs=(
            taken_log(name="<script>alert('log')</script>.bag", robot='jackal"7'),
            taken_log(name="second.mcap", warnings={"scan_dropout": 3, "pose_jump": 1}),
        ),
        refused=(
            RefusedLog(
                name="broken & cut.bag",
                reason="truncated",
                explanation="the file ends early or is damaged inside",
            ),
            RefusedLog(name="odd.bag", reason="bad_clock"),
        ),
        known_logs=4,
        waiting_logs=1,
        funnel=funnel(pool=64, synthesized=100),
        sensitivity=sensitivity(),
        recorded=environments(120, origin="c", counted=True, chosen=80),
        synthesis=SynthesisUse(
            method_asked="gan",
            method_used="pca",
            drawn=131,
            rejected_share=0.2366,
            repeated=2,
            copied=5,
            repaired=23,
            repaired_cells=4.25,
            beyond_repair=6,
            notes=("99 principal components instead of 100",),
        ),
        synthesized=environments(100, origin="s"),
        scorecard=scorecard(),
        difficulty=difficulty(),
        training=TrainingUse(
            policy="night-1f2e3d",
            parent="original",
            algorithm="ppo",
            decisions=12_400,
            environments=100,
            seconds=245.2,
            curve=tuple(curve_point(steps) for steps in range(1000, 13_000, 1000)),
        ),
        evaluation=EvaluationUse(
            rows=(
                policy_row("night-1f2e3d", 0.712),
                policy_row("original", 0.681),
                policy_row("dwa-slow", 0.0),
            ),
            comparisons=(
                Comparison(
                    policy="night-1f2e3d",
                    baseline="original",
                    success_difference=0.031,
                    ci=(-0.042, 0.109),
                    time_difference_s=-2.4,
                    ci_s=(-6.1, 1.2),
                    trials=240,
                    worlds=12,
                ),
            ),
            worlds=12,
            episodes=tuple(
                episode(policy, world)
                for policy in ("night-1f2e3d", "original", "dwa-slow")
                for world in range(12)
            ),
            remarks=("3 worlds repeated in PyBullet: 9 of 12 outcomes agree.",),
        ),
        stages=tuple(StageUse(name=name, built=1, found=2, seconds=71.3) for name in STAGES),
        lineage=(("pool", "selection/ab12"), ("policy", "train/cd34")),
        warnings=("1 robot gave 80 % of the pool.",),
        demonstration_decisions=12_400,
    )


def untrained_night() -> NightReport:
    """A night with logs and too few challenging scenarios."""
    return NightReport(
        run_id="20261123-aa",
        batch_date="2026-11-23",
        robot=JACKAL,
        decision=Decision(
            verdict="no training",
            reasons=("No scenario has more than 50 steps with v < 0.",),
        ),
        logs=(taken_log(name="only.bag"),),
        funnel=funnel(pool=0, synthesized=0),
        sensitivity=sensitivity(),
        champion="20261101-77",
        stages=tuple(StageUse(name=name, built=0, found=1, seconds=0.1) for name in STAGES),
    )


def quiet_night() -> NightReport:
    """A night on which no log came in."""
    return NightReport(
        run_id="20261124-bb",
        batch_date="2026-11-24",
        robot=JACKAL,
        decision=Decision(verdict="nothing new", reasons=("The inbox holds no new log.",)),
    )


def taken_log(
    *, name: str, robot: str = "jackal-7", warnings: dict[str, int] | None = None
) -> TakenLog:
    return TakenLog(
        name=name,
        robot=robot,
        site="home-3",
        format="rosbag2 mcap",
        duration_s=3725.0,
        path_length_m=812.4,
        scenarios=91,
        challenging=7,
        warnings=warnings or {},
    )


def funnel(*, pool: int, synthesized: int) -> Funnel:
    return Funnel(
        steps=(
            FunnelStep(name="logs", count=2),
            FunnelStep(name="scenarios", count=1240),
            FunnelStep(name="challenging", count=pool + 20, other=261),
            FunnelStep(name="to learn from", count=pool, other=160),
            FunnelStep(name="synthesized", count=synthesized),
        ),
        rule="more than 50 steps with v < 0",
        count_name="steps with v < 0",
        other_name="steps with v ≤ 0.05 m/s",
        remarks=("17: usable ones are held out for evaluation.",),
    )


def sensitivity() -> Sensitivity:
    thresholds = np.arange(0.0, 201.0)
    return Sensitivity(
        thresholds=thresholds,
        challenging={
            "steps with v < 0": (400 * np.exp(-thresholds / 30)).astype(np.int64),
            "steps with v ≤ 0.05 m/s": (900 * np.exp(-thresholds / 45)).astype(np.int64),
        },
        threshold=50.0,
        scenario_count=1240,
    )


def environments(
    count: int, *, origin: str, counted: bool = False, chosen: int | None = None
) -> tuple[ShownEnvironment, ...]:
    """Give environments; counted ones are recorded, in two homes, the first `chosen` chosen."""
    cells = rooms(count, seed=8)
    return tuple(
        ShownEnvironment(
            environment_id=f"{origin}{index:04d}",
            cells=place,
            observed=~np.rot90(place, 2),
            origin="scan" if counted else "pca",
            scenario_id=f"x{index:04d}" if counted else "",
            site=f"home-{index % 2}" if counted else "",
            robot="jackal-7" if counted else "",
            count=float(180 - index) if counted else None,
            is_traversable=index % 3 != 2 or not counted,
            is_chosen=chosen is None or index < chosen,
        )
        for index, place in enumerate(cells)
    )


def scorecard() -> Scorecard:
    """A scorecard of a row of each group, one without a value."""
    rng = np.random.default_rng(3)
    return Scorecard(
        rows=(
            score_row("traversable, raw", value=0.763, low=None, high=None),
            score_row("traversable, shipped", value=1.0, low=0.96, high=1.0),
            score_row("precision", value=0.412, low=0.38, high=0.45),
            score_row("copies", aim="low", value=0.02, low=0.0, high=0.05),
            score_row(
                "Wasserstein-1 visibility",
                unit="m",
                aim="low",
                value=None,
                note="too few: n=3 real and 9 synthesized",
            ),
            score_row("mean visibility", unit="m", aim="as real", value=0.65),
            score_row("mean time", unit="s", aim="as real", value=31.2, low=28.0, high=36.0),
        ),
        measures={
            "visibility": Measured(
                unit="m", real=rng.normal(2.0, 0.3, 40), synthesized=rng.normal(2.2, 0.3, 30)
            )
        },
    )


def difficulty() -> DifficultyUse:
    """Twelve places of two sites, the second one's counts in the wrong order."""
    logged = np.arange(60.0, 72.0)
    simulated = np.concatenate((np.arange(46.0, 52.0), np.arange(54.0, 48.0, -1.0)))
    sites = ["home-0"] * 6 + ["<b>home</b>"] * 6
    return DifficultyUse(
        driver="original",
        trials=3,
        count_name="steps with v < 0",
        logged=logged,
        simulated=simulated,
        threshold=50.0,
        whole=label_agreement(logged, simulated, threshold=50.0),
        sites=agreement_by_group(logged, simulated, sites, threshold=50.0),
        synthesized=100,
        synthesized_hard=0.25,
    )


def score_row(
    metric: str,
    *,
    unit: str = "share",
    aim: Aim = "high",
    value: float | None,
    low: float | None = None,
    high: float | None = None,
    real: tuple[float, float, float] | None = (0.55, 0.62, 0.70),
    note: str = "",
) -> ScorecardRow:
    """Make a row whose real-against-real value and interval are `real`: low, value, high."""
    return ScorecardRow(
        metric=metric,
        feature="cells (Hamming), k=5",
        unit=unit,
        aim=aim,
        value=value,
        low=low,
        high=high,
        real_value=real[1] if real else None,
        real_low=real[0] if real else None,
        real_high=real[2] if real else None,
        n_real=30,
        n_synthesized=30,
        halves="by site (6)",
        note=note,
    )


def policy_row(policy: str, success_rate: float) -> PolicySummary:
    succeeds = success_rate > 0.0
    return PolicySummary(
        policy=policy,
        success_rate=success_rate,
        success_ci=(success_rate, min(1.0, success_rate + 0.12)) if succeeds else None,
        mean_time_s=27.31 if succeeds else None,
        mean_time_ci_s=(25.0, 30.2) if succeeds else None,
        restricted_mean_time_s=48.4,
        restricted_mean_time_ci_s=(40.0, 55.5) if succeeds else None,
        collision_rate=0.2,
        timeout_rate=0.05,
        stuck_rate=0.038,
        barn_score=0.3121,
        barn_score_ci=None,
        trials=240,
        worlds=12,
    )


def curve_point(steps: int) -> CurvePoint:
    share = steps / 13_000
    return CurvePoint(
        steps=steps,
        episodes=40,
        mean_return=20.0 * share,
        success_rate=0.5 + 0.3 * share,
        collision_rate=0.3 - 0.1 * share,
        mean_time_s=30.0 - 4.0 * share,
    )


def episode(policy: str, world: int) -> Episode:
    outcome = "success" if (world + len(policy)) % 3 else "collision"
    return Episode(
        episode_id=f"{policy}-{world}",
        run_id="20261122-1f2e3d",
        policy=policy,
        world_id=f"world-{world}",
        pair=0,
        trial=0,
        seed=world,
        outcome=outcome,
        time_s=20.0 + world,
        path_length_m=8.0,
        optimal_time_s=4.0,
        barn_score=0.2,
        negative_velocity_count=3,
        not_forward_count=5,
        simulator="batch",
        start_x_m=1.0,
        start_y_m=1.5,
        start_yaw_rad=0.0,
        goal_x_m=8.0,
        goal_y_m=1.5,
    )
