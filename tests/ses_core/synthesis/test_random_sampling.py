import numpy as np
from numpy.random import default_rng

from ses_core.synthesis.random_sampling import FittedRandomSampling
from tests.ses_core.synthesis.places import rooms, walled_off


def test_no_environment_is_drawn_twice_and_none_is_left_out() -> None:
    places = walled_off(50)
    drawn = FittedRandomSampling(cells=places).sample(500, rng=default_rng(0))
    assert len(drawn) == 50
    assert {place.tobytes() for place in drawn} == {place.tobytes() for place in places}


def test_every_environment_is_as_likely_as_any_other() -> None:
    places = rooms(8, seed=2)
    numbers = {place.tobytes(): number for number, place in enumerate(places)}
    assert len(numbers) == 8
    rng = default_rng(1)
    fitted = FittedRandomSampling(cells=places)
    hits = np.zeros(8)
    for _ in range(2000):
        hits[numbers[fitted.sample(1, rng=rng)[0].tobytes()]] += 1
    # 8 cells of a multinomial, 2000 draws: mean 250, deviation 14.8; five deviations.
    assert np.all(np.abs(hits - 250) < 74)
