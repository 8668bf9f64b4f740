"""Where the shared logs, maps and worlds lie: tests that need them skip where they are absent."""

import os
from pathlib import Path

import pytest


def shared_data(*parts: str) -> Path:
    """Give a path below the shared data, or skip the calling test.

    The folder is `$SES_SHARED_DATA`, else `shared/data` beside the checkout.
    """
    beside = Path(__file__).parents[2] / "shared" / "data"
    path = Path(os.environ.get("SES_SHARED_DATA", beside)).joinpath(*parts)
    if not path.exists():
        pytest.skip(f"shared data not present: {'/'.join(parts)}")
    return path
