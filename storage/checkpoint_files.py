"""`CheckpointFile`: where a training stands, so that a killed one goes on.

One file, replaced as a whole: a ZIP archive, uncompressed, of the checkpoint's files and of a
digest of everything that decides the training. It is dropped once the training has ended.
"""

import io
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from storage.durable_files import disk_errors, replace_file

_ASKED = "asked"


@dataclass(frozen=True, slots=True)
class CheckpointFile:
    """The checkpoint of one training.

    Attributes:
        path: The file; its folder is there.
        asked: Digest of everything that decides the training.
    """

    path: Path
    asked: str

    def keep(self, files: Mapping[str, bytes]) -> None:
        """Replace what was kept.

        Raises:
            ArtifactError: The disk is full or failing.
        """
        archive = io.BytesIO()
        with zipfile.ZipFile(archive, "w", zipfile.ZIP_STORED) as into:
            into.writestr(_ASKED, self.asked)
            for name, content in files.items():
                into.writestr(name, content)
        with disk_errors(self.path):
            replace_file(self.path, archive.getvalue())

    def found(self) -> dict[str, bytes] | None:
        """Give what was kept; None where nothing was, or of another training, or it is damaged.

        Whatever is not there is trained again, so damage costs time and nothing else.
        """
        try:
            with zipfile.ZipFile(self.path) as archive:
                files = {name: archive.read(name) for name in archive.namelist()}
        except (OSError, zipfile.BadZipFile):
            return None
        return files if files.pop(_ASKED, b"").decode(errors="replace") == self.asked else None

    def drop(self) -> None:
        """Take it away."""
        with disk_errors(self.path):
            self.path.unlink(missing_ok=True)
