"""`TrainingRecord`: what a training was, kept beside its bundle."""

from dataclasses import dataclass

TRAINING_FILE = "training.json"


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainingRecord:
    """How a policy was trained.

    Attributes:
        seconds: Wall time [s].
        ended: Why it ended: all decisions made, the deadline, or divergence.
        parent: Name of the policy it went on from; empty for random weights.
        parent_id: Its identity.
    """

    algorithm: str
    steps: int
    seed: int
    environments: int
    seconds: float
    ended: str
    parent: str
    parent_id: str
    created_stamp_ns: int
