"""Figures of an evaluation: rates with intervals, and success by world (leaf: matplotlib)."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from ses_core.evaluation.episodes import Episode
from ses_core.evaluation.statistics import Interval, PolicySummary
from ses_core.pictures.figures import LIGHT, Theme, new_figure, png_bytes, style_axes

_MOST_WORLDS = 60
"""More worlds than these are drawn without their names."""


def draw_evaluation(summaries: Sequence[PolicySummary], *, theme: Theme = LIGHT) -> bytes:
    """Draw success rate and restricted mean time of every policy with 95 % intervals, as PNG.

    Raises:
        ValueError: There is no policy.
    """
    if not summaries:
        raise ValueError("evaluation has 0 policies, expected at least 1")
    figure = new_figure(8.0, 1.2 + 0.4 * len(summaries), theme=theme)
    success, time = figure.subplots(1, 2, sharey=True)
    for axes in (success, time):
        style_axes(axes, theme=theme)
    _rows(
        success,
        [100.0 * summary.success_rate for summary in summaries],
        [_scaled(summary.success_ci, 100.0) for summary in summaries],
        theme=theme,
    )
    _rows(
        time,
        [summary.restricted_mean_time_s for summary in summaries],
        [summary.restricted_mean_time_ci_s for summary in summaries],
        theme=theme,
    )
    success.set_xlabel("success [%]")
    success.set_xlim(0.0, 100.0)
    time.set_xlabel("mean time, failures as 100 s [s]")
    time.set_xlim(0.0, 100.0)
    success.set_yticks(range(len(summaries)), [summary.policy for summary in summaries])
    success.set_ylim(len(summaries) - 0.5, -0.5)
    return png_bytes(figure)


def draw_worlds(episodes: Sequence[Episode], *, theme: Theme = LIGHT) -> bytes:
    """Draw the success rate in every world, one line per policy, hardest world first, as PNG.

    Worlds are ordered by the mean success of all policies.

    Raises:
        ValueError: There is no episode.
    """
    if not episodes:
        raise ValueError("evaluation has 0 episodes, expected at least 1")
    policies = list(dict.fromkeys(episode.policy for episode in episodes))
    worlds = list(dict.fromkeys(episode.world_id for episode in episodes))
    rates = np.full((len(policies), len(worlds)), np.nan)
    for row, policy in enumerate(policies):
        for column, world in enumerate(worlds):
            outcomes = [
                episode.outcome == "success"
                for episode in episodes
                if episode.policy == policy and episode.world_id == world
            ]
            if outcomes:
                rates[row, column] = 100.0 * np.mean(outcomes)
    order = np.argsort(np.nanmean(rates, axis=0), kind="stable")
    figure = new_figure(max(6.0, 1.5 + 0.14 * len(worlds)), 3.2, theme=theme)
    axes = figure.add_subplot()
    style_axes(axes, theme=theme)
    for row, policy in enumerate(policies):
        axes.plot(
            rates[row, order],
            marker="osD^vP"[row % 6],
            lw=0.8,
            ms=4,
            color=theme.series[row % len(theme.series)],
            label=policy,
            alpha=0.85,
        )
    axes.set_ylim(-3.0, 103.0)
    axes.set_ylabel("success [%]")
    axes.set_xlabel("held-out world, hardest first")
    if len(worlds) <= _MOST_WORLDS:
        axes.set_xticks(
            range(len(worlds)), [worlds[number] for number in order], rotation=90, fontsize=7
        )
    figure.legend(
        loc="outside upper left",
        frameon=False,
        fontsize=9,
        labelcolor=theme.ink,
        ncols=min(4, len(policies)),
    )
    return png_bytes(figure)


def _rows(
    axes: Axes, values: Sequence[float], intervals: Sequence[Interval | None], *, theme: Theme
) -> None:
    """Draw one point per row, with its interval where there is one."""
    for row, (value, interval) in enumerate(zip(values, intervals, strict=True)):
        color = theme.series[row % len(theme.series)]
        if interval is not None:
            axes.plot(interval, (row, row), color=color, lw=2.5, solid_capstyle="round")
        axes.plot(value, row, "o", color=color, ms=7)


def _scaled(interval: Interval | None, factor: float) -> Interval | None:
    return None if interval is None else (factor * interval[0], factor * interval[1])
