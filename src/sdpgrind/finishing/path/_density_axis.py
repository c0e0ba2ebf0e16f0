"""One direction of the spline of a surface's area density, on a mesh that narrows towards kinks."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from math import factorial
from typing import Self

import numpy as np
from scipy.interpolate import make_interp_spline

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.finishing.surface._surface import Surface

DEGREE = 5  # chosen: the map keeps two continuous derivatives
GOOD = 1e-6  # chosen: relative error of the density, root mean square by area
# chosen: limits of the halvings, and of the cells in one direction or, on surfaces of many, in a knot span
HALVINGS, CELLS, SPAN_CELLS = 30, 400, 8
PROBES = np.array([0.2, 0.7])  # of a cell, chosen: places between the sites
EVERY = slice(None)
INSIDE = 1e-12  # of a section, chosen: a knot at which the density may jump belongs to the section after it


@dataclass(frozen=True)
class Section:
    """A stretch in which the surface has two derivatives: `breaks` of the spline, `sites` to interpolate."""

    breaks: Floats
    sites: Floats

    @classmethod
    def of(cls, breaks: Floats) -> Self:
        """Return the section with means of the spline's knots as sites."""
        ends = _clamped(breaks)
        sites = np.convolve(ends[1:-1], np.full(DEGREE, 1.0 / DEGREE), mode="valid")
        return cls(breaks, np.clip(sites, breaks[0], breaks[-1] - INSIDE * (breaks[-1] - breaks[0])))

    def powers(self, values: Floats) -> Floats:
        """Interpolate (sites, ...), as polynomials (cells, degree + 1, ...) over 0 to 1 in each cell."""
        spline = make_interp_spline(self.sites, values, k=DEGREE, t=_clamped(self.breaks))
        width = np.diff(self.breaks).reshape(-1, *(1,) * (values.ndim - 1))
        return np.stack(
            [spline(self.breaks[:-1], nu=a) * width**a / factorial(a) for a in range(DEGREE + 1)], axis=1
        )


@dataclass(frozen=True)
class DensityAxis:
    """The sections of one direction of a surface."""

    sections: tuple[Section, ...]

    @classmethod
    def of(cls, surface: Surface, axis: int) -> Self:
        """Return two cells a knot span, cut where the surface lacks two derivatives."""
        places = surface.breaks[axis]
        count = np.count_nonzero(surface.knots[axis][:, None] == places, axis=0)
        cuts = np.unique(
            np.concatenate([[0], np.flatnonzero(surface.degree[axis] - count < 2), [len(places) - 1]])
        )
        return cls(tuple(Section.of(_halved(places[a : b + 1])) for a, b in pairwise(cuts)))

    @property
    def sites(self) -> Floats:
        """Places of interpolation."""
        return np.concatenate([section.sites for section in self.sections])

    @property
    def breaks(self) -> Floats:
        """Ends of all cells."""
        inner = [section.breaks[:-1] for section in self.sections]
        return np.append(np.concatenate(inner), self.sections[-1].breaks[-1])

    @property
    def probes(self) -> Floats:
        """Places for the error of the spline, two in each cell."""
        return np.asarray((self.breaks[:-1, None] + np.diff(self.breaks)[:, None] * PROBES).ravel())

    def powers(self, values: Floats) -> Floats:
        """Polynomials (cells, degree + 1, ...) for values (sites, ...)."""
        ends = np.cumsum([len(section.sites) for section in self.sections])[:-1]
        parts = zip(self.sections, np.split(values, ends), strict=True)
        return np.concatenate([section.powers(own) for section, own in parts])

    def finer(self, cells: Bools) -> Self:
        """Halve cells."""
        ends = np.cumsum([len(section.breaks) - 1 for section in self.sections])[:-1]
        parts = zip(self.sections, np.split(cells, ends), strict=True)
        return type(self)(tuple(Section.of(_halved(section.breaks, own)) for section, own in parts))


def fitted(axis: DensityAxis, density: Callable[[Floats], Floats]) -> DensityAxis:
    """Halve the cells with the largest error until a spline meets the density (m,) -> (m, k)."""
    most = max(CELLS, SPAN_CELLS * (len(axis.breaks) - 1) // 2)
    for _ in range(HALVINGS):
        error = _squares(axis, density)
        worst = np.argsort(error)[::-1][: max(most - len(error), 0)]
        coarse = np.zeros(len(error), bool)
        coarse[worst] = error[worst] > GOOD**2 / len(error)
        if not coarse.any():
            break
        axis = axis.finer(coarse)
    return axis


def _squares(axis: DensityAxis, density: Callable[[Floats], Floats]) -> Floats:
    """Each cell's part of the mean squared relative error by area."""
    true = density(axis.probes)
    powers = axis.powers(density(axis.sites))
    found = np.einsum("pa,iak->ipk", PROBES[:, None] ** np.arange(DEGREE + 1), powers).reshape(true.shape)
    off = (found - true) ** 2 / np.maximum(true, np.finfo(float).tiny)
    width = np.diff(axis.breaks)
    each, area = (values.reshape(len(width), -1).sum(axis=1) * width for values in (off, true))
    return np.asarray(each / area.sum())


def _halved(breaks: Floats, cells: Bools | slice = EVERY) -> Floats:
    return np.sort(np.concatenate([breaks, (0.5 * (breaks[:-1] + breaks[1:]))[cells]]))


def _clamped(breaks: Floats) -> Floats:
    return np.concatenate([np.full(DEGREE, breaks[0]), breaks, np.full(DEGREE, breaks[-1])])
