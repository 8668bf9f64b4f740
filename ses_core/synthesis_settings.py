"""`SynthesisSettings`: how a few environments come to stand for many (section III-C).

What the paper leaves open of its three methods is a setting of `gan-paper`, `pca-paper`, `rs`.
"""

from typing import Annotated, Literal

from pydantic import Field

from ses_core.settings_model import SettingsModel

Channels = Annotated[int, Field(ge=1)]


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
    discriminator_normalizes: Literal["together", "apart"] = Field(
        "together",
        description="Whether real and generated environments are one batch to the discriminator's "
        "batch normalization. Apart, both get the same mean and the generator learns nothing.",
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
    generator_hidden: int = Field(256, ge=1, description="Units after the noise.")
    generator_channels: tuple[Channels, Channels] = Field(
        (32, 32), description="Channels of the generator's images of 8 x 8 and 16 x 16 cells."
    )
    generator_bands: int = Field(
        1,
        ge=0,
        description="Pairs of fields of which a wall is where both are positive; 0 is one field.",
    )
    least_obstacle: int = Field(
        3,
        ge=1,
        description="Obstacles of fewer cells are left out of what is drawn. The discriminator "
        "sees them: where it did not, obstacles just larger took their place.",
    )
    discriminator_channels: tuple[Channels, Channels] = Field(
        (16, 48), description="Channels of the discriminator's images of 16 x 16 and 8 x 8 cells."
    )
    discriminator_hidden: int = Field(128, ge=1, description="Units before its verdict.")
    leaky_slope: float = Field(0.2, gt=0, lt=1, description="Negative slope of the leaky ReLUs.")
    epochs: int = Field(200, ge=1, description="Passes over the challenging environments, at most.")
    least_updates: int = Field(
        3000, ge=1, description="Updates made even where the epochs would make fewer."
    )
    batch_size: int = Field(64, ge=2, description="Environments per update.")
    learning_rate: float = Field(1e-3, gt=0, description="Of both Adam optimisers.")
    decay_share: float = Field(
        0.5,
        gt=0,
        le=1,
        description="Last share of the training in which the learning rate falls to nothing.",
    )
    adam_beta1: float = Field(0.5, ge=0, lt=1, description="First-moment decay of both optimisers.")
    r1_weight: float = Field(
        3.0,
        ge=0,
        description="Weight of half the squared slope of the discriminator at real environments.",
    )
    r1_interval: int = Field(
        16, ge=1, description="Updates of which one has it, so many times stronger."
    )
    average_decay: float = Field(
        0.998,
        ge=0,
        lt=1,
        description="Share of the running average of the generator's weights that an update keeps.",
    )
    mirrored: bool = Field(True, description="Real environments are mirrored at random.")
    most_shift: int = Field(
        3,
        ge=0,
        description="Cells by which all that the discriminator sees is shifted, up to, so that it "
        "cannot learn the real ones by heart.",
    )
    heldout_share: float = Field(
        0.1,
        ge=0,
        lt=1,
        description="Share not trained on, by whose coverage the best generator is chosen.",
    )
    least_heldout: int = Field(
        30, ge=2, description="With fewer than that none is held out and the last one is taken."
    )
    most_heldout: int = Field(500, ge=2, description="Most environments held out.")
    snapshots: int = Field(
        20, ge=1, description="Generators compared, evenly spread over the training."
    )
    coverage_draws: int = Field(
        4, ge=1, description="Samples, each as large as what is held out, averaged per generator."
    )
    coverage_neighbours: int = Field(
        5, ge=1, description="A held-out one is covered within the distance of this neighbour."
    )
    patience: int = Field(
        8, ge=1, description="So many compared in a row that are worse end the training."
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
        15, ge=1, le=29, description="Rows before a cell, and columns beside it, that it sees."
    )
    hidden: int = Field(192, ge=8, description="Units of both hidden layers.")
    dropout: float = Field(
        0.0,
        ge=0,
        lt=1,
        description="Share of hidden units left out in each update: less sure of every cell, which "
        "makes other places likelier and samples noisier.",
    )
    updates: int = Field(4000, ge=1, description="Steps of the optimiser.")
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

    synthesizer: SynthesizerSettings = Field(
        AutoregressiveSettings(), description="How they are made."
    )
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
        "nothing, which needs no history to be repeated.",
    )
    seed: int = Field(0, ge=0, description="Seed of the fit and of the samples.")
