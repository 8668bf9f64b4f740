"""`SynthesisSettings`: how a few environments come to stand for many (section III-C).

What the paper leaves open of its three methods is a setting of `gan-paper`, `pca-paper`, `rs`.
"""

from typing import Annotated, Literal

from pydantic import Field

from ses_core.settings_model import SettingsModel


class GanPaperSettings(SettingsModel):
    """SES-GAN as printed: the paper's layers and loss; what it leaves open is a setting here."""

    method: Literal["gan-paper"] = "gan-paper"
    latent_size: int = Field(64, ge=1, description="Length of the noise vector.")
    epochs: int = Field(200, ge=1, description="Passes over the challenging environments.")
    batch_size: int = Field(64, ge=2, description="Environments per update.")
    learning_rate: float = Field(2e-4, gt=0, description="Of both Adam optimisers.")
    adam_beta1: float = Field(0.5, ge=0, lt=1, description="First-moment decay of both optimisers.")
    leaky_slope: float = Field(0.2, gt=0, lt=1, description="Negative slope of the leaky ReLUs.")
    loss: Literal["saturating", "non-saturating"] = Field(
        "saturating",
        description="The generator minimises log(1 - D(G(z))) as printed, which teaches it nothing "
        "once D is ahead, or -log D(G(z)).",
    )
    least_updates: int = Field(
        2000, ge=1, description="Updates made even where the epochs would make fewer."
    )
    least_environments: int = Field(
        30, ge=2, description="With fewer to learn from, mirror images are drawn instead."
    )


class GanSettings(SettingsModel):
    """SES-GAN, mended: the discriminator judges the binary environments that are used."""

    method: Literal["gan"] = "gan"
    latent_size: int = Field(64, ge=1, description="Length of the noise vector.")
    epochs: int = Field(200, ge=1, description="Passes over the challenging environments.")
    batch_size: int = Field(64, ge=2, description="Environments per update.")
    learning_rate: float = Field(2e-4, gt=0, description="Of both Adam optimisers.")
    adam_beta1: float = Field(0.5, ge=0, lt=1, description="First-moment decay of both optimisers.")
    leaky_slope: float = Field(0.2, gt=0, lt=1, description="Negative slope of the leaky ReLUs.")
    least_updates: int = Field(
        2000, ge=1, description="Updates made even where the epochs would make fewer."
    )
    least_environments: int = Field(
        30, ge=2, description="With fewer to learn from, mirror images are drawn instead."
    )


class PcaPaperSettings(SettingsModel):
    """SES-PCA as printed: n reconstructions from each of m clusters of principal components."""

    method: Literal["pca-paper"] = "pca-paper"
    components: int = Field(100, ge=1, description="Principal components (section IV-B).")
    per_cluster: int = Field(5, ge=1, description="n: environments drawn from each cluster.")
    threshold: float = Field(
        0.5, gt=0, lt=1, description="A reconstruction above this is occupied (free 0, occupied 1)."
    )


class PcaSettings(SettingsModel):
    """SES-PCA, mended: what stands for a cluster is nearest to its centre, and real."""

    method: Literal["pca"] = "pca"
    components: int = Field(100, ge=1, description="Principal components (section IV-B).")
    per_cluster: int = Field(1, ge=1, description="n: environments taken from each cluster.")
    gives: Literal["recorded", "reconstruction"] = Field(
        "recorded",
        description="The recorded environments nearest to a cluster's centre, or these as their "
        "principal components give them back.",
    )


class RandomSamplingSettings(SettingsModel):
    """SES-RS: draw from the challenging environments uniformly."""

    method: Literal["rs"] = "rs"


class MedoidsSettings(SettingsModel):
    """The recorded environments from which all others are least far away, in differing cells."""

    method: Literal["medoids"] = "medoids"


class IdentitySettings(SettingsModel):
    """Copies of the recorded places, as in the paper's physical experiment, hardest first."""

    method: Literal["identity"] = "identity"


class MirrorSettings(SettingsModel):
    """Draw from the recorded places, their mirror images, and both driven the other way."""

    method: Literal["mirror"] = "mirror"


class AutoregressiveSettings(SettingsModel):
    """Cell by cell from start to goal, each by a network that sees the cells before it."""

    method: Literal["autoregressive"] = "autoregressive"
    reach: int = Field(
        10, ge=1, le=29, description="Rows before a cell, and columns beside it, that it sees."
    )
    hidden: int = Field(192, ge=8, description="Units of both hidden layers.")
    updates: int = Field(6000, ge=1, description="Steps of the optimiser.")
    batch_size: int = Field(2048, ge=32, description="Cells per update.")
    learning_rate: float = Field(3e-3, gt=0, description="Of Adam at its highest.")
    weight_decay: float = Field(1e-3, ge=0, description="Per unit of the learning rate.")
    plain_share: float = Field(
        0.25,
        gt=0,
        lt=1,
        description="Share of a batch for cells that are like those before them; what they count "
        "for makes up for it.",
    )
    averaging: float = Field(
        0.995, ge=0, lt=1, description="Decay per update of the running average that is kept."
    )
    temperature: float = Field(
        1.0, gt=0, description="Below 1 what is likely becomes likelier, and variety is lost."
    )
    keeps_way_open: bool = Field(
        True,
        description="A cell that would close the last way for the target robot stays free.",
    )
    least_environments: int = Field(
        30, ge=2, description="With fewer to learn from, mirror images are drawn instead."
    )


LearnedSettings = GanPaperSettings | GanSettings | AutoregressiveSettings
"""Generators: they make as many new environments as are asked for, and can go on from a fit."""

SynthesizerSettings = Annotated[
    GanPaperSettings
    | GanSettings
    | PcaPaperSettings
    | PcaSettings
    | RandomSamplingSettings
    | MedoidsSettings
    | IdentitySettings
    | MirrorSettings
    | AutoregressiveSettings,
    Field(discriminator="method"),
]


class SynthesisSettings(SettingsModel):
    """From thousands of challenging environments to about a hundred (section III-C)."""

    synthesizer: SynthesizerSettings = Field(GanSettings(), description="How they are made.")
    environments: int = Field(100, ge=1, description="M: environments to train in.")
    least_pool: int = Field(
        10,
        ge=1,
        description="With fewer challenging environments a night trains nothing: that would "
        "teach those few places by heart.",
    )
    uncrossable: Literal["repair", "reject"] = Field(
        "repair",
        description="A sample that the target robot cannot cross is repaired with the fewest "
        "changed cells, or passed over.",
    )
    most_repaired_cells: int = Field(
        30, ge=1, description="A sample that would need more changed cells is passed over."
    )
    attempts: int = Field(
        20, ge=1, description="Most samples drawn per environment that can be crossed."
    )
    warm_start: bool = Field(
        False,
        description="Go on from the newest earlier fit of the same synthesizer; else learn from "
        "nothing, which any machine can repeat.",
    )
    seed: int = Field(0, ge=0, description="Seed of the fit and of the samples.")
