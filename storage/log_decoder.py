"""One log, decoded in a limited process.

Whatever a log does to its decoder, it does to a child that is thrown away: the caller gets a
`Recording` or a `LogError` with a reason.
"""

from pathlib import Path

from ses_core.extraction.recording import RecordedMap, Recording
from ses_core.extraction.tabled_drives import TabledLog
from ses_core.recipes import JsonValue, settings_json
from ses_core.robot_profile import RobotProfile
from ses_core.settings import DecoderLimits
from storage.limited_process import decoded_in_child
from storage.log_formats import TABLES
from storage.recording_files import read_recorded_map, read_recording, read_tabled_log_back

DECODER_VERSION = 2
"""Raised whenever more logs, or the same logs better, are decoded: refused ones are tried again."""


def decode_log(
    log: Path,
    *,
    format: str,  # noqa: A002 - the contract's word
    profile: RobotProfile,
    pose_source: str,
    limits: DecoderLimits,
    workdir: Path,
) -> Recording:
    """Decode a spooled log in a child process.

    Args:
        log: Named by us, never by whoever uploaded it.
        format: One of `storage.log_formats`.
        profile: Profile of the robot that recorded it.
        pose_source: `odometry` or `map`.
        limits: What the child may use.
        workdir: Folder for the child's own folder, which is removed afterwards.

    Raises:
        LogError: The log cannot be used; the reason is from `storage.quarantine.REASONS`.
        ArtifactError: The machine failed, not the log.
    """
    request: dict[str, JsonValue] = {
        "wanted": "recording",
        "format": format,
        "profile": settings_json(profile),
        "pose_source": pose_source,
    }
    with decoded_in_child(log, request, limits=limits, workdir=workdir) as output:
        return read_recording(output, byte_limit=2 * limits.output_mib * 2**20)


def decode_tables(log: Path, *, limits: DecoderLimits, workdir: Path) -> TabledLog:
    """Read a spooled folder of tables in a child process; see `decode_log`."""
    request: dict[str, JsonValue] = {"wanted": "tables", "format": TABLES}
    with decoded_in_child(log, request, limits=limits, workdir=workdir) as output:
        return read_tabled_log_back(output, byte_limit=2 * limits.output_mib * 2**20)


def decode_map(
    log: Path,
    *,
    format: str,  # noqa: A002 - the contract's word
    limits: DecoderLimits,
    workdir: Path,
) -> RecordedMap:
    """Decode the latest map of a ROS log in a child process, and nothing else of it.

    Raises:
        LogError: The log cannot be used; `missing_topic`: it has no map.
        ArtifactError: The machine failed, not the log.
    """
    request: dict[str, JsonValue] = {"wanted": "map", "format": format}
    with decoded_in_child(log, request, limits=limits, workdir=workdir) as output:
        return read_recorded_map(output, byte_limit=2 * limits.output_mib * 2**20)
