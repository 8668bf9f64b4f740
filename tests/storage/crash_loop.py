"""Takes in one log after the other for ever: something to kill at a random instant.

`python -m tests.storage.crash_loop ROOT` starts where the last one was killed and prints a
line per log; the rows of every log are committed once and then replaced.
"""

import itertools
import sys
from pathlib import Path

from storage.artifact_store import LocalArtifactStore
from storage.table_log import TableLog
from storage.table_parts import artifact_parts
from tests.storage.sample_tables import DAY, build_of, recipe_of

TABLES = ("logs", "scans")

if __name__ == "__main__":
    store = LocalArtifactStore(Path(sys.argv[1]))
    log = TableLog(store.layout)
    for number in itertools.count(len(log.parts("logs"))):
        tag = f"log{number}"
        ref = store.put(recipe_of(tag), build_of(tag, tables=TABLES))
        log.commit(artifact_parts(store, ref, name=tag, batch_date=DAY), message=tag)
        again = store.put(recipe_of(f"{tag}x"), build_of(f"{tag}x", tables=TABLES))
        log.commit(artifact_parts(store, again, name=tag, batch_date=DAY), message=tag)
        sys.stdout.write(f"{tag}\n")
        sys.stdout.flush()
