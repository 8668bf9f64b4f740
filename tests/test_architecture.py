"""The house: floors resolve inside this checkout, and light modules stay light."""

import importlib
import json
import subprocess
import sys
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).parents[1]
FLOORS = ("flows", "tasks", "storage", "ses_core")
HEAVY = ("torch", "stable_baselines3", "sklearn", "pybullet", "matplotlib")


@pytest.mark.parametrize("floor", FLOORS)
def test_a_floor_resolves_inside_this_checkout(floor: str) -> None:
    found = Path(str(importlib.import_module(floor).__file__))
    assert found.is_relative_to(CHECKOUT), f"another package named {floor!r} is in front: {found}"


@pytest.mark.parametrize("floor", FLOORS)
def test_every_folder_of_a_floor_is_a_regular_package(floor: str) -> None:
    folders = {source.parent for source in (CHECKOUT / floor).rglob("*.py")}
    assert not [str(folder) for folder in folders if not (folder / "__init__.py").exists()]


@pytest.mark.parametrize(
    "module",
    ["flows.command_line", "flows.nightly_batch", "ses_core.settings", "ses_core.protocols"],
)
def test_importing_a_light_module_imports_no_heavy_library(module: str) -> None:
    program = (
        f"import json, sys, {module}; "
        f"print(json.dumps([name for name in {HEAVY!r} if name in sys.modules]))"
    )
    answer = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=CHECKOUT
    )
    assert json.loads(answer.stdout.splitlines()[-1]) == []


def test_no_source_file_is_long_enough_to_hold_two_subjects() -> None:
    sources = [source for floor in FLOORS for source in (CHECKOUT / floor).rglob("*.py")]
    long = {
        str(source.relative_to(CHECKOUT)): lines
        for source in sources
        if (lines := len(source.read_text().splitlines())) > 400
    }
    assert not long


def test_the_dependencies_that_break_prefect_are_bounded() -> None:
    project = (CHECKOUT / "pyproject.toml").read_text()
    for bound in ('"prefect==3.8.8"', '"fastapi>=0.139,<0.151"', '"sqlalchemy>=2.0,<2.1"'):
        assert bound in project
