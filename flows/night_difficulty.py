"""The night's closed loop: are the places as hard for the robot as they were for the fleet?"""

from flows.night_stages import Night
from ses_core.recipes import ArtifactRef
from tasks.difficulty import verify_difficulty


def verify_night(
    night: Night, selection: ArtifactRef, environments: ArtifactRef, *, parent: str
) -> ArtifactRef | None:
    """Let the parent drive again in the pool's places and in the synthesized environments.

    Gives None where the settings ask for no trial.
    """
    if not night.settings.difficulty.trials:
        return None
    made = verify_difficulty.submit(
        selection,
        environments,
        policy=parent,
        store=night.store,
        settings=night.settings,
        anew="render" in night.anew,
    ).result()
    return night.count("render", made).ref
