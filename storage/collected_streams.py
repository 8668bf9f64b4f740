"""`CollectedStreams`: a bag's messages as decoded, before anything is cleaned."""

from collections import Counter
from dataclasses import dataclass, field

from storage.message_decoding import FramedTransform, Grid, Odometry, Scan

BASE_FRAMES = ("base_link", "base_footprint", "base")
"""What a robot's body is called where neither profile nor odometry says."""


@dataclass(slots=True)
class CollectedStreams:
    """Messages as decoded, in order of log time, with their stamps [ns]."""

    scans: list[tuple[int, Scan]] = field(default_factory=list)
    odometry: list[tuple[int, Odometry]] = field(default_factory=list)
    commands: list[tuple[int, tuple[float, float]]] = field(default_factory=list)
    poses: list[tuple[int, FramedTransform]] = field(default_factory=list)
    transforms: dict[tuple[str, str], list[tuple[int, FramedTransform]]] = field(
        default_factory=dict
    )
    static_edges: set[tuple[str, str]] = field(default_factory=set)
    map: Grid | None = None
    transform_messages: int = 0
    messages_in: int = 0
    warnings: Counter[str] = field(default_factory=Counter)

    def add_transform(self, stamp: int, transform: FramedTransform, *, is_static: bool) -> None:
        """Keep a transform with those between the same frames."""
        edge = (transform.frame, transform.child)
        self.transforms.setdefault(edge, []).append((stamp, transform))
        if is_static:
            self.static_edges.add(edge)
