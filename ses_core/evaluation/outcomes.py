"""How an episode can end."""

from enum import IntEnum


class EpisodeOutcome(IntEnum):
    """Outcome of one trial; its lower-case name stands in tables."""

    RUNNING = 0
    SUCCESS = 1
    COLLISION = 2
    TIMEOUT = 3
    STUCK = 4
