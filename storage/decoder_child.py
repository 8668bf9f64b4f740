"""The limited process: reads one log or mesh, writes plain arrays, and can do nothing else.

Run by `storage.limited_process` as `python -m storage.decoder_child REQUEST.json` with an empty
environment, in a folder and a session of its own. It never runs with `-O`: some of rosbags'
guards are assertions.
"""

import ctypes
import json
import os
import resource
import signal
import sys
from collections.abc import Mapping
from pathlib import Path

_PR_SET_PDEATHSIG = 1
_PR_SET_NO_NEW_PRIVS = 38
_OPEN_FILES = 64
_MESSAGE_LIMIT = 500


def main() -> int:
    """Decode as the request says; the outcome is `outcome.json` beside it."""
    request_path = Path(sys.argv[1])
    request = json.loads(request_path.read_text(encoding="utf-8"))
    _confine(request["limits"], parent=int(request["parent"]))
    outcome = decode_request(request, scratch=Path.cwd())
    (request_path.parent / "outcome.json").write_text(json.dumps(outcome), encoding="utf-8")
    return 0


def _confine(limits: dict[str, int], *, parent: int) -> None:
    """Give up memory, time, files, privileges, and life after the parent's death."""
    libc = ctypes.CDLL(None, use_errno=True)
    libc.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    libc.prctl(_PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0)
    if os.getppid() != parent:
        os._exit(1)
    for kind, value in (
        (resource.RLIMIT_AS, limits["memory_mib"] * 2**20),
        (resource.RLIMIT_CPU, limits["cpu_s"]),
        (resource.RLIMIT_FSIZE, limits["output_mib"] * 2**20),
        (resource.RLIMIT_NOFILE, _OPEN_FILES),
        (resource.RLIMIT_CORE, 0),
    ):
        _, hard = resource.getrlimit(kind)
        allowed = value if hard == resource.RLIM_INFINITY else min(value, hard)
        resource.setrlimit(kind, (allowed, allowed))


def decode_request(request: Mapping[str, object], *, scratch: Path) -> dict[str, str]:
    """Decode the file and say how it went: the reason is empty where it went well."""
    # Imported under the limits, so that what they need counts too.
    from ses_core.errors import LogError

    try:
        _decode(request, scratch)
    except LogError as error:
        return {"reason": error.reason, "message": str(error)[:_MESSAGE_LIMIT]}
    except (MemoryError, RecursionError, OSError) as error:
        return {"reason": _resource_reason(error), "message": _describe(error)}
    except Exception as error:  # noqa: BLE001 - 13 kinds of errors come out of damaged bags
        return {"reason": _damage_reason(error), "message": _describe(error)}
    return {"reason": "", "message": ""}


def _decode(request: Mapping[str, object], scratch: Path) -> None:
    """Write what is wanted of the file: its recording, its drives, its map, or its triangles."""
    from ses_core.robot_profile import RobotProfile
    from ses_core.settings import DecoderLimits

    limits = DecoderLimits.model_validate(request["limits"])
    file, output, kind = Path(str(request["log"])), Path(str(request["output"])), request["format"]
    if request["wanted"] == "triangles":
        from storage.mesh_triangles import decode_triangles

        decode_triangles(file, output, format=str(kind))
    elif request["wanted"] == "map":
        from storage.recording_files import write_recorded_map
        from storage.rosbag_logs import read_recorded_map

        write_recorded_map(output, read_recorded_map(file, limits=limits, workdir=scratch))
    elif request["wanted"] == "tables":
        # Arrow takes a moment to import, which a bag need not wait for.
        from storage.recording_files import write_tabled_log
        from storage.tabled_logs import read_tabled_log

        write_tabled_log(output, read_tabled_log(file, limits=limits))
    else:
        from storage.log_formats import make_reader
        from storage.recording_files import write_recording

        profile = RobotProfile.model_validate(request["profile"])
        reader = make_reader(str(kind), limits=limits, workdir=scratch)
        pose_source = str(request["pose_source"])
        write_recording(output, reader.read(file, profile=profile, pose_source=pose_source))


def _resource_reason(error: BaseException) -> str:
    if isinstance(error, MemoryError):
        return "memory_limit"
    return "unsupported" if isinstance(error, RecursionError) else "truncated"


def _damage_reason(error: Exception) -> str:
    """Give the reason for what rosbags and its libraries raise on files that are not whole."""
    text = str(error).lower()
    if "magic" in text and "end magic" not in text:
        return "bad_magic"
    if "checksum" in text:
        return "checksum"
    if type(error).__name__ == "NoMemError":
        return "memory_limit"
    if any(word in text for word in ("not supported", "unsupported", "profile")):
        return "unsupported"
    return "truncated"


def _describe(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}"[:_MESSAGE_LIMIT]


if __name__ == "__main__":
    sys.exit(main())
