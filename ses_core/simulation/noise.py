"""Random numbers of a slot: one 64-bit state, so its draws depend on nothing but its seed."""

from typing import TYPE_CHECKING

import numpy as np

from ses_core.compilation import compiled_in_place

if TYPE_CHECKING:
    from ses_core.simulation.state import Slot

_STEP = np.uint64(0x9E3779B97F4A7C15)
_MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2 = np.uint64(0x94D049BB133111EB)
_SHIFT_30, _SHIFT_27, _SHIFT_31 = np.uint64(30), np.uint64(27), np.uint64(31)
_SHIFT_16, _SHIFT_32, _SHIFT_48 = np.uint64(16), np.uint64(32), np.uint64(48)
_LOW_16 = np.uint64(0xFFFF)
_SHIFT_11 = np.uint64(11)

_MEAN_OF_FOUR = 2.0 * 65535.0
_DEVIATION_OF_FOUR = float(np.sqrt(4.0 * (65536.0**2 - 1.0) / 12.0))


@compiled_in_place
def draw_bits(slot: "Slot") -> np.uint64:
    """Advance the slot's state and give 64 random bits (SplitMix64, Steele et al. 2014)."""
    slot.random_state = slot.random_state + _STEP
    bits = slot.random_state
    bits = (bits ^ (bits >> _SHIFT_30)) * _MIX_1
    bits = (bits ^ (bits >> _SHIFT_27)) * _MIX_2
    return bits ^ (bits >> _SHIFT_31)


@compiled_in_place
def draw_uniform(slot: "Slot") -> float:
    """Draw from [0, 1)."""
    return float(draw_bits(slot) >> _SHIFT_11) * 2.0**-53


@compiled_in_place
def draw_normal(slot: "Slot") -> float:
    """Draw a number of mean 0 and deviation 1, close to normal and never beyond 3.47.

    The sum of four 16-bit uniforms costs one draw and no logarithm; a scan needs 720 of them.
    """
    bits = draw_bits(slot)
    total = (
        float(bits & _LOW_16)
        + float((bits >> _SHIFT_16) & _LOW_16)
        + float((bits >> _SHIFT_32) & _LOW_16)
        + float(bits >> _SHIFT_48)
    )
    return (total - _MEAN_OF_FOUR) / _DEVIATION_OF_FOUR
