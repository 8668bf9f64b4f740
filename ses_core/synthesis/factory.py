"""From settings to a synthesizer, and from stored arrays back to a fitted one."""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ses_core.errors import SynthesisError
from ses_core.protocols import FittedSynthesizer, Synthesizer
from ses_core.settings import (
    GanSettings,
    IdentitySettings,
    PcaSettings,
    RandomSamplingSettings,
    SynthesizerSettings,
)
from ses_core.synthesis.generator_network import network_from_arrays
from ses_core.synthesis.identity import FittedIdentity, Identity
from ses_core.synthesis.random_sampling import FittedRandomSampling, RandomSampling

Arrays = Mapping[str, NDArray[np.generic]]


def make_synthesizer(settings: SynthesizerSettings, *, environments: int) -> Synthesizer:
    """Make the synthesizer that settings name; M `environments` will be drawn from it."""
    match settings:
        case GanSettings():
            from ses_core.synthesis.gan import Gan

            return Gan(settings)
        case PcaSettings():
            from ses_core.synthesis.pca_kmeans import PcaKmeans

            return PcaKmeans(
                components=settings.components,
                clusters=math.ceil(environments / settings.per_cluster),
            )
        case RandomSamplingSettings():
            return RandomSampling()
        case IdentitySettings():
            return Identity()


def rebuild_synthesizer(method: str, arrays: Arrays) -> FittedSynthesizer:
    """Rebuild a fitted synthesizer from its `arrays()`.

    Raises:
        SynthesisError: The method is unknown, or an array it needs is missing.
    """
    try:
        match method:
            case "gan":
                return network_from_arrays(arrays)
            case "pca":
                from ses_core.synthesis.pca_kmeans import FittedPcaKmeans

                return FittedPcaKmeans(
                    mean=np.asarray(arrays["mean"], dtype=np.float64),
                    components=np.asarray(arrays["components"], dtype=np.float64),
                    coordinates=np.asarray(arrays["coordinates"], dtype=np.float64),
                    clusters=np.asarray(arrays["clusters"], dtype=np.int64),
                )
            case "rs":
                return FittedRandomSampling(cells=np.asarray(arrays["cells"], dtype=np.bool_))
            case "identity":
                return FittedIdentity(cells=np.asarray(arrays["cells"], dtype=np.bool_))
    except KeyError as error:
        raise SynthesisError(
            f"found no array {error} among those of {method}: {sorted(arrays)}"
        ) from error
    raise SynthesisError(f"found synthesizer {method!r}, expected one of gan, pca, rs, identity")
