"""Policies on disk: bundles, learning curves, and the policies that have names."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from safetensors import SafetensorError
from safetensors.numpy import load as load_tensors
from safetensors.numpy import save as save_tensors

from ses_core.arrays import Float32Array
from ses_core.errors import ArtifactError
from ses_core.learning.policies import FIXED_POLICIES, ParameterPolicy
from ses_core.learning.policy_bundle import (
    BUNDLE_FILES,
    JSON_FILE,
    Lineage,
    PolicyBundle,
    pack_bundle,
    unpack_bundle,
)
from ses_core.learning.reward import RewardSpec
from ses_core.learning.training_curve import CurvePoint
from ses_core.protocols import Policy
from ses_core.robot_profile import RobotProfile
from ses_core.settings import SimulationSettings
from storage.layout import Layout
from storage.policy_registry import PolicyRegistry
from storage.stages import TRAIN

ORIGINAL_FOLDER = Path(__file__).parent / "shipped" / "original"
"""The shipped original policy: what `ses pretrain` makes with its defaults."""

CURVE_FILE = "curve.json"
CRITIC_FILE = "critic.safetensors"


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedPolicy:
    """A policy under the name somebody asked for.

    Attributes:
        policy_id: Digest of a learned policy; the name of a fixed one.
        bundle: What was read; None for fixed parameters.
        folder: Where from; None for fixed parameters.
    """

    name: str
    policy_id: str
    policy: Policy
    bundle: PolicyBundle | None
    folder: Path | None = None


def write_policy(
    directory: Path,
    policy: ParameterPolicy,
    *,
    lineage: Lineage,
    profile: RobotProfile,
    simulation: SimulationSettings,
    reward: RewardSpec,
) -> None:
    """Write a bundle into a folder, which is made if it is missing."""
    directory.mkdir(parents=True, exist_ok=True)
    files = pack_bundle(
        policy, lineage=lineage, profile=profile, simulation=simulation, reward=reward
    )
    for name, content in files.items():
        (directory / name).write_bytes(content)


def read_policy(directory: Path) -> PolicyBundle:
    """Read a bundle back, checked against its digests.

    Raises:
        ArtifactError: It is missing, incomplete or damaged.
    """
    found = [directory / name for name in BUNDLE_FILES if (directory / name).is_file()]
    return unpack_bundle({file.name: file.read_bytes() for file in found}, source=str(directory))


def write_curve(directory: Path, curve: Sequence[CurvePoint]) -> None:
    """Write a learning curve beside its bundle."""
    points = [asdict(point) for point in curve]
    (directory / CURVE_FILE).write_text(json.dumps(points, indent=1, allow_nan=False) + "\n")


def read_curve(directory: Path) -> list[CurvePoint]:
    """Read a bundle's learning curve; empty where none was written.

    Raises:
        ArtifactError: It cannot be read.
    """
    file = directory / CURVE_FILE
    if not file.is_file():
        return []
    try:
        return [CurvePoint(**point) for point in json.loads(file.read_text())]
    except (ValueError, TypeError) as error:
        raise ArtifactError(f"learning curve {file} cannot be read: {error}") from error


def write_critic(directory: Path, critic: Mapping[str, Float32Array]) -> None:
    """Write a critic's tensors beside its bundle; a robot needs none."""
    (directory / CRITIC_FILE).write_bytes(save_tensors(dict(critic)))


def read_critic(directory: Path) -> dict[str, Float32Array] | None:
    """Read the critic beside a bundle; None where none was kept.

    Raises:
        ArtifactError: It is damaged.
    """
    file = directory / CRITIC_FILE
    if not file.is_file():
        return None
    try:
        return load_tensors(file.read_bytes())
    except SafetensorError as error:
        raise ArtifactError(f"critic {file} cannot be read: {error}") from error


def find_policy(name: str, layout: Layout | None) -> NamedPolicy:
    """Find a policy by the name people give it.

    Args:
        name: `dwa-slow`, `dwa-fast`, `original`, `champion` (the original until one is promoted),
            the folder of a bundle, the id of a policy, or the id of the run that trained it.
        layout: The store in which champions and runs are looked for; None without one.

    Raises:
        ArtifactError: Nothing has that name, or its bundle cannot be read.
    """
    if name in FIXED_POLICIES:
        return NamedPolicy(name=name, policy_id=name, policy=FIXED_POLICIES[name], bundle=None)
    folder = _bundle_folder(name, layout)
    bundle = read_policy(folder)
    return NamedPolicy(
        name=name, policy_id=bundle.policy_id, policy=bundle.policy, bundle=bundle, folder=folder
    )


def _bundle_folder(name: str, layout: Layout | None) -> Path:
    if name == "original":
        return ORIGINAL_FOLDER
    if name == "champion":
        return _champion_folder(layout)
    if (Path(name) / JSON_FILE).is_file():
        return Path(name)
    for folder in _trained(layout):
        bundle = read_policy(folder)
        if name in {bundle.policy_id, bundle.lineage.run_id}:
            return folder
    raise ArtifactError(
        f"found no policy {name!r}, expected champion, original, {', '.join(FIXED_POLICIES)}, "
        "a run's id, a policy's id or the folder of a bundle"
    )


def _champion_folder(layout: Layout | None) -> Path:
    champion = PolicyRegistry(layout).champion() if layout else None
    if layout is None or champion is None or champion.policy is None:
        return ORIGINAL_FOLDER
    return layout.object_folder(champion.policy)


def _trained(layout: Layout | None) -> list[Path]:
    """Folders of all policies trained in a store, newest first."""
    folder = layout.objects / TRAIN.name if layout else None
    if folder is None or not folder.is_dir():
        return []
    found = [bundle.parent for bundle in folder.glob(f"*/{JSON_FILE}")]
    return sorted(found, key=lambda path: path.stat().st_mtime, reverse=True)
