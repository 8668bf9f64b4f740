"""One file in one limited process: memory, time, sizes and privileges are capped.

Whatever a file does to its decoder, it does to a child that is thrown away.
"""

import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from ses_core.errors import ArtifactError, LogError
from ses_core.recipes import JsonValue, settings_json
from ses_core.settings import DecoderLimits
from storage.quarantine import REASONS

_OUTCOME_LIMIT = 2**16
_ERROR_LIMIT = 500
_KEPT_VARIABLES = ("LD_LIBRARY_PATH", "SYSTEMROOT")
_ENVIRONMENT = {
    "LANG": "C.UTF-8",
    # One thread each: a thread pool alone would take most of the address space allowed.
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    # Arrow's own pool reserves a gigabyte of addresses at once.
    "ARROW_DEFAULT_MEMORY_POOL": "system",
}


@contextmanager
def decoded_in_child(
    file: Path, request: Mapping[str, JsonValue], *, limits: DecoderLimits, workdir: Path
) -> Iterator[Path]:
    """Decode a file in a child process and give the folder of what it wrote, for a while.

    Args:
        file: Named by us, never by whoever uploaded it.
        request: What is wanted of it, for `storage.decoder_child`.
        limits: What the child may use.
        workdir: Folder for the child's own folder, which is removed afterwards.

    Raises:
        LogError: The file cannot be used; the reason is from `storage.quarantine.REASONS`.
        ArtifactError: The machine failed, not the file.
    """
    size = _size(file)
    if size > limits.log_mib * 2**20:
        raise LogError("size_limit", f"log has {size} bytes, expected at most {limits.log_mib} MiB")
    workdir.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=workdir, prefix="decode-") as folder:
        home = Path(folder)
        output, scratch = home / "output", home / "scratch"
        output.mkdir()
        scratch.mkdir()
        whole = {
            **request,
            "log": str(file.absolute()),
            "limits": settings_json(limits),
            "output": str(output.absolute()),
            "parent": os.getpid(),
        }
        (home / "request.json").write_text(json.dumps(whole), encoding="utf-8")
        _run(home.absolute(), scratch, limits)
        reason, message = _outcome(home / "outcome.json")
        if reason:
            raise LogError(reason, message)
        yield output


def _run(home: Path, scratch: Path, limits: DecoderLimits) -> None:
    """Run the child to its end, or to the end of its time.

    Raises:
        LogError: It was killed or died; an orderly refusal is not an error here.
    """
    environment = {**_ENVIRONMENT, "TMPDIR": str(scratch)}
    environment.update({name: os.environ[name] for name in _KEPT_VARIABLES if name in os.environ})
    with (home / "stderr").open("wb") as stderr:
        child = subprocess.Popen(
            [sys.executable, "-I", "-m", "storage.decoder_child", str(home / "request.json")],
            cwd=scratch,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=stderr,
            start_new_session=True,
        )
        try:
            status = child.wait(timeout=limits.wall_s)
        except subprocess.TimeoutExpired as error:
            raise LogError("time_limit", f"decoding took more than {limits.wall_s:g} s") from error
        finally:
            # The whole session goes, also when we are interrupted.
            if child.poll() is None:
                os.killpg(child.pid, signal.SIGKILL)
                child.wait()
    if status in (-signal.SIGXCPU, -signal.SIGKILL) and not (home / "outcome.json").exists():
        raise LogError("time_limit", f"decoding took more than {limits.cpu_s} s of processor time")
    if status != 0:
        errors = (home / "stderr").read_bytes()[-_ERROR_LIMIT:].decode("utf-8", errors="replace")
        last = errors.strip().splitlines()[-1:] or ["no message"]
        if "MemoryError" in last[0]:
            raise LogError("memory_limit", f"decoder ran out of memory: {last[0]}")
        raise LogError("decoder_bug", f"decoder ended with status {status}: {last[0]}")


def _outcome(path: Path) -> tuple[str, str]:
    """Read why the child refused the log; an empty reason where it did not."""
    try:
        if path.stat().st_size > _OUTCOME_LIMIT:
            raise ValueError("outcome is too long")
        outcome = json.loads(path.read_text(encoding="utf-8"))
        reason, message = str(outcome["reason"]), str(outcome["message"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise LogError("decoder_bug", f"decoder left no outcome: {error}") from error
    if reason and reason not in REASONS:
        raise LogError("decoder_bug", f"decoder gave the unknown reason {reason[:40]!r}")
    return reason, message


def _size(log: Path) -> int:
    try:
        files = list(log.iterdir()) if log.is_dir() else [log]
        return sum(path.stat().st_size for path in files)
    except OSError as error:
        raise ArtifactError(f"spooled log {log} cannot be read: {error}") from error
