"""The errors this project raises on purpose."""


class SesError(Exception):
    """Anything that went wrong in a way we foresaw; its text is for the user."""


class SettingsError(SesError):
    """A setting, an option or a settings file that cannot be used."""


class LogError(SesError):
    """A robot log that cannot be taken in; `reason` is from the closed list of refusals."""

    def __init__(self, reason: str, message: str) -> None:
        super().__init__(message)
        self.reason = reason


class SchemaError(SesError):
    """A table or file that does not have the columns its schema declares."""


class ArtifactError(SesError):
    """An artifact that is missing, damaged, or made by a newer release."""


class WorldError(SesError):
    """A map or world that cannot be read or cannot be used."""


class NotAMapError(WorldError):
    """A file of a kind that may hold a map and holds something else: folders pass over it."""


class SynthesisError(SesError):
    """Environments that cannot be synthesized from what there is."""


class MissingDependencyError(SesError):
    """An optional library is not installed; the text names the extra to install."""
