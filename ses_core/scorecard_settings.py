"""`ScorecardSettings`: how synthesized environments are compared with recorded ones."""

from pydantic import Field

from ses_core.settings_model import SettingsModel


class ScorecardSettings(SettingsModel):
    """What is compared with what, how often, and from where on two places count as copies."""

    halvings: int = Field(
        20, ge=2, description="Times the recorded environments are split in two halves."
    )
    sample: int = Field(
        1000,
        ge=5,
        description="Most on a side of one comparison; twice as many real ones are halved.",
    )
    neighbours: int = Field(5, ge=1, description="k of precision, recall, density and coverage.")
    permutations: int = Field(199, ge=19, description="Shuffles behind a p-value of MMD^2.")
    copy_share: float = Field(
        0.02, ge=0, lt=1, description="Environments this share of cells apart are near copies."
    )
    driven: int = Field(
        60,
        ge=0,
        description="The same of the environments that a policy drives through; a drive takes some "
        "0.1 s, one that times out several times that.",
    )
    seed: int = Field(0, ge=0, description="Of halves, shuffles and the noise of the drives.")
