"""The strip measured next to a curve in NumPy, as :func:`stripfold.kernels.lines.follow` does it."""

from __future__ import annotations

import numpy as np

from stripfold import kernels
from stripfold.base.arrays import Array, Picture
from stripfold.film import cross_sections as sections
from stripfold.film.smoothing import smoothed


def free_side(curve: Array, across: Array, width: Array, layer: int) -> Array:
    """On which side of each point only its outer edge is clear of another layer."""
    curve, across = np.ascontiguousarray(curve), np.ascontiguousarray(across)
    return np.asarray(kernels.sections.free_side(curve, across, width, layer, sections.CLEAR))


def edges_beside(image: Picture, points: Array, across: Array, width: Array, side: Array) -> sections.Edges:
    """Edges of a bright band; the centre is half of ``width`` from that on a ``side`` that is not 0."""
    profiles = sections.sample(image, points, across, sections.search_range(width) + 1, True)
    *values, found = kernels.sections.edges(profiles, width, side, sections.THIN)
    return sections.Edges._make([*values, found > 0.0])


def follow(
    image: Picture,
    curve: Array,
    offset: Array,
    ends: Array,
    width: Array,
    contrast: Array,
    layers: Array,
    cutoff: float,
    limits: tuple[float, ...],
) -> tuple[float, float, Array, Array, Array, Array] | None:
    """Share and longest gap, curve, width, contrast and scores of a bright strip; None where hardly any is seen."""
    least, _, _, _, tolerance, hidden, converged, learning, widest = limits
    sizes = sections.rounded(width)

    def scored(centres: Array, edges: sections.Edges) -> Array:
        score = sections.score_of(edges, width, contrast, tolerance)
        return score * sections.on_own_layer(centres, curve, int(layers[0]))

    def set_ends(offset: Array, score: Array) -> None:
        offset[[0, -1]], score[[0, -1]] = np.einsum("ij,ij->i", ends - curve[[0, -1]], across[[0, -1]]), 1.0

    across = sections.normals(curve)
    centres = curve + offset[:, None] * across
    side = free_side(curve, across, width, int(layers[1]))
    score = scored(centres, edges_beside(image, centres, across, sizes, side))
    score *= sections.inside(centres, image.shape)
    if np.sum(score >= least) < 6:
        return None
    set_ends(offset, score)
    curve = curve + sections.smooth_offsets(offset, score, 2.0 * cutoff)[:, None] * across
    for _ in range(2):
        across = sections.normals(curve)
        side = free_side(curve, across, width, int(layers[1]))
        edges = edges_beside(image, curve, across, np.where(side != 0.0, width, sizes), side)
        seen = sections.inside(curve, image.shape)
        score = scored(curve + edges.offset[:, None] * across, edges) * seen
        score[np.abs(edges.offset) > 0.5 * width + 1.0] = 0.0
        good = score >= least
        if good.sum() < 6:
            return None
        offset, merged = sections.strip_offset(edges, width, good, cutoff)
        offset = np.where(good, offset, 0.0)
        done = np.abs(offset).max() < converged
        set_ends(offset, score)
        centres = curve + offset[:, None] * across
        curve, _ = sections.smooth_centres(centres, edges.noise, score, across, cutoff, hidden)
        if done:
            break
    rate = np.where((score > least) & ~merged & (side == 0.0), learning, 0.0)
    one = np.ones(len(curve))
    width = width + smoothed(rate * (np.clip(edges.width, 0.7 * width, 1.4 * width) - width), one, 5.0)
    contrast = contrast + smoothed(rate * (edges.contrast - contrast), one, 5.0)
    gap = max(map(len, "".join("x" if h else " " for h in ~good & seen).split()), default=0) / len(good)
    return (
        float(good[seen].mean()),
        gap,
        curve,
        np.maximum(np.minimum(width, widest), 1.0),
        np.maximum(contrast, 1.0),
        score,
    )
