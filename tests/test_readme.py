"""What the README promises stays true."""

import re
from pathlib import Path

from storage.quarantine import REASONS
from storage.settings_file import read_settings
from storage.table_schemas import TABLES

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")


def test_every_refusal_reason_is_explained_in_the_readme() -> None:
    rows = dict(re.findall(r"^\| `(\w+)` \| (.+) \|$", README, flags=re.MULTILINE))
    assert {name: rows.get(name) for name in REASONS} == dict(REASONS)


def test_every_table_is_named_in_the_readme() -> None:
    assert all(re.search(rf"\b{table}\b", README) for table in TABLES)


def test_the_settings_of_the_readme_are_accepted(tmp_path: Path) -> None:
    (block,) = re.findall(r"```toml\n(.*?)```", README, flags=re.DOTALL)
    file = tmp_path / "ses.toml"
    file.write_text(block, encoding="utf-8")
    settings = read_settings(file)
    assert settings.target_robot.name == "cleaner"
    assert settings.ingest.robots[0].profile in settings.ingest.profiles
