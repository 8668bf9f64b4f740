import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import default_rng

from ses_core.arrays import BoolArray
from ses_core.occupancy import environment_cell_centres, from_drawing
from ses_core.robot_profile import JACKAL
from ses_core.synthesis.factory import make_synthesizer
from ses_core.synthesis.mirror import FittedMirror, four_courses
from ses_core.synthesis.traversability import traversable
from ses_core.synthesis_settings import MirrorSettings
from tests.ses_core.synthesis.places import domain_of, rooms, walled_off


def symmetric_room() -> BoolArray:
    cells = np.zeros((30, 30), dtype=np.bool_)
    cells[14:16] = True
    cells[:, 12:18] = False
    return cells


def lopsided_room() -> BoolArray:
    cells = symmetric_room()
    cells[2, 3] = True
    return cells


def draw_all(cells: BoolArray) -> BoolArray:
    return FittedMirror(cells=cells).sample(10_000, rng=default_rng(0))


def test_the_four_courses_of_a_drawn_place() -> None:
    drawings = """
        #..   ..#   ...   ...
        #..   ..#   ..#   #..
        ...   ...   ..#   #..
    """
    columns = [line.split() for line in drawings.strip().splitlines()]
    recorded, *others = (
        from_drawing("\n".join(line[number] for line in columns)) for number in range(4)
    )
    assert np.array_equal(four_courses(recorded[None]), np.stack((recorded, *others)))


def test_they_are_the_reflection_and_the_half_turn_in_metres() -> None:
    centres = environment_cell_centres()
    place = rooms(1, seed=6)[0]

    def points(cells: BoolArray) -> set[tuple[float, float]]:
        return {(round(x, 6), round(y, 6)) for x, y in centres[cells]}

    recorded, mirrored, turned, both = (points(cells) for cells in four_courses(place[None]))
    # The start is the origin, the goal lies at (5, 0): a half turn about the middle swaps them.
    assert mirrored == {(x, round(-y, 6)) for x, y in recorded}
    assert turned == {(round(5.0 - x, 6), round(-y, 6)) for x, y in recorded}
    assert both == {(round(5.0 - x, 6), y) for x, y in recorded}


def test_equal_courses_are_drawn_once() -> None:
    assert len(draw_all(symmetric_room()[None])) == 1
    place = lopsided_room()[None]
    assert len(draw_all(place)) == 4
    assert len(draw_all(np.concatenate((place, place, four_courses(place))))) == 4


@given(count=st.integers(1, 12), seed=st.integers(0, 99))
@settings(max_examples=20, deadline=None)
def test_all_different_courses_are_drawn_and_nothing_else(count: int, seed: int) -> None:
    cells = rooms(count, seed=seed)
    expected = {
        image.tobytes()
        for place in cells
        for image in (place, np.fliplr(place), np.rot90(place, 2), np.flipud(place))
    }
    drawn = draw_all(cells)
    assert len(drawn) == len(expected)
    assert {place.tobytes() for place in drawn} == expected
    few = FittedMirror(cells=cells).sample(3, rng=default_rng(0))
    assert few.shape == (min(3, len(expected)), 30, 30)


def test_every_course_is_as_likely_as_any_other() -> None:
    fitted = FittedMirror(cells=np.stack((lopsided_room(), symmetric_room(), lopsided_room())))
    rng = default_rng(1)
    hits: dict[bytes, int] = {}
    for _ in range(1000):
        key = fitted.sample(1, rng=rng)[0].tobytes()
        hits[key] = hits.get(key, 0) + 1
    # 5 cells of a multinomial, 1000 draws: mean 200, deviation 12.6; five deviations.
    assert len(hits) == 5
    assert all(abs(count - 200) < 63 for count in hits.values())


def test_what_can_be_crossed_can_be_crossed_in_all_four_courses() -> None:
    for cells, crossable in ((rooms(5), True), (walled_off(5), False)):
        courses = four_courses(cells)
        assert (traversable(courses, radius=JACKAL.inscribed_radius_m) == crossable).all()


def test_the_recorded_places_are_what_is_stored() -> None:
    cells = rooms(3)
    fitted = make_synthesizer(MirrorSettings(), environments=1).fit(
        domain_of(cells), rng=default_rng(0), progress=lambda _: None
    )
    assert np.array_equal(fitted.arrays()["cells"], cells)
