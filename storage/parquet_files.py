"""One Parquet file of one table: written with page checksums, read back checked."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from ses_core.errors import ArtifactError, SchemaError
from storage.durable_files import disk_errors, sync_file, sync_folder, temporary_name
from storage.table_schemas import check_schema, table_schema

Column = Sequence[object] | NDArray[np.generic] | pd.Series


def write_table(path: Path, table: str, columns: Mapping[str, Column]) -> None:
    """Write rows of a table as one file that is whole or absent.

    Nullable columns that are left out are null. Lists may come as rows of an array: `cells`
    as (N, 30, 30), `ranges_m` as (S, B). In a nullable column of whole numbers None is null;
    NaN in a column of real numbers stays NaN.

    Raises:
        SchemaError: Columns are missing, unknown, of the wrong type or of different lengths.
        ArtifactError: The disk is full or failing; nothing is left under the path's name.
    """
    _write(path, _to_arrow(table, columns))


def write_empty_table(path: Path, table: str) -> None:
    """Write a file of no rows, which keeps a table readable while it has no other."""
    _write(path, table_schema(table).empty_table())


def merge_tables(path: Path, table: str, sources: Sequence[Path]) -> None:
    """Write the rows of several files of a table as one, in their order.

    Raises:
        ArtifactError: A file is missing or damaged, or the disk is full or failing.
    """
    merged = [table_schema(table).empty_table(), *(read_arrow(file, table) for file in sources)]
    _write(path, pa.concat_tables(merged))


def read_table(path: Path, table: str, columns: Sequence[str] | None = None) -> pd.DataFrame:
    """Read one file of a table, all its columns by default, checking schema and checksums.

    Raises:
        ArtifactError: The file is missing or damaged.
        SchemaError: It is no file of this table, or a column is unknown.
    """
    return to_pandas(read_arrow(path, table, columns))


def read_arrow(path: Path, table: str, columns: Sequence[str] | None = None) -> pa.Table:
    """Read one file of a table as an Arrow table; see `read_table`."""
    schema = table_schema(table)
    unknown = [name for name in columns or () if name not in schema.names]
    if unknown:
        raise SchemaError(
            f"table {table} has no column {unknown[0]!r}, expected of {', '.join(schema.names)}"
        )
    if not path.is_file():
        raise ArtifactError(f"{path} is missing, expected a file of table {table}")
    try:
        with pq.ParquetFile(path, page_checksum_verification=True) as file:
            check_schema(file.schema_arrow, table, source=str(path))
            return file.read(columns=None if columns is None else list(columns))
    except (pa.ArrowException, OSError) as error:
        raise ArtifactError(f"{path} is damaged: {_first_line(error)}") from error


def to_pandas(table: pa.Table) -> pd.DataFrame:
    """Give an Arrow table as pandas, unknown whole numbers as `Int64` nulls."""
    return table.to_pandas()


def row_count(path: Path) -> int:
    """Count the rows of a Parquet file from its footer.

    Raises:
        ArtifactError: The file is missing or its footer damaged.
    """
    try:
        return int(pq.read_metadata(path).num_rows)
    except (pa.ArrowException, OSError) as error:
        raise ArtifactError(f"{path} is damaged: {_first_line(error)}") from error


def _to_arrow(table: str, columns: Mapping[str, Column]) -> pa.Table:
    schema = table_schema(table)
    unknown = [name for name in columns if name not in schema.names]
    missing = [field.name for field in schema if not field.nullable and field.name not in columns]
    if unknown or missing:
        raise SchemaError(
            f"table {table} was given unknown columns {unknown} and lacks columns {missing}"
        )
    lengths = {name: len(values) for name, values in columns.items()}
    if len(set(lengths.values())) != 1:
        raise SchemaError(f"columns of table {table} have different lengths: {lengths}")
    rows = next(iter(lengths.values()))
    return pa.Table.from_arrays(
        [
            _array(columns[field.name], field, table)
            if field.name in columns
            else pa.nulls(rows, field.type)
            for field in schema
        ],
        schema=schema,
    )


def _array(values: Column, field: pa.Field, table: str) -> pa.Array:
    try:
        if pa.types.is_nested(field.type) and isinstance(values, np.ndarray) and values.ndim > 1:
            array = _rows_as_lists(values, field.type)
        elif pa.types.is_nested(field.type):
            array = pa.array([np.ravel(np.asarray(value)) for value in values], type=field.type)
        else:
            # NaN from pandas means NaN, not null.
            array = pa.array(values, type=field.type, from_pandas=False)
    except (pa.ArrowException, TypeError, ValueError, OverflowError) as error:
        raise SchemaError(
            f"column {field.name} of table {table} cannot be {field.type}: {_first_line(error)}"
        ) from error
    if isinstance(array, pa.ChunkedArray):
        array = array.combine_chunks()
    if not field.nullable and array.null_count:
        raise SchemaError(f"column {field.name} of table {table} has nulls, expected none")
    return array


def _rows_as_lists(values: NDArray[np.generic], kind: pa.DataType) -> pa.Array:
    """Give an array (N, ...) as N lists, without a Python object per row."""
    flat = np.ascontiguousarray(values.reshape(len(values), -1))
    items = pa.array(flat.ravel().astype(kind.value_type.to_pandas_dtype(), copy=False))
    if pa.types.is_fixed_size_list(kind):
        if flat.shape[1] != kind.list_size:
            raise ValueError(f"rows hold {flat.shape[1]} values, expected {kind.list_size}")
        return pa.FixedSizeListArray.from_arrays(items, type=kind)
    offsets = np.arange(len(flat) + 1, dtype=np.int64) * flat.shape[1]
    return pa.ListArray.from_arrays(pa.array(offsets, type=pa.int32()), items, type=kind)


def _write(path: Path, rows: pa.Table) -> None:
    # Arrow deletes what is there when the disk is full: it never writes to the final name.
    temporary = temporary_name(path)
    with disk_errors(path):
        try:
            pq.write_table(rows, temporary, compression="zstd", write_page_checksum=True)
            sync_file(temporary)
            os.replace(temporary, path)  # noqa: PTH105  (one name for tests of every disk call)
        finally:
            temporary.unlink(missing_ok=True)
        sync_folder(path.parent)


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
