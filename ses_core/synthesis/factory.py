"""From settings to a synthesizer, and from stored arrays back to a fitted one.

Heavy imports stay in the branches: drawing from a stored fit needs neither torch nor sklearn.
"""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from ses_core.arrays import BoolArray
from ses_core.errors import SynthesisError
from ses_core.protocols import FittedSynthesizer, Synthesizer
from ses_core.synthesis.autoregressive_network import autoregressive_from_arrays
from ses_core.synthesis.fixed_order import FixedOrder, order_from_arrays
from ses_core.synthesis.generator_network import network_from_arrays
from ses_core.synthesis.keeping import Keeping
from ses_core.synthesis.medoids import Medoids
from ses_core.synthesis.mirror import FittedMirror
from ses_core.synthesis.pca_selection import selection_from_arrays
from ses_core.synthesis.random_sampling import FittedRandomSampling
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
    "rs": lambda arrays: FittedRandomSampling(cells=_cells(arrays)),
    "medoids": order_from_arrays,
    "identity": order_from_arrays,
    "mirror": lambda arrays: FittedMirror(cells=_cells(arrays)),
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
            return Keeping(lambda cells: FittedRandomSampling(cells=cells))
        case MedoidsSettings():
            return Medoids(environments=environments)
        case IdentitySettings():
            return Keeping(lambda cells: FixedOrder(cells=cells))
        case MirrorSettings():
            return Keeping(lambda cells: FittedMirror(cells=cells))
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


def _cells(arrays: Arrays) -> BoolArray:
    return np.asarray(arrays["cells"], dtype=np.bool_)
