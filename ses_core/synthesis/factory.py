"""From settings to a synthesizer, and from stored arrays back to a fitted one.

Heavy imports stay in the branches: drawing from a stored fit needs neither torch nor sklearn.
"""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from ses_core.errors import SynthesisError
from ses_core.protocols import FittedSynthesizer, Synthesizer
from ses_core.synthesis.autoregressive_network import autoregressive_from_arrays
from ses_core.synthesis.generator_network import network_from_arrays
from ses_core.synthesis.identity import Identity, identity_from_arrays
from ses_core.synthesis.medoids import Medoids, medoids_from_arrays
from ses_core.synthesis.mirror import Mirror, mirror_from_arrays
from ses_core.synthesis.pca_selection import selection_from_arrays
from ses_core.synthesis.random_sampling import RandomSampling, sampling_from_arrays
from ses_core.synthesis_settings import (
    AutoregressiveSettings,
    GanPaperSettings,
    GanSettings,
    IdentitySettings,
    MedoidsSettings,
    MirrorSettings,
    PcaPaperSettings,
    PcaSettings,
    RandomSamplingSettings,
    SynthesizerSettings,
)

Arrays = Mapping[str, NDArray[np.generic]]

_REBUILDERS: dict[str, Callable[[Arrays], FittedSynthesizer]] = {
    "gan-paper": network_from_arrays,
    "gan": network_from_arrays,
    "pca-paper": selection_from_arrays,
    "pca": selection_from_arrays,
    "rs": sampling_from_arrays,
    "medoids": medoids_from_arrays,
    "identity": identity_from_arrays,
    "mirror": mirror_from_arrays,
    "autoregressive": autoregressive_from_arrays,
}


def make_synthesizer(settings: SynthesizerSettings, *, environments: int) -> Synthesizer:
    """Make the synthesizer that settings name; M `environments` will be drawn from it."""
    match settings:
        case GanPaperSettings():
            from ses_core.synthesis.gan_paper import GanPaper

            return GanPaper(settings)
        case GanSettings():
            from ses_core.synthesis.gan import Gan

            return Gan(settings)
        case PcaPaperSettings():
            from ses_core.synthesis.pca_paper import PcaPaper

            return PcaPaper(settings, environments=environments)
        case PcaSettings():
            from ses_core.synthesis.pca import PcaKmeans

            return PcaKmeans(settings, environments=environments)
        case RandomSamplingSettings():
            return RandomSampling()
        case MedoidsSettings():
            return Medoids(environments=environments)
        case IdentitySettings():
            return Identity()
        case MirrorSettings():
            return Mirror()
        case AutoregressiveSettings():
            from ses_core.synthesis.autoregressive import Autoregressive

            return Autoregressive(settings)


def rebuild_synthesizer(method: str, arrays: Arrays) -> FittedSynthesizer:
    """Rebuild a fitted synthesizer from its `arrays()`.

    Raises:
        SynthesisError: The method is unknown, or an array it needs is missing.
    """
    if method not in _REBUILDERS:
        raise SynthesisError(
            f"found synthesizer {method!r}, expected one of {', '.join(_REBUILDERS)}"
        )
    try:
        return _REBUILDERS[method](arrays)
    except KeyError as error:
        raise SynthesisError(
            f"found no array {error} among those of {method}: {sorted(arrays)}"
        ) from error
