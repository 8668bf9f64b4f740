"""Whether a SQLite file is the plain database of messages it should be, checked before it is read.

A database can hold programs: views, triggers, generated columns and virtual tables run code of
the uploader's choosing inside the reader, and text in a number's place breaks it.
"""

import sqlite3
from contextlib import closing
from pathlib import Path

from ses_core.errors import LogError

_HEADER_SIZE = 100
_WAL_VERSION = 2


def recover_wal(database: Path) -> bool:
    """Bring what a killed recorder left in the write-ahead log into the database itself.

    rosbags opens files as immutable and would pass over it without a word.

    Returns:
        Whether the header says that such a log may have existed but none came along.

    Raises:
        LogError: The log does not fit the database.
    """
    log = database.with_name(f"{database.name}-wal")
    with database.open("rb") as file:
        header = file.read(_HEADER_SIZE)
    # Bytes 18 and 19 are the write and read version of the file format; 2 is WAL.
    uses_wal = len(header) == _HEADER_SIZE and header[19] == _WAL_VERSION
    if not (log.exists() and log.stat().st_size > 0):
        return uses_wal
    try:
        with closing(sqlite3.connect(database)) as connection:
            connection.execute("PRAGMA trusted_schema=OFF")
            # Leaving the mode moves everything committed into the database and drops the log.
            connection.execute("PRAGMA journal_mode=DELETE")
    except sqlite3.Error as error:
        raise LogError("truncated", f"write-ahead log cannot be recovered: {error}") from error
    return False


def require_plain_database(database: Path, *, message_limit: int) -> None:
    """Refuse a database that is damaged or is more than tables of messages.

    Args:
        database: A file of our own; the name of an upload could hold URI options.
        message_limit: Most bytes of one value.

    Raises:
        LogError: `truncated`, `unsupported` or `schema_conflict`.
    """
    try:
        with closing(sqlite3.connect(f"file:{database}?immutable=1", uri=True)) as connection:
            connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, message_limit)
            connection.execute("PRAGMA trusted_schema=OFF")
            connection.execute("PRAGMA cell_size_check=ON")
            _require_plain_schema(connection)
            problems = connection.execute("PRAGMA quick_check(1)").fetchone()
            if problems != ("ok",):
                raise LogError("truncated", f"database is damaged: {str(problems)[:200]}")
            _require_plain_messages(connection)
    except sqlite3.DataError as error:
        raise LogError("memory_limit", f"database holds a value too large: {error}") from error
    except sqlite3.DatabaseError as error:
        raise LogError("truncated", f"database cannot be read: {error}") from error


def _require_plain_schema(connection: sqlite3.Connection) -> None:
    entries = connection.execute("SELECT type, name, sql FROM sqlite_master").fetchall()
    for kind, name, sql in entries:
        statement = str(sql or "").lstrip().upper()
        if kind not in ("table", "index") or statement.startswith("CREATE VIRTUAL"):
            raise LogError("unsupported", f"database holds the {kind} {str(name)[:80]!r}")
    tables = {str(name) for kind, name, _ in entries if kind == "table"}
    if missing := {"messages", "topics"} - tables:
        raise LogError("unsupported", f"database has no table {', '.join(sorted(missing))!r}")
    for table in tables:
        columns = connection.execute(
            "SELECT name FROM pragma_table_xinfo(?) WHERE hidden != 0", (table,)
        ).fetchall()
        if columns:
            raise LogError("unsupported", f"database has generated columns in {table[:80]!r}")


def _require_plain_messages(connection: sqlite3.Connection) -> None:
    odd = connection.execute(
        "SELECT count(*) FROM messages WHERE typeof(timestamp) != 'integer'"
        " OR typeof(topic_id) != 'integer' OR typeof(data) != 'blob'"
    ).fetchone()[0]
    if odd:
        raise LogError("schema_conflict", f"{odd} messages have a stamp or content of another type")
