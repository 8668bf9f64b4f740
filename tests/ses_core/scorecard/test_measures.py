import numpy as np
from scipy.stats import wasserstein_distance

from ses_core.extraction.difficulty import measure_difficulty
from ses_core.robot_profile import JACKAL
from ses_core.scorecard.measure_rows import distance_of
from ses_core.scorecard.measures import path_measures, shape_measures
from tests.ses_core.scorecard.samples import all_of, pillars
from tests.ses_core.synthesis.places import walled_off


def test_speckle_is_counted_and_its_outline_measured() -> None:
    cells = np.zeros((1, 30, 30), dtype=np.bool_)
    cells[0, 4:6, 4:8] = True
    cells[0, 6, 8] = True  # Touches the block's corner: one obstacle with it.
    cells[0, 20, 20] = True
    found = shape_measures(cells)
    assert found["components"].tolist() == [2.0]
    assert np.isclose(found["occupancy"][0], 10 / 900)
    assert np.isclose(found["perimeter"][0], (12 + 4 + 4) * 5 / 30)


def test_path_measures_are_those_of_extraction_and_unknown_where_none_crosses() -> None:
    cells = np.concatenate((pillars(2, seed=0), walled_off(1)))
    found = path_measures(cells, radius=JACKAL.inscribed_radius_m)
    expected = measure_difficulty(cells[1], radius=JACKAL.inscribed_radius_m)
    assert expected is not None
    assert found["visibility"][1] == expected.visibility
    assert found["tortuosity"][1] == expected.tortuosity
    assert np.isclose(found["path length"][1], 5.0 * expected.tortuosity)
    assert all(np.isnan(values[2]) for values in found.values())


def test_the_distance_is_scipys_of_what_is_known() -> None:
    values = np.random.default_rng(0).normal(size=20)
    values[3] = np.nan
    found = distance_of(values, all_of(10), all_of(10, 10))
    assert found == wasserstein_distance(np.delete(values[:10], 3), values[10:])
    assert distance_of(values, all_of(10), all_of(4, 10)) is None
    assert distance_of(values, all_of(5), all_of(10, 10)) is None
