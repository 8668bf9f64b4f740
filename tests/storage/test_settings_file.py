from pathlib import Path

import pytest

from ses_core.errors import SettingsError
from ses_core.robot_profile import TURTLEBOT4
from ses_core.settings import Settings
from ses_core.synthesis_settings import PcaSettings
from storage.settings_file import parse_settings, read_settings


def problem(text: str, folder: Path) -> str:
    path = folder / "ses.toml"
    path.write_text(text)
    with pytest.raises(SettingsError) as caught:
        read_settings(path)
    message = str(caught.value)
    assert "\n" not in message
    assert str(path) in message
    return message.replace(f"{path}: ", "")


def test_what_a_file_leaves_out_has_its_default(tmp_path: Path) -> None:
    path = tmp_path / "ses.toml"
    path.write_text(
        """
        [filter]
        threshold = 30
        [synthesis.synthesizer]
        method = "pca"
        components = 20
        [[ingest.robots]]
        match = "*/neato*/*"
        profile = "neato"
        """
    )
    settings = read_settings(path)
    assert settings.filter.threshold == 30.0
    assert settings.synthesis.synthesizer == PcaSettings(components=20)
    assert settings.ingest.robots[0].profile == "neato"
    assert settings.training == Settings().training
    path.write_text("")
    assert read_settings(path) == Settings()


def test_the_target_robot_is_a_profile_or_the_name_of_one(tmp_path: Path) -> None:
    path = tmp_path / "ses.toml"
    path.write_text('target_robot = "turtlebot4"')
    assert read_settings(path).target_robot == TURTLEBOT4
    path.write_text(
        """
        target_robot = "cleaner"
        [ingest.profiles.cleaner]
        name = "cleaner"
        footprint_m = []
        radius_m = 0.25
        """
    )
    assert read_settings(path).target_robot.radius_m == 0.25
    path.write_text("[target_robot]\nname = 'odd'\nmax_speed_mps = 1.0")
    assert read_settings(path).target_robot.max_speed_mps == 1.0
    settings = parse_settings({"target_robot": "neato"}, source="test")
    assert Settings.model_validate(settings.model_dump(mode="json")) == settings


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            'target_robot = "robot9"',
            "setting 'target_robot': no robot profile has that name, expected jackal, turtlebot4, "
            "neato, raspimouse, generic (found 'robot9')",
        ),
        ("filter.treshold = 3", "unknown setting 'filter.treshold', expected 'threshold'"),
        ("filters.threshold = 3", "unknown setting 'filters', expected 'filter'"),
        (
            'synthesis.synthesizer = {method = "gan", epoch = 3}',
            "unknown setting 'synthesis.synthesizer.epoch', expected 'epochs'",
        ),
        (
            'ingest.robots = [{match = "x", profil = "neato"}]',
            "unknown setting 'ingest.robots.0.profil', expected 'profile' (and 1 more)",
        ),
        (
            "ingest.profiles.mine.radius = 0.2",
            "unknown setting 'ingest.profiles.mine.radius', expected 'radius_m'",
        ),
        (
            "ingest.limits.zzz = 1",
            "unknown setting 'ingest.limits.zzz', expected one of memory_mib, wall_s, cpu_s, "
            "log_mib, output_mib, message_mib",
        ),
        (
            "filter.threshold = -1",
            "setting 'filter.threshold': input should be greater than or equal to 0 (found -1)",
        ),
        (
            'training.algorithm = "dqn"',
            "setting 'training.algorithm': input should be 'ppo', 'td3' or 'sac' (found 'dqn')",
        ),
    ],
)
def test_what_cannot_be_used_is_one_line_with_key_and_help(
    tmp_path: Path, text: str, message: str
) -> None:
    assert problem(text, tmp_path) == message


def test_a_rule_across_settings_is_told_in_its_own_words(tmp_path: Path) -> None:
    message = problem("target_robot.radius_m = 0.2", tmp_path)
    assert "'target_robot': a robot has either a footprint" in message


def test_an_unknown_method_lists_the_known_ones(tmp_path: Path) -> None:
    message = problem('synthesis.synthesizer.method = "gam"', tmp_path)
    assert "'gam'" in message
    assert "'gan', 'pca-paper', 'pca', 'rs', 'medoids', 'identity', 'mirror'" in message


def test_a_file_that_is_no_toml_or_absent_is_named(tmp_path: Path) -> None:
    path = tmp_path / "ses.toml"
    path.write_text("filter = [")
    with pytest.raises(SettingsError, match=r"ses\.toml is no TOML"):
        read_settings(path)
    path.write_bytes(b"\xff\xff")
    with pytest.raises(SettingsError, match=r"ses\.toml is no TOML"):
        read_settings(path)
    with pytest.raises(SettingsError, match=r"absent\.toml cannot be read"):
        read_settings(tmp_path / "absent.toml")


def test_the_source_of_values_is_named(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match=r"^options: unknown setting 'speed'"):
        parse_settings({"speed": 3}, source="options")
