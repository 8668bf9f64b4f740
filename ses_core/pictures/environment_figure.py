"""Picture of one environment: cells, what was seen, and the shortest way across."""

from ses_core.navigation import NavigationEnvironment
from ses_core.pictures.figures import LIGHT, Theme, new_figure, png_bytes
from ses_core.pictures.scenario_figure import draw_environment
from ses_core.robot_profile import RobotProfile


def environment_figure(
    environment: NavigationEnvironment, *, target: RobotProfile, theme: Theme = LIGHT
) -> bytes:
    """Draw an environment as PNG, the goal on top.

    Args:
        environment: The place.
        target: The robot whose shortest way is drawn, with its body half-way.
        theme: Colours.
    """
    figure = new_figure(5.2, 5.4, theme=theme)
    axes = figure.subplots()
    draw_environment(axes, environment, target=target, theme=theme)
    axes.set_title(
        f"{environment.environment_id[:16]} ({environment.origin})", fontsize=11, loc="left"
    )
    return png_bytes(figure)
