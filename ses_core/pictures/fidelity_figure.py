"""Two simulators side by side: where commands lead, and how the same trials went in both."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes

from ses_core.arrays import FloatArray
from ses_core.evaluation.episodes import Episode
from ses_core.pictures.figures import new_figure, png_bytes, style_axes


def fidelity_figure(
    errors: Mapping[str, FloatArray], batch: Sequence[Episode], bullet: Sequence[Episode]
) -> bytes:
    """Draw open-loop errors (K,) [m] by kind of drive, and times and counts of paired trials."""
    figure = new_figure(12.0, 4.0)
    drives, times, counts = figure.subplots(1, 3)
    for axes in (drives, times, counts):
        style_axes(axes)
    drives.boxplot(
        [100.0 * found for found in errors.values()], tick_labels=list(errors), whis=(0, 90)
    )
    drives.axhline(5.0, linestyle="--", color="grey", linewidth=1.0)
    drives.set_ylabel("apart after 2 s [cm]")
    drives.set_title("same commands (whiskers to the 90th percentile)", fontsize=9)
    both = [
        (one, other)
        for one, other in zip(batch, bullet, strict=True)
        if one.outcome == other.outcome == "success"
    ]
    for policy in dict.fromkeys(episode.policy for episode in batch):
        pairs = [(one.time_s, other.time_s) for one, other in both if one.policy == policy]
        if pairs:
            times.plot(*np.array(pairs).T, ".", label=policy, alpha=0.6)
    _diagonal(times)
    times.set_xlabel("time in the batch simulator [s]")
    times.set_ylabel("time in PyBullet [s]")
    times.set_title(f"{len(both)} trials that succeed in both", fontsize=9)
    times.legend(fontsize=8)
    counts.plot(
        [1 + one.negative_velocity_count for one in batch],
        [1 + other.negative_velocity_count for other in bullet],
        ".",
        alpha=0.4,
    )
    counts.set_xscale("log")
    counts.set_yscale("log")
    _diagonal(counts)
    counts.set_xlabel("1 + steps with v < 0, batch")
    counts.set_ylabel("1 + steps with v < 0, PyBullet")
    counts.set_title(f"all {len(batch)} trials", fontsize=9)
    return png_bytes(figure)


def _diagonal(axes: Axes) -> None:
    """Draw where both sides are equal, and make both axes alike."""
    low = min(axes.get_xlim()[0], axes.get_ylim()[0])
    high = max(axes.get_xlim()[1], axes.get_ylim()[1])
    axes.plot([low, high], [low, high], "--", color="grey", linewidth=1.0)
    axes.set_xlim(low, high)
    axes.set_ylim(low, high)
