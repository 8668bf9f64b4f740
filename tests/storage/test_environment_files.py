from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ses_core.errors import ArtifactError
from ses_core.navigation import NavigationDomain, NavigationEnvironment
from ses_core.robot_profile import JACKAL
from storage.environment_files import read_environments, write_environments
from tests.ses_core.synthesis.places import rooms, walled_off


def synthesized() -> NavigationDomain:
    rng = np.random.default_rng(0)
    return NavigationDomain(
        tuple(
            NavigationEnvironment(
                environment_id=f"id{index}",
                cells=place,
                observed=rng.random((30, 30)) < 0.5,
                origin="gan",
            )
            for index, place in enumerate(np.concatenate((rooms(3), walled_off(1))))
        )
    )


def test_reading_gives_back_what_was_written_in_order(tmp_path: Path) -> None:
    domain = synthesized()
    write_environments(tmp_path, domain, target=JACKAL, run_id="n1")
    read = read_environments(tmp_path)
    for before, after in zip(domain.environments, read.environments, strict=True):
        assert (after.environment_id, after.origin, after.scenario_id) == (
            before.environment_id,
            "gan",
            "",
        )
        assert np.array_equal(after.cells, before.cells)
        assert np.array_equal(after.observed, before.observed)


def test_plain_pandas_sees_cells_goal_edge_first_and_difficulty(tmp_path: Path) -> None:
    domain = synthesized()
    table = pd.read_parquet(write_environments(tmp_path, domain, target=JACKAL, run_id="n1"))
    assert table["is_traversable"].tolist() == [True, True, True, False]
    assert table["tortuosity"].isna().tolist() == [False, False, False, True]
    assert np.array_equal(
        np.reshape(table["cells"][1], (30, 30)), domain.environments[1].cells.astype(np.uint8)
    )
    assert table["resolution_m"].tolist() == [5 / 30] * 4
    assert table["observed_fraction"][0] == domain.environments[0].observed.mean()
    assert set(table["run_id"]) == {"n1"}


def test_no_environments_are_an_empty_table(tmp_path: Path) -> None:
    write_environments(tmp_path, NavigationDomain(()), target=JACKAL)
    assert read_environments(tmp_path).environments == ()


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ArtifactError, match=r"environments\.parquet"):
        read_environments(tmp_path)
