"""A planned sequence in few bands, and exactly what following them loses."""

import os
from dataclasses import astuple
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.weldbead.sequence._action import SequenceAction
from sdpgrind.weldbead.sequence._as_sdp import as_planned
from sdpgrind.weldbead.sequence._band_sheet import Band, BandSheet, at_height
from sdpgrind.weldbead.sequence._sheet_file import ending_of
from sdpgrind.weldbead.sequence._simplified import Covered, bands_of, followed, intervals_of

FINER = 8  # chosen: heights in a cell between ends of bands; 16 change the largest loss by less than a tenth


class SimplifiedPolicy:
    """Bands of height (mm) by time left (s), each with one duration (s) and one force (N), for operators.

    Made by `SequencePolicy.simplified`, or by `SequencePolicy.following` from a sheet. A controller follows
    it as it does a policy, and does not learn the bead.

    Parameters
    ----------
    policy : SequencePolicy
        Plan that was simplified.
    planned : array
        Its expected penalty at the heights of bands, $, [stage, height].
    found : Covered
        Bands at these heights, and what following them costs.
    """

    def __init__(self, policy: Any, planned: Floats, found: Covered) -> None:
        self.policy, self.problem, self._found = policy, policy.problem, found
        self._lost, self.method = found.value - planned, policy.method

    @property
    def loss(self) -> float:
        """Largest expected penalty that the bands add to that of the plan, at the heights of `bands`, $."""
        return float(self._lost.max())

    @property
    def mean_loss(self) -> float:
        """Mean of what they add over these heights, $."""
        return float(self._lost.mean())

    @property
    def loss_between(self) -> float:
        """Largest expected penalty that they add at any height, also between those, $."""
        return float(self._between[1].max())

    @cached_property
    def _between(self) -> tuple[Floats, Floats]:
        """Expected penalty of following the bands, and what it is above the plan, $, between their ends."""
        nodes = FINER * (self._found.value.shape[1] - 1) + 1
        value = followed(as_planned(self.problem, self.method), self._lines, nodes).value
        return value, value - self.policy.planned_on(nodes)

    @cached_property
    def _lines(self) -> list[list[tuple[float, float, float]]]:
        """By stage: up to, mm; duration, s; force, N."""
        return [[(b.up_to, b.duration, b.normal_force) for b in line] for line in self.bands]

    @cached_property
    def dataset(self) -> xr.Dataset:
        """Bands as labelled columns, mm, s and N (dimension: band)."""
        columns = zip(*(astuple(band) for line in self.bands for band in line), strict=True)
        units = {"time_left": "s", "above": "mm", "up_to": "mm", "duration": "s", "normal_force": "N"}
        named = zip(units.items(), columns, strict=True)
        return xr.Dataset({name: ("band", list(values), {"units": unit}) for (name, unit), values in named})

    @cached_property
    def bands(self) -> tuple[tuple[Band, ...], ...]:
        """Bands by stage of time left (s), from the target up (mm)."""
        return bands_of(self.problem, self._found)

    @property
    def intervals(self) -> int:
        """Number of height ranges (mm) with one duration (s), or of stopping, over all stages."""
        return intervals_of(self._found.rows, self._found.choice)

    def value(self, height: Any, time_left: Any) -> Any:
        """Return the expected penalty of following the bands, $, from `height` (mm) and `time_left` (s)."""
        height, stage = np.broadcast_arrays(np.asarray(height, dtype=float), self._stage(time_left))
        if np.max(height, initial=0.0) > self.problem.height_max * (1 + 1e-9):
            raise checks.refuse("height", f"<= height_max, {self.problem.height_max:g}", height.max(), "mm")
        nodes = np.linspace(0.0, self.problem.height_max, self._found.value.shape[1])
        found = [
            np.interp(x, nodes, self._found.value[k]) if x > 0 else float(self.problem.height_charge(x))
            for x, k in zip(height.ravel().tolist(), stage.ravel().tolist(), strict=True)
        ]
        return np.array(found).reshape(height.shape)[()]

    def _stage(self, time_left: Any) -> Any:
        stage = np.floor(np.asarray(time_left, dtype=float) / self.problem.stage + 1e-9).astype(np.int64)
        return np.clip(stage, 0, len(self._found.value) - 1)

    def action(self, height: float, time_left: float) -> SequenceAction:
        """Return the action of the band at a height (mm) and a time left (s); its gap is not known: NaN."""
        height = checks.number("height", height, "mm")
        line = self._lines[int(self._stage(checks.number("time_left", time_left, "s")))]
        duration, force = at_height(line, height)
        if height <= 0 or duration == 0:
            return SequenceAction(True, 0.0, np.nan, np.nan, np.nan, self.problem)
        return SequenceAction(False, duration, self.problem.feed_rate(duration), force, np.nan, self.problem)

    def operator_table(self, path: str | os.PathLike[str] | None = None) -> BandSheet:
        """Return the bands (mm, s, N) as a sheet, and write it to a `path`: ``.html``, ``.txt`` or ``.csv``.

        A line holds until the next one, so stages with equal bands share theirs.
        """
        if path is not None:
            ending_of(path)  # refused before the work
        kept = [
            line for k, line in enumerate(self.bands) if k == 0 or _told(line) != _told(self.bands[k - 1])
        ]
        sheet = BandSheet(tuple(band for line in kept for band in line), self._sentences)
        if path is not None:
            sheet.save(path)
        return sheet

    @property
    def _sentences(self) -> tuple[str, ...]:
        high, left = self.problem.height_max, self.problem.horizon
        value, lost = self._between
        return (
            "Measure the height; take the last line whose time is not above the time left, and in it the "
            "first band that reaches the height: duration of the next pass, reset included, and its force.",
            f"At the target height, stop. Above {high:g} mm the last band holds; with more than {left:g} s "
            "left, the last line.",
            f"Following the sheet costs up to {lost.max():.2g} $ and on average {lost.mean():.2g} $ more "
            f"than the plan; from {high:g} mm and {left:g} s it costs {float(value[-1, -1]):.4g} $.",
        )

    def __repr__(self) -> str:
        count = sum(map(len, self.bands))
        return f"SimplifiedPolicy({self.intervals} intervals, {count} bands, loses at most {self.loss:.2g} $)"


def _told(line: tuple[Band, ...]) -> list[tuple[float, float, float]]:
    """What a line says, but for its time."""
    return [(band.up_to, band.duration, -1.0 if band.duration == 0 else band.normal_force) for band in line]
