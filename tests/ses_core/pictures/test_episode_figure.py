"""The picture of an episode: it shows what happened where, and what the robot made of it."""

import io
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb, to_rgba_array
from PIL import Image

from ses_core.evaluation.episode_trace import EpisodeMoment, EpisodeTrace, look_at
from ses_core.geometry import Pose2D, from_frame
from ses_core.navigation import World
from ses_core.occupancy import OccupancyGrid
from ses_core.pictures.episode_figure import episode_figure
from ses_core.pictures.episode_maps import draw_view, draw_world
from ses_core.pictures.episode_timeline import draw_timeline
from ses_core.pictures.figures import DARK, LIGHT, Theme, new_figure
from tests.ses_core.evaluation.traced import made_up
from tests.ses_core.pictures.pictured import draws, pixels

FORWARD, BACK = np.full(60, 0.4), np.full(10, -0.3)
REVERSING = np.r_[FORWARD, BACK, FORWARD, BACK[:4]]
REVERSING_ROWS = [(61, 71), (131, 135)]


def moment(pose: Pose2D = Pose2D(2.5, 1.5)) -> EpisodeMoment:  # noqa: B008  (frozen)
    """A robot that has marked one cell, 1 m in front of it."""
    costs = np.zeros((60, 140), dtype=np.float32)
    costs[30, 70] = 254.0
    costs[30, 66:70] = 253.0
    return EpisodeMoment(
        time=1.0,
        pose=pose,
        believed=pose,
        scan=np.array([[1.0, 0.0]]),
        costs=costs,
        origin=(0.0, 0.0),
        resolution=0.05,
        plan=np.array([[2.5, 1.5], [3.0, 2.5], [5.0, 1.5]]),
    )


def bands(axes: Axes) -> list[list[list[float]]]:
    """Give the ways that are marked as driven in reverse."""
    (found,) = [
        collection
        for collection in axes.collections
        if isinstance(collection, LineCollection)
        and np.allclose(to_rgba_array(collection.get_edgecolor())[0, :3], to_rgb(LIGHT.series[1]))
    ]
    return [np.asarray(way).tolist() for way in found.get_segments()]


@pytest.mark.parametrize("theme", [LIGHT, DARK])
def test_an_episode_is_drawn_with_all_that_the_robot_knew(theme: Theme) -> None:
    trace = made_up(REVERSING)
    png = episode_figure(trace, moment(), theme=theme)
    picture = pixels(png)

    assert draws(picture, theme.occupied) > 1000
    assert draws(picture, theme.unknown) > 1000
    assert draws(picture, theme.series[0]) > 200
    assert draws(picture, theme.series[3]) > 50
    assert png == episode_figure(trace, moment(), theme=theme)


def test_reversing_is_marked_on_both_maps_where_it_was_commanded_and_nowhere_else() -> None:
    trace = made_up(REVERSING)
    ways = [trace.poses[first - 1 : end, :2].tolist() for first, end in REVERSING_ROWS]
    world, view = new_figure(8.0, 4.0).subplots(1, 2)
    draw_world(world, trace, moment(), window=np.array([[0.0, 0.0], [7.0, 3.0]]), theme=LIGHT)
    draw_view(view, trace, moment(), theme=LIGHT)

    assert bands(world) == ways
    assert bands(view) == ways
    only_forward = new_figure(4.0, 4.0).subplots()
    draw_view(only_forward, made_up(FORWARD), moment(), theme=LIGHT)
    assert bands(only_forward) == []


def test_reversing_is_shaded_and_the_moment_marked_over_time() -> None:
    trace = made_up(REVERSING)
    (figure,) = new_figure(8.0, 4.0).subfigures(1, 1, squeeze=False)[0]
    draw_timeline(figure, trace, moment=1.0, theme=LIGHT)

    for axes in figure.axes[:2]:
        shaded = [
            patch.get_window_extent().transformed(axes.transData.inverted()).intervalx
            for patch in axes.patches
        ]
        expected = [(0.05 * (first - 1), 0.05 * (end - 1)) for first, end in REVERSING_ROWS]
        np.testing.assert_allclose(shaded, expected)
        assert [1.0, 1.0] in [np.asarray(line.get_xdata()).tolist() for line in axes.lines]


def test_costmap_and_plan_are_drawn_where_the_robot_is_and_not_where_it_thinks_it_is() -> None:
    lost = replace(moment(), believed=Pose2D(0.0, 0.0, 0.0), pose=Pose2D(2.5, 1.5, np.pi / 2))
    axes = new_figure(4.0, 4.0).subplots()
    draw_view(axes, made_up(FORWARD), lost, theme=LIGHT)

    (plan,) = [line for line in axes.lines if line.get_color() == LIGHT.series[0]]
    expected = from_frame(lost.plan, Pose2D(2.5, 1.5, np.pi / 2))
    np.testing.assert_allclose(np.column_stack(plan.get_data()), expected)
    costmap = axes.images[1].get_transform() - axes.transData
    np.testing.assert_allclose(costmap.transform([(1.0, 0.0)]), [(2.5, 2.5)], atol=1e-9)


def test_a_tall_world_stands_beside_the_rest_and_a_wide_one_above() -> None:
    trace = made_up(FORWARD)
    shapes = [_shape(episode_figure(one, moment())) for one in (_turned(trace), trace)]
    (tall_width, tall_height), (wide_width, wide_height) = shapes
    assert tall_width / tall_height < 1.2 < wide_width / wide_height


def _turned(trace: EpisodeTrace) -> EpisodeTrace:
    """Turn world and drive by a quarter."""
    place = trace.drive.trial.place
    grid = place.task.world.grid
    world = World(
        world_id="tall", grid=OccupancyGrid(cells=grid.cells.T, resolution=grid.resolution)
    )
    start, goal = place.task.start, place.task.goal
    task = replace(
        place.task,
        world=world,
        start=Pose2D(start.y, start.x, np.pi / 2),
        goal=(goal[1], goal[0]),
    )
    drive = replace(trace.drive, trial=replace(trace.drive.trial, place=replace(place, task=task)))
    return replace(trace, drive=drive, poses=trace.poses[:, [1, 0, 2]])


def _shape(png: bytes) -> tuple[int, int]:
    return Image.open(io.BytesIO(png)).size


def test_an_episode_of_one_tick_can_be_drawn() -> None:
    trace = made_up(np.array([0.4]), outcome="collision")
    assert episode_figure(trace, look_at(trace, 0.0)).startswith(b"\x89PNG")
