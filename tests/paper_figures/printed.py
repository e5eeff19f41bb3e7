"""What a figure shows when it is printed: its texts, their boxes, and its colours as eyes see them."""

from itertools import combinations
from unittest import mock

import numpy as np
from matplotlib.colors import to_rgba
from matplotlib.legend import Legend
from matplotlib.text import Text

MILLIMETRES = 25.4
# Machado, Oliveira and Fernandes (2009), severity 1, on linear RGB.
EYES = {
    "trichromat": np.eye(3),
    "protanope": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranope": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "tritanope": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]
    ),
}
# Linear sRGB to XYZ over the white of D65.
XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)


def lab(color, eye="trichromat"):
    """CIELAB of a colour on white paper, as an eye sees it."""
    *rgb, alpha = to_rgba(color)
    rgb = 1.0 - alpha * (1.0 - np.array(rgb))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    xyz = XYZ @ np.clip(EYES[eye] @ linear, 0.0, 1.0) / XYZ.sum(axis=1)
    x, y, z = np.where(xyz > (6 / 29) ** 3, np.cbrt(xyz), xyz / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)])


def distance(first, second):
    """The least distance of two colours in CIELAB to any of the eyes."""
    return min(float(np.linalg.norm(lab(first, eye) - lab(second, eye))) for eye in EYES)


def texts(figure):
    """The texts that are drawn, without ticks beyond the axes."""
    texts, draw = [], Text.draw

    def drawn(text, renderer, *arguments, **named):
        if text.get_visible() and text.get_text().strip():
            texts.append(text)
        return draw(text, renderer, *arguments, **named)

    with mock.patch.object(Text, "draw", drawn):
        figure.draw_without_rendering()
    return list(dict.fromkeys(texts))


def overlaps(figure, drawn, slack=1.0):
    """Pairs of texts whose boxes share more than `slack` pixels in both directions, and texts beyond the figure."""
    boxes = [(text.get_text(), Text.get_window_extent(text).padded(-slack)) for text in drawn]
    pairs = [(first, second) for (first, a), (second, b) in combinations(boxes, 2) if a.overlaps(b)]
    page = figure.bbox.padded(2 * slack)
    return pairs + [
        (text, "the edge") for text, box in boxes if not (page.contains(*box.min) and page.contains(*box.max))
    ]


def colors(figure):
    """Colours that each legend of the figure tells apart, by their label."""
    legends = []
    for legend in figure.findobj(Legend):
        legends.append({})
        for handle, text in zip(legend.legend_handles, legend.get_texts(), strict=True):
            look = handle.get_color() if hasattr(handle, "get_color") else handle.get_facecolor()
            legends[-1][text.get_text()] = to_rgba(look[0] if np.ndim(look) == 2 else look)
    return legends
