"""`DifficultySettings`: how often, and in how many places, the deployed policy drives again."""

from pydantic import Field

from ses_core.settings_model import SettingsModel


class DifficultySettings(SettingsModel):
    """Places are driven through again by the policy that a night goes on from."""

    trials: int = Field(
        3, ge=0, description="Drives through each place, under different noise; 0 drives in none."
    )
    recorded: int = Field(
        200, ge=0, description="Most recorded places of the pool, hardest by the log first."
    )
    seed: int = Field(0, ge=0, description="Of the noise.")
