"""`compiled`: numba's nopython mode with the project's options and a cache that cannot go stale.

numba keys a cached function by its own file only, so a change in a function that it *calls*
in another file would be missed. The cache folder therefore carries a digest of every
compiled module: one changed, all compiled again.
"""

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar, cast

import numba
from numba import config

Function = TypeVar("Function", bound=Callable[..., object])

_PACKAGE = Path(__file__).parent


def _digest_of_compiled_modules() -> str:
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(_PACKAGE.rglob("*.py")):
        text = source.read_bytes()
        if b"ses_core.compilation" in text:
            digest.update(text)
    return digest.hexdigest()[:16]


if not getattr(config, "CACHE_DIR", ""):
    setattr(  # noqa: B010  (numba builds this module at run time: mypy knows no names in it)
        config,
        "CACHE_DIR",
        str(_PACKAGE / "__pycache__" / f"compiled-{_digest_of_compiled_modules()}"),
    )


def compiled(function: Function) -> Function:
    """Compile a kernel that releases the interpreter lock and keeps IEEE arithmetic."""
    return cast("Function", numba.njit(cache=True, nogil=True, error_model="numpy")(function))


def compiled_in_place(function: Function) -> Function:
    """Compile a kernel that works in the arrays it is given and allocates none.

    Such a kernel need not count references to arrays. numba counts them with atomic additions at
    every call and view, which took half the local planner's time and a third of its compilation.
    An allocation, also one hidden in `ravel` or in an assignment between slices, is refused when
    the kernel is compiled.
    """
    # numba's type hints leave out what it has no documentation for.
    in_place = numba.njit(  # type: ignore[call-overload]
        cache=True, nogil=True, error_model="numpy", _nrt=False
    )
    return cast("Function", in_place(function))


def compiled_parallel(function: Function) -> Function:
    """Compile a kernel whose `numba.prange` loops run on all threads."""
    return cast(
        "Function", numba.njit(cache=True, nogil=True, parallel=True, error_model="numpy")(function)
    )
