"""One log of the store with everything that is drawn of it: its drives, scenarios and places."""

from dataclasses import dataclass

from ses_core.errors import ArtifactError
from ses_core.extraction.extract import ExtractedScenario, extract
from ses_core.extraction.robot_matching import profile_named
from ses_core.extraction.trajectory import Trajectory
from ses_core.settings import Settings
from storage.artifact_store import LocalArtifactStore
from storage.layout import Layout
from storage.log_catalogue import catalogue
from storage.site_maps import read_site_maps
from storage.table_log import TableLog
from storage.trajectory_tables import read_log_row, read_recorded_map, read_trajectories


@dataclass(frozen=True, slots=True, kw_only=True)
class ShownLog:
    """A log, cut anew from its trajectories: scans along a drive stand in no other table."""

    name: str
    trajectories: list[Trajectory]
    extracted: list[ExtractedScenario]

    def scenario(self, scenario_id: str) -> tuple[ExtractedScenario, Trajectory]:
        """Give a scenario and the drive it was cut from.

        Raises:
            ArtifactError: These settings cut the log elsewhere.
        """
        for extracted in self.extracted:
            if extracted.scenario_id == scenario_id:
                first = extracted.scenario.first_step
                drives = (one for one in self.trajectories if one.first_step <= first)
                return extracted, max(drives, key=lambda drive: drive.first_step)
        raise ArtifactError(
            f"log {self.name} has no scenario {scenario_id} under these settings, expected the "
            "settings it was extracted with"
        )


def read_shown_log(layout: Layout, log_id: str, *, settings: Settings) -> ShownLog:
    """Read a log's drives and cut its scenarios.

    Raises:
        ArtifactError: The store does not hold the log.
    """
    entry = next((one for one in catalogue(TableLog(layout)) if one.log_id == log_id), None)
    if entry is None:
        raise ArtifactError(f"store {layout.root} holds no trajectories of log {log_id}")
    folder = LocalArtifactStore(layout.root).path(entry.ref)
    row = read_log_row(folder)
    site_maps = read_site_maps(settings.extraction.site_maps)
    site_map = site_maps.get(str(row["site"])) if row["pose_source"] == "map" else None
    trajectories = read_trajectories(folder)
    extracted = extract(
        trajectories,
        log_id=log_id,
        recorded_map=site_map.recorded if site_map else read_recorded_map(folder),
        settings=settings.extraction,
        profile=profile_named(str(row["profile"]), settings.ingest),
        target=settings.target_robot,
    )
    return ShownLog(name=str(row["name"]), trajectories=trajectories, extracted=extracted)
