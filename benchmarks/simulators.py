"""What a control tick of the batch simulator costs, next to PyBullet and ir-sim in one run.

Ours is a whole tick: 720 beams, costmap, plan and the planner's default samples in a map that
knows nothing beforehand. Theirs is motion and a scan. The ratio of a row that compares
simulators is how many times faster ours is, that of the others is said in their name. Rounds
alternate between all sides, because other work on the machine comes and goes.
"""

import statistics
from pathlib import Path

from _batch_ticks import SENSING_HZ, BatchSide
from _kernel_costs import kernel_rows
from _peer_ticks import BulletSide, IrSimSide
from _simulated_tasks import barn_tasks, house_tasks

from ses_core.navigation import NavigationTask
from ses_core.robot_profile import JACKAL
from ses_core.settings import SimulationSettings

SEED = 9

Row = dict[str, str | float]


def measure(
    scratch: Path,
    *,
    worlds: int = 100,
    many: int = 1000,
    few: int = 10,
    houses: int = 5,
    ticks: int = 100,
    rounds: int = 5,
    peer_ticks: int = 20,
) -> list[Row]:
    """Measure in `worlds` places, and in `few`, in `many` and in houses for comparison."""
    tasks = barn_tasks(max(worlds, many), seed=SEED)
    return [
        *_against_peers(scratch, tasks[:worlds], ticks, rounds, peer_ticks),
        _two_threads(tasks[:worlds], ticks, rounds),
        _against_few(tasks[:many], few, ticks, rounds),
        _against_houses(tasks[:worlds], houses, ticks, rounds),
        *kernel_rows(tasks[:worlds], ticks=ticks, rounds=rounds),
    ]


def _against_peers(
    scratch: Path, tasks: list[NavigationTask], ticks: int, rounds: int, peer_ticks: int
) -> list[Row]:
    default_hz = SimulationSettings().sensing_rate_hz
    faithful = BatchSide(tasks, profile=JACKAL, sensing_hz=SENSING_HZ)
    default = BatchSide(tasks, profile=JACKAL, sensing_hz=default_hz)
    commands = faithful.commands(peer_ticks)
    bullet = BulletSide(tasks, commands, profile=JACKAL)
    ir_sim = IrSimSide(tasks, commands, profile=JACKAL, scratch=scratch)
    bullet.check()
    ours, ours_default, mesh, rectangles = [], [], [], []
    for _ in range(rounds):
        ours.append(faithful.cost(ticks).cpu)
        mesh.append(bullet.cost())
        ours_default.append(default.cost(ticks).cpu)
        # Python's own garbage apart, a step of ir-sim always costs the same.
        rectangles.append(ir_sim.cost(max(peer_ticks // 4, 1)))
    ir_sim.check()
    bullet.close()
    for side in (faithful, default):
        side.simulator.close()
    fast = statistics.median(ours)
    faster = statistics.median(ours_default)
    return [
        _row("batch-vs-pybullet-mesh", fast, statistics.median(mesh), unit="us/tick"),
        _row(
            f"batch-vs-pybullet-mesh, sensing at {default_hz:g} Hz",
            faster,
            statistics.median(mesh),
            unit="us/tick",
        ),
        _row("batch-vs-ir-sim", fast, statistics.median(rectangles), unit="us/tick"),
        _row(
            f"batch-vs-ir-sim, sensing at {default_hz:g} Hz",
            faster,
            statistics.median(rectangles),
            unit="us/tick",
        ),
    ]


def _two_threads(tasks: list[NavigationTask], ticks: int, rounds: int) -> Row:
    """Compare the best rounds: whoever else is on the machine can only take a core away."""
    one = BatchSide(tasks, profile=JACKAL, sensing_hz=SENSING_HZ)
    two = BatchSide(tasks, profile=JACKAL, sensing_hz=SENSING_HZ, threads=2)
    alone, together = [], []
    for _ in range(rounds):
        alone.append(one.cost(ticks).wall)
        together.append(two.cost(ticks).wall)
    one.simulator.close()
    two.simulator.close()
    return _row("two-threads-vs-one", min(together), min(alone), unit="us/tick of wall time")


def _against_few(tasks: list[NavigationTask], few: int, ticks: int, rounds: int) -> Row:
    """Compare the cost of a tick in many worlds with that in a tenth of them, `few` at a time."""
    many = BatchSide(tasks, profile=JACKAL, sensing_hz=SENSING_HZ)
    sample = tasks[: max(len(tasks) // 10, few)]
    groups = [
        BatchSide(sample[first : first + few], profile=JACKAL, sensing_hz=SENSING_HZ)
        for first in range(0, len(sample), few)
    ]
    large, small = [], []
    for _ in range(rounds):
        large.append(many.cost(ticks).cpu)
        small.append(statistics.mean(group.cost(ticks).cpu for group in groups))
    for side in (many, *groups):
        side.simulator.close()
    return _share(f"cost per world of {len(tasks)} worlds over {few}", large, small)


def _against_houses(tasks: list[NavigationTask], houses: int, ticks: int, rounds: int) -> Row:
    small = BatchSide(tasks, profile=JACKAL, sensing_hz=SENSING_HZ)
    large = BatchSide(
        house_tasks(houses, 4, seed=SEED, profile=JACKAL), profile=JACKAL, sensing_hz=SENSING_HZ
    )
    in_houses, in_places = [], []
    for _ in range(rounds):
        in_houses.append(large.cost(ticks).cpu)
        in_places.append(small.cost(ticks).cpu)
    small.simulator.close()
    large.simulator.close()
    return _share("houses of 30 x 40 m over places of 5 m", in_houses, in_places)


def _share(name: str, ours: list[float], theirs: list[float]) -> Row:
    """Make a row whose ratio is what the first costs over what the second costs."""
    first, second = statistics.median(ours), statistics.median(theirs)
    row = _row(name, first, second, unit="us/tick")
    return {**row, "ratio": round(first / second, 3)}


def _row(name: str, ours: float, theirs: float, *, unit: str) -> Row:
    return {
        "name": name,
        "unit": unit,
        "ours": round(ours, 2),
        "theirs": round(theirs, 2),
        "ratio": round(theirs / ours, 2),
    }
