"""An episode over time: commands with reversing shaded, and the planner parameters."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import SubFigure

from ses_core.evaluation.episode_trace import EpisodeTrace, stretches
from ses_core.learning.action import SEVEN
from ses_core.learning.policies import ParameterPolicy
from ses_core.pictures.figures import Theme, style_axes
from ses_core.planning.parameters import PARAMETER_UNITS

_STRIP = 0.72  # height of a parameter's strip; strips are 1 apart


def draw_timeline(figure: SubFigure, trace: EpisodeTrace, *, moment: float, theme: Theme) -> None:
    """Draw an episode over time, a line through the moment [s].

    Args:
        figure: Where to draw.
        trace: The whole episode.
        moment: Marked time since the start [s].
        theme: Colours.
    """
    speed, turn, parameters = figure.subplots(3, 1, sharex=True, height_ratios=(1.2, 1.0, 2.3))
    for axes in (speed, turn, parameters):
        _style(axes, trace, moment=moment, theme=theme)
    _draw_command(speed, trace, 0, "speed\n[m/s]", theme)
    _draw_command(turn, trace, 1, "turn rate\n[rad/s]", theme)
    _draw_parameters(parameters, trace, moment=moment, theme=theme)
    speed.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        borderaxespad=0.2,
        ncols=4,
        fontsize=8.5,
        frameon=False,
        labelcolor=theme.ink,
    )


def _draw_command(axes: Axes, trace: EpisodeTrace, column: int, label: str, theme: Theme) -> None:
    """Draw one component of the velocities, commanded and measured."""
    axes.axhline(0.0, color=theme.ink, linewidth=0.6)
    for values, color, name in (
        (trace.velocities, theme.series[5], "measured"),
        (trace.commands, theme.series[0], "commanded"),
    ):
        axes.plot(trace.times[1:], values[1:, column], color=color, linewidth=1.2, label=name)
    axes.set_ylabel(label, fontsize=9)


def _draw_parameters(axes: Axes, trace: EpisodeTrace, *, moment: float, theme: Theme) -> None:
    """Draw each planner parameter as a strip between its bounds, with its value at the moment."""
    axes.grid(visible=False, axis="y")
    now = int(np.searchsorted(trace.times, moment + 1e-6, side="right")) - 1
    policy = trace.drive.policy
    action = policy.action if isinstance(policy, ParameterPolicy) else SEVEN
    last = action.length - 1
    for number, values in enumerate((action.encode(trace.parameters).T + 1.0) / 2.0):
        base = last - number
        color = theme.series[number % len(theme.series)]
        axes.axhspan(base, base + _STRIP, color=theme.faint, alpha=0.35, linewidth=0)
        axes.fill_between(
            trace.times,
            base,
            base + _STRIP * values,
            step="post",
            color=color,
            alpha=0.3,
            linewidth=0,
        )
        axes.step(trace.times, base + _STRIP * values, where="post", color=color, linewidth=1.4)
        axes.annotate(
            _value(float(trace.parameters[now, action.places[number]])),
            (1.0, base + _STRIP / 2),
            xycoords=("axes fraction", "data"),
            xytext=(5, 0),
            textcoords="offset points",
            va="center",
            fontsize=8.5,
            color=theme.ink,
        )
    names = [
        f"{one.name}  {one.low:g} to {one.high:g} {PARAMETER_UNITS[one.name]}"
        for one in action.parameters
    ]
    axes.set_yticks([last - number + _STRIP / 2 for number in range(last + 1)], names, fontsize=8)
    axes.tick_params(axis="y", length=0)
    axes.set_ylim(-0.15, last + 1.0)
    axes.set_xlabel("time [s]", fontsize=9)


def _style(axes: Axes, trace: EpisodeTrace, *, moment: float, theme: Theme) -> None:
    """Shade where the robot reversed and mark the moment."""
    style_axes(axes, theme=theme)
    reversing = stretches(trace.is_reversing)
    for first, end in reversing:
        axes.axvspan(
            trace.times[first - 1],
            trace.times[end - 1],
            color=theme.series[1],
            alpha=0.28,
            linewidth=0,
            label="_" * (first > reversing[0][0]) + "reversing",
        )
    axes.axvline(
        moment, color=theme.ink, linewidth=1.2, linestyle=(0, (4, 2)), label=f"at {moment:.1f} s"
    )
    axes.set_xlim(0.0, float(trace.times[-1]))


def _value(value: float) -> str:
    return f"{value:.3g}"
