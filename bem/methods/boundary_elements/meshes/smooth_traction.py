"""The traction between the nodes: cubics that follow a smooth one, or lines where there is a kink.

With adhesion the traction is a smooth function of the radius. A cubic through four selected nodes gives it at the nodes
of the master grid between them, and the hats of the master grid get values corrected by their second differences, so
that they displace the surface as the smooth traction does. The errors of both fall with nearly the fourth power of the
spacing, those of lines with the second, so that far fewer nodes are needed. Without adhesion the traction has a kink at
the edge of the contact, and lines are used. On a grid that moves, whose spacing is not equal, cubics are needed most:
a crack in a glass meets errors of the frozen traction that lines leave, and is held or let go by them.

Units: radii in spacings of the lattice.
Source: the mean of the error of linear interpolation, K. Atkinson, An Introduction to Numerical Analysis, 1989, section
5.1.
"""

import numpy as np

from bem._support.jit import kernel


def smooth_influence(hats: np.ndarray) -> np.ndarray:
    """Influence (N, N) of a smooth traction given at unit spacing, from that of hats at radii 0, 1, 2, ...

    Lines between the nodes lie above a convex traction, in the mean by a twelfth of its second difference. Subtracted
    from the values, this leaves an error of the fourth order far away, and a small one of the third near by.
    """
    smooth = 7.0 / 6.0 * hats
    smooth[1:] -= hats[:-1] / 12.0
    smooth[:-1] -= hats[1:] / 12.0
    smooth[1] -= hats[0] / 12.0  # on the axis both neighbours are the same
    return smooth


@kernel
def bend_shares(places: np.ndarray, f: int) -> tuple[float, float, float]:
    """How much of the values at f - 1, f and f + 1 the mean error of lines about the node `f` of `places` (N,) is.

    The error of the two panels, a twelfth of the second derivative times the cube of their lengths, is given to the
    node between them.
    """
    if f == places.size - 1:
        return 0.0, 0.0, 0.0
    after = float(places[f + 1] - places[f])
    if f == 0:  # even at the axis
        return 0.0, -1.0 / 6.0, 1.0 / 6.0
    before = float(places[f] - places[f - 1])
    scale = (before * before - before * after + after * after) / (6.0 * (before + after))
    return scale / before, -scale * (1.0 / before + 1.0 / after), scale / after


@kernel
def smooth_influence_of(places: np.ndarray, hats: np.ndarray) -> np.ndarray:
    """As `smooth_influence`, at any `places` (N,)."""
    size = places.size
    smooth = np.empty((size, size))
    for f in range(size):
        _, middle, _ = bend_shares(places, f)
        for i in range(size):
            smooth[f, i] = (1.0 - middle) * hats[f, i]
        if f > 0:
            _, _, right = bend_shares(places, f - 1)
            for i in range(size):
                smooth[f, i] -= right * hats[f - 1, i]
        if f < size - 1:
            left, _, _ = bend_shares(places, f + 1)
            for i in range(size):
                smooth[f, i] -= left * hats[f + 1, i]
    return smooth


@kernel
def interpolation(nodes: np.ndarray, places: np.ndarray, smooth: bool) -> tuple[np.ndarray, np.ndarray]:
    """How the traction at master nodes follows from that at selected nodes.

    Args:
        nodes: (n,) int64, the selection, from the axis outwards.
        places: (N,) int64 of the master nodes.
        smooth: cubics through four nodes, even at the axis, else lines.

    Returns:
        first (N,) and shares (N, 4): the traction at each is a sum over four nodes from `first` on, with these shares.
    """
    n, size = nodes.size, places.size
    first, shares = np.zeros(size, dtype=np.int64), np.zeros((size, 4))
    at = np.empty(4)
    for j in range(n - 1):
        begin = min(max(j - 1, 0), max(n - 4, 0))
        inner = j - begin
        for f in range(nodes[j], nodes[j + 1] + (j == n - 2)):
            first[f] = begin
            if f == nodes[j]:
                shares[f, inner] = 1.0
            elif f == nodes[j + 1]:
                shares[f, inner + 1] = 1.0
            elif not smooth or n < 4:
                share = (places[f] - places[nodes[j]]) / (places[nodes[j + 1]] - places[nodes[j]])
                shares[f, inner], shares[f, inner + 1] = 1.0 - share, share
            else:
                for k in range(4):
                    at[k] = places[nodes[begin + k]]
                if j == 0:  # the traction is even: the node before the axis is the mirror image of the one after it
                    at[0], at[1], at[2], at[3] = -places[nodes[1]], 0.0, places[nodes[1]], places[nodes[2]]
                for k in range(4):
                    weight = 1.0
                    for m in range(4):
                        if m != k:
                            weight *= (places[f] - at[m]) / (at[k] - at[m])
                    if j > 0:
                        shares[f, k] = weight
                    else:
                        shares[f, abs(k - 1)] += weight
    return first, shares


@kernel
def ring_area(places: np.ndarray, f: int, last: int, smooth: bool) -> float:
    """Force in pi R dgamma of a unit traction at master node `f`, over the square of the lattice spacing.

    That of a hat; where the traction is `smooth` the neighbours share it as in `smooth_influence`.
    """
    if not smooth:
        return _hat_area(places, f, last)
    if places[last] == last:  # equally spaced: only on the axis does a correction change the force
        return _hat_area(places, f, last) - (1.0 / 9.0 if f == 0 else 1.0 / 18.0 if f == 1 else 0.0)
    _, middle, _ = bend_shares(places, f)
    area = (1.0 - middle) * _hat_area(places, f, last)
    if f > 0:
        _, _, right = bend_shares(places, f - 1)
        area -= right * _hat_area(places, f - 1, last)
    if f < last:
        left, _, _ = bend_shares(places, f + 1)
        area -= left * _hat_area(places, f + 1, last)
    return area


@kernel
def _hat_area(places: np.ndarray, f: int, last: int) -> float:
    """`ring_area` of a hat."""
    area, at = 0.0, float(places[f])
    if f > 0:
        area += (at - places[f - 1]) * (places[f - 1] + 2.0 * at) / 3.0
    if f < last:
        area += (places[f + 1] - at) * (2.0 * at + places[f + 1]) / 3.0
    return area
