"""Who recorded a log: robot and site from its path, and which profile that robot has."""

import re
from dataclasses import dataclass
from fnmatch import fnmatchcase

from ses_core.errors import SettingsError
from ses_core.robot_profile import KNOWN_PROFILES, RobotProfile
from ses_core.settings import IngestSettings

UNKNOWN = "unknown"
"""Site or robot of a log that neither its folders nor a rule identify."""


@dataclass(frozen=True, slots=True)
class Identity:
    """Where a log comes from; `UNKNOWN` where nothing says so."""

    site: str
    robot: str

    @property
    def is_complete(self) -> bool:
        """Whether both are known."""
        return UNKNOWN not in (self.site, self.robot)


def identify(relative: str, settings: IngestSettings) -> Identity:
    """Read site and robot from a log's path below the inbox.

    With a pattern in the settings that decides; else the folders `<site>/<robot>/` do, and a
    single folder is a site.

    Raises:
        SettingsError: The pattern is no regular expression.
    """
    if settings.identity_pattern is not None:
        try:
            match = re.search(settings.identity_pattern, relative)
        except re.error as error:
            raise SettingsError(
                f"identity_pattern {settings.identity_pattern!r} is no regular expression: {error}"
            ) from error
        groups = match.groupdict() if match else {}
        return Identity(groups.get("site") or UNKNOWN, groups.get("robot") or UNKNOWN)
    folders = relative.split("/")[:-1]
    site = folders[0] if folders else UNKNOWN
    robot = folders[1] if len(folders) > 1 else UNKNOWN
    return Identity(site, robot)


def profile_of(identity: Identity, name: str, settings: IngestSettings) -> RobotProfile:
    """Give the profile of the first rule that matches `<site>/<robot>/<log name>`.

    Raises:
        SettingsError: A rule names a profile that does not exist.
    """
    path = f"{identity.site}/{identity.robot}/{name}"
    for rule in settings.robots:
        if fnmatchcase(path, rule.match):
            return profile_named(rule.profile, settings)
    return profile_named(settings.default_profile, settings)


def profile_named(name: str, settings: IngestSettings) -> RobotProfile:
    """Give a profile by its name: one of the settings, or a built-in one.

    Raises:
        SettingsError: There is none.
    """
    profiles = {**KNOWN_PROFILES, **settings.profiles}
    if name not in profiles:
        raise SettingsError(f"robot profile {name!r} is not one of {', '.join(sorted(profiles))}")
    return profiles[name]
