"""Logs that come as tables are trusted as little as bags."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from ses_core.errors import LogError
from ses_core.settings import DecoderLimits
from storage.bounded_parquet import read_bounded
from storage.log_catalogue import catalogue
from storage.log_formats import LOGS_FILE, MAP_FILE, SCANS_FILE, TRAJECTORIES_FILE
from storage.quarantine import Quarantine
from storage.tabled_logs import read_tabled_log
from tests.storage.tabled_fleet import Night, log_in, one_log, read, write_fleet


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    inbox = tmp_path_factory.mktemp("fleet")
    write_fleet(inbox, "tables", publishes_map=True)
    return inbox


Change = Callable[[dict[str, np.ndarray[Any, Any]]], None]


def rewrite(path: Path, change: Change) -> None:
    """Change columns of a file and write it as one of the same table."""
    table = pq.read_table(path)
    columns = {
        name: table[name].combine_chunks()
        if pa.types.is_list(table.schema.field(name).type)
        else np.array(table[name].to_numpy(zero_copy_only=False))
        for name in table.column_names
    }
    change(columns)
    arrays = [pa.array(columns[field.name], type=field.type) for field in table.schema]
    pq.write_table(pa.Table.from_arrays(arrays, schema=table.schema), path)


def cell(name: str, row: int, value: object) -> Change:
    def change(columns: dict[str, np.ndarray[Any, Any]]) -> None:
        columns[name][row] = value

    return change


def ragged(columns: dict[str, Any]) -> None:
    lists = columns["ranges_m"].to_pylist()
    lists[3] = lists[3][:-1]
    columns["ranges_m"] = lists


def shifted(columns: dict[str, Any]) -> None:
    columns["stamp_ns"][10:] += 1


def wrapped(columns: dict[str, Any]) -> None:
    """Stamps whose differences wrap around to positive numbers."""
    columns["stamp_ns"] = columns["stamp_ns"].copy()
    columns["stamp_ns"][:5] = [0, 8 * 10**18, -9 * 10**18, -8 * 10**18, -(10**18)]


def doubled(columns: dict[str, Any]) -> None:
    for name, values in columns.items():
        columns[name] = np.concatenate((values, values))


BROKEN: dict[str, tuple[str, Change, str, str]] = {
    "a pose that is no number": (
        TRAJECTORIES_FILE,
        cell("x_m", 7, np.nan),
        "bad_values",
        "1 of ",
    ),
    "a pose out of reach": (TRAJECTORIES_FILE, cell("y_m", 7, 1e30), "bad_values", "out of reach"),
    "a jump": (TRAJECTORIES_FILE, cell("x_m", 7, 900.0), "bad_values", "m long"),
    "another clock": (TRAJECTORIES_FILE, shifted, "bad_clock", "0.05 s apart"),
    "time running back": (TRAJECTORIES_FILE, cell("stamp_ns", 7, 5), "bad_clock", "ascend"),
    "stamps that wrap around": (TRAJECTORIES_FILE, wrapped, "bad_clock", "ascend"),
    "stamps of scans that wrap around": (SCANS_FILE, wrapped, "bad_clock", "of the scans"),
    "a scan before 1970": (SCANS_FILE, cell("stamp_ns", 0, -1), "bad_clock", "of the scans"),
    "a scan after 2100": (SCANS_FILE, cell("stamp_ns", -1, 5 * 10**18), "bad_clock", "scans"),
    "a step beyond counting": (TRAJECTORIES_FILE, cell("step", -1, 2**62), "schema_conflict", "0"),
    "a step twice": (TRAJECTORIES_FILE, cell("step", 7, 6), "schema_conflict", "ascend"),
    "a step before the first": (TRAJECTORIES_FILE, cell("step", 0, -1), "schema_conflict", "asc"),
    "a scan pose that is no number": (
        SCANS_FILE,
        cell("body_x_m", 2, np.inf),
        "bad_values",
        "1 of",
    ),
    "two lasers": (SCANS_FILE, cell("mount_x_m", 2, 0.3), "schema_conflict", "one laser"),
    "a laser that reaches nowhere": (
        SCANS_FILE,
        lambda columns: columns["range_max_m"].fill(-1.0),
        "bad_values",
        "laser reaches",
    ),
    "uneven scans": (SCANS_FILE, ragged, "schema_conflict", "numbers of readings"),
    "more messages used than there were": (
        LOGS_FILE,
        cell("messages_used", 0, 10**9),
        "schema_conflict",
        "cannot have been used",
    ),
    "warnings that are no counts": (
        LOGS_FILE,
        cell("warnings", 0, json.dumps({"gap": "many"})),
        "schema_conflict",
        "no counts",
    ),
    "two logs in one": (LOGS_FILE, doubled, "schema_conflict", "2 rows"),
    "no clock": (LOGS_FILE, cell("has_clock", 0, False), "bad_clock", "without a clock"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_tables_with_something_wrong_are_refused_for_it(
    tmp_path: Path, fleet: Path, name: str
) -> None:
    file, change, reason, message = BROKEN[name]
    log = log_in(one_log(tmp_path, fleet))
    rewrite(log / file, change)
    with pytest.raises(LogError, match=message) as error:
        read(log)
    assert error.value.reason == reason


def bit_flip(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 3] ^= 4
    path.write_bytes(content)


def cut_short(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-200])


def foreign_table(path: Path) -> None:
    pq.write_table(pa.table({"step": [1, 2], "x_m": [0.5, 0.6]}), path)


def no_table(path: Path) -> None:
    path.write_bytes(b"not a table at all")


@pytest.mark.parametrize(
    ("damage", "reason"),
    [(bit_flip, "checksum"), (cut_short, "truncated"), (foreign_table, "schema_conflict")],
)
def test_damaged_files_are_refused(
    tmp_path: Path, fleet: Path, damage: Callable[[Path], None], reason: str
) -> None:
    log = log_in(one_log(tmp_path, fleet))
    damage(log / TRAJECTORIES_FILE)
    with pytest.raises(LogError) as error:
        read(log)
    assert error.value.reason == reason


def test_scans_may_be_empty_but_not_missing(tmp_path: Path, fleet: Path) -> None:
    inbox = one_log(tmp_path, fleet)
    scans = log_in(inbox) / SCANS_FILE
    pq.write_table(pq.read_table(scans).slice(0, 0), scans)
    assert all(drive.scans is None for drive in read(log_in(inbox)))
    scans.unlink()
    with pytest.raises(LogError, match=r"is damaged.*No such file"):
        read(log_in(inbox))
    assert Night(tmp_path / "store").take_in(inbox) == []


def test_a_file_that_claims_more_rows_than_fit_is_not_read(tmp_path: Path, fleet: Path) -> None:
    log = log_in(fleet)
    limits = DecoderLimits(output_mib=1)
    with pytest.raises(LogError) as error:
        read_bounded(log / SCANS_FILE, "scans", ("ranges_m",), byte_limit=2**16)
    assert error.value.reason == "size_limit"
    assert len(read_tabled_log(log, limits=limits).lengths) == 3
    # A million equal rows take a few kilobytes.
    path = tmp_path / SCANS_FILE
    schema = pq.read_schema(log / SCANS_FILE)
    rows = pq.read_table(log / SCANS_FILE)
    pq.write_table(rows.take(np.zeros(100_000, dtype=np.int64)), path, compression="zstd")
    assert path.stat().st_size < 2**20
    with pytest.raises(LogError) as error:
        read_bounded(path, "scans", schema.names, byte_limit=2**20)
    assert error.value.reason in ("size_limit", "memory_limit")


@pytest.mark.parametrize("damage", [no_table, cut_short])
def test_a_refused_folder_goes_into_quarantine_whole(
    tmp_path: Path, fleet: Path, damage: Callable[[Path], None]
) -> None:
    inbox = one_log(tmp_path, fleet)
    damage(log_in(inbox) / TRAJECTORIES_FILE)
    night = Night(tmp_path / "store")
    (taken,) = night.take_in(inbox)
    reason = "bad_magic" if damage is no_table else "truncated"
    assert (taken.status, taken.reason) == ("quarantined", reason)
    (kept,) = Quarantine(night.store.layout.quarantine).entries()
    assert kept.payload is not None
    assert (kept.payload / TRAJECTORIES_FILE).is_file()
    assert catalogue(night.tables) == []


def test_a_map_is_no_way_in_for_pickles(tmp_path: Path, fleet: Path) -> None:
    log = log_in(one_log(tmp_path, fleet))
    objects = np.array([[{"a": 1}]], dtype=object)
    np.savez(log / MAP_FILE, cells=objects, resolution=0.1, origin=np.zeros(3), allow_pickle=True)
    with pytest.raises(LogError, match="no map") as error:
        read(log)
    assert error.value.reason == "schema_conflict"
