"""Colours of machines and states: numbers in, `#rrggbb` out.

States that are near each other in their machine look alike and states far apart do not, so a ribbon of
states can be read without its labels: along a grid the lightness says how far the joints are from their
lowest levels together and the hue which of them (the inner or the outer joints); along a cycle the hue is
the place on it. Colours are made in OKLCH, where equal steps look equal (B. Ottosson, "A perceptual color
space for image processing", 2020). Machines take Okabe and Ito's palette, which survives colour blindness.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

# Okabe and Ito, "Color universal design", 2008, without black and yellow: those vanish on one of the backgrounds
MACHINE_COLORS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00")

_LIGHTEST, _DARKEST = 0.91, 0.60  # lightness of a grid's first and last state; black text reads on both
_CHROMA_LOW, _CHROMA_HIGH = 0.045, 0.135  # inside sRGB for every hue used here
_GRID_HUE, _GRID_HUE_SPAN = 235.0, 75.0  # degrees: blue in the middle, green for inner, violet for outer joints
_CYCLE_LIGHTNESS, _CYCLE_CHROMA = 0.78, 0.11

# OKLab to linear sRGB, both matrices from Ottosson's page
_LAB_TO_LMS: Final = np.array(
    [
        [1, 0.3963377774, 0.2158037573],
        [1, -0.1055613458, -0.0638541728],
        [1, -0.0894841775, -1.2914855480],
    ]
)
_LMS_TO_RGB: Final = np.array(
    [
        [4.0767416621, -3.3077115913, 0.2309699292],
        [-1.2684380046, 2.6097574011, -0.3413193965],
        [-0.0041960863, -0.7034186147, 1.7076147010],
    ]
)

Floats = NDArray[np.float64]


def machine_color(machine: int) -> str:
    """Colour of a machine, -1 the root; repeats after six."""
    return "#777777" if machine < 0 else MACHINE_COLORS[machine % len(MACHINE_COLORS)]


def hex_colors(lightness: Floats, chroma: Floats, hue_deg: Floats) -> tuple[str, ...]:
    """OKLCH to hexadecimal sRGB, out-of-gamut values clipped; all of shape (n,)."""
    hue = np.deg2rad(hue_deg)
    lab = np.stack([lightness, chroma * np.cos(hue), chroma * np.sin(hue)], axis=-1)
    linear = np.clip((lab @ _LAB_TO_LMS.T) ** 3 @ _LMS_TO_RGB.T, 0.0, 1.0)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    bytes_ = np.round(255 * encoded).astype(int)
    return tuple(f"#{r:02x}{g:02x}{b:02x}" for r, g, b in bytes_.tolist())


def grid_colors(fraction: Floats) -> tuple[str, ...]:
    """Colours of grid states from how far each joint is along its levels, shape (n_state, n_joint), 0 to 1."""
    if fraction.shape[1] == 0:
        return hex_colors(*(np.full(len(fraction), x) for x in (_LIGHTEST, _CHROMA_LOW, _GRID_HUE)))
    bend = fraction.mean(axis=1)
    half = (fraction.shape[1] + 1) // 2
    lean = fraction[:, -half:].mean(axis=1) - fraction[:, :half].mean(axis=1)
    lightness = _LIGHTEST + (_DARKEST - _LIGHTEST) * bend
    chroma = _CHROMA_LOW + (_CHROMA_HIGH - _CHROMA_LOW) * np.clip(bend * 1.4, 0, 1)
    return hex_colors(lightness, chroma, _GRID_HUE + _GRID_HUE_SPAN * lean)


def cycle_colors(at: Floats) -> tuple[str, ...]:
    """Colours round a cycle from the place on it, shape (n_state,), 0 to 1; NaN (beside the cycle) is grey."""
    beside = np.isnan(at)
    chroma = np.where(beside, 0.0, _CYCLE_CHROMA)
    return hex_colors(np.full(len(at), _CYCLE_LIGHTNESS), chroma, 250 + 360 * np.nan_to_num(at))


def category_colors(count: int) -> tuple[str, ...]:
    """Colours of `count` named states, all different: hues by the golden angle in two lightnesses."""
    index = np.arange(count, dtype=float)
    return hex_colors(0.84 - 0.12 * (index % 2), np.full(count, 0.10), 230 + 137.50776 * index)
