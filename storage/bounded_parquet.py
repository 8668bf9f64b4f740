"""Parquet files from outside: read within limits, their schema checked first.

A footer of a few bytes can claim any number of rows, and a page of a few bytes inflate to any
size. Claims are checked before anything is read; what lies about itself meets the limits of the
process that reads it.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from ses_core.errors import LogError, SchemaError
from storage.table_schemas import check_schema

_FOOTER_LIMIT = 2**20
_ROW_BYTES = 8
"""A row of any of our tables takes more than this; so many more rows than bytes are a lie."""


@contextmanager
def bounded_file(
    path: Path, table: str, *, check: Callable[[pa.Schema], None], byte_limit: int
) -> Iterator[pq.ParquetFile]:
    """Open a file whose schema and claims are as expected; what goes wrong in reading it has names.

    Args:
        path: File to open.
        table: What it is called in errors.
        check: Raises SchemaError for other columns than expected.
        byte_limit: Most bytes it may claim to hold.

    Raises:
        LogError: `truncated`, `checksum`, `schema_conflict`, `size_limit` or `memory_limit`.
    """
    try:
        with pq.ParquetFile(
            path,
            page_checksum_verification=True,
            pre_buffer=False,
            thrift_string_size_limit=_FOOTER_LIMIT,
            thrift_container_size_limit=_FOOTER_LIMIT,
        ) as file:
            check(file.schema_arrow)
            _check_claims(file.metadata, table, byte_limit)
            yield file
    except SchemaError as error:
        raise LogError("schema_conflict", str(error)) from error
    except pa.ArrowMemoryError as error:
        raise LogError("memory_limit", f"{table}.parquet: {error}") from error
    except (pa.ArrowException, OSError) as error:
        text = str(error).splitlines()[0] if str(error) else type(error).__name__
        reason = "checksum" if "crc" in text.lower() else "truncated"
        raise LogError(reason, f"{table}.parquet is damaged: {text}") from error


def read_bounded(path: Path, table: str, columns: Sequence[str], *, byte_limit: int) -> pa.Table:
    """Read some columns of a file of one of our tables.

    Raises:
        LogError: `truncated`, `checksum`, `schema_conflict`, `size_limit` or `memory_limit`.
    """

    def check(schema: pa.Schema) -> None:
        check_schema(schema, table, source=f"{table}.parquet")

    with bounded_file(path, table, check=check, byte_limit=byte_limit) as file:
        rows = file.read(columns=list(columns), use_threads=False)
    if rows.nbytes > byte_limit:
        raise LogError("memory_limit", f"{table}.parquet holds {rows.nbytes} bytes")
    for name in columns:
        if not rows.schema.field(name).nullable and rows.column(name).null_count:
            raise LogError("schema_conflict", f"{table}.parquet has nulls in {name}")
    return rows


def _check_claims(footer: pq.FileMetaData, table: str, byte_limit: int) -> None:
    groups = [footer.row_group(index) for index in range(footer.num_row_groups)]
    size = sum(group.total_byte_size for group in groups)
    rows = sum(group.num_rows for group in groups)
    if size > byte_limit or rows > byte_limit // _ROW_BYTES or min(size, rows) < 0:
        raise LogError(
            "size_limit",
            f"{table}.parquet claims {rows} rows of {size} bytes, expected at most {byte_limit} "
            "bytes",
        )
