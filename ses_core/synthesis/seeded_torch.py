"""Torch as a fit uses it: one thread, a seed of its own, and back to how it was."""

from collections.abc import Iterator
from contextlib import contextmanager

import torch


@contextmanager
def one_seeded_thread(seed: int) -> Iterator[None]:
    """Run torch on one thread from a seed, and put back what was there before.

    One thread makes equal seeds give equal weights, and is no slower on networks this small.
    """
    threads = torch.get_num_threads()
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        torch.set_num_threads(1)
        try:
            yield
        finally:
            torch.set_num_threads(threads)
