"""Stroke correction and friction over the parts: a Kalman track of each, with alarms that say when it stepped."""

from collections.abc import Mapping
from typing import Any, Self

import numpy as np
import xarray as xr

from centering.monitoring import _part_record as part_record
from centering.monitoring._alarm import UNITS, DriftAlarm, units_of
from centering.monitoring._sequential import cusum_detection, cusum_limit, learned_widening, not_read
from centering.monitoring._tracked import FEWEST, REFERENCE, Tracked
from sdpgrind.base import checks, pictures
from sdpgrind.base.records import Record
from sdpgrind.identify import Estimate, RandomWalk, Status


class DriftTrack(Record):
    """Track slowly changing quantities over parts, and alarm when one steps.

    Each quantity walks at random: ``level <- level + walk noise_sd w``, ``reading = level + noise_sd e``, with w and e normal and
    independent. The Kalman filter of that (`sdpgrind.identify.RandomWalk`) gives the level, as an average over some 1/walk parts;
    its innovations over their standard deviations are independent and standard normal as long as nothing but the walk happens.
    They go into a two-sided cumulative sum whose limit is computed so that all quantities together alarm by mistake once in
    `parts_per_false_alarm` parts on average. After a step the filter follows it, but the alarm is sooner: see
    `detection_probability`.

    After an alarm the level rests on the readings since the step alone, and the quantity is not watched until `acknowledge`: the
    alarm, the representation and the picture say so. Every alarm is told as a step, that of a steady trend too: one of 0.02 sd a
    part alarms after some 130 parts, and "since" is then only where it stood out of the noise.

    Parameters
    ----------
    noise_sd : mapping of str to float or None, optional
        Quantities, and the standard deviation of a reading about the level, in the unit of the quantity; None: it is learned from
        the innovations, those of the last 10 parts left aside, and Student's law takes the place of the normal one. Alarms may
        come from the 32nd part on, as seldom as with a known one: the limit stands higher by as much as that takes. So a step of
        3 sd is flagged within 5 parts with 0.96 after 40 parts, 0.988 after 100, 0.992 after 200 (0.993 with a known one). Where
        readings are all alike, their rounding is taken to be the first change: a change that stays is flagged with the second or
        third part. By default "stroke_offset" (mm: P of Mears (6.16), the running correction of the push, which corrects the
        closing gap of probe and part and what the stroke fell short) and "mu_kinetic" (1: sliding friction), both None.
    walk : float
        Standard deviation of the walk per part over that of a reading, unit 1. Given too small it makes alarms: at 0.03, with a
        true one of 0.06 once in 790 parts where 2000 were asked for, of 0.1 once in 260. A steady drift is no walk: of 0.02 sd a
        part it alarms after 130 parts on average, of 0.05 sd after 45, as a step.
    units : mapping of str to str, optional
        Units; mm by default ("mu_kinetic": 1).
    parts_per_false_alarm : float
        Parts between false alarms on average, unit 1, over all quantities.

    Raises
    ------
    ValueError
        When a number is not > 0, or the parts between false alarms are not within 10 and 1e8.
    TypeError
        When there is no quantity, or a unit is no text.

    Examples
    --------
    >>> track = DriftTrack({"stroke_offset": 0.002, "mu_kinetic": 0.004})
    >>> quiet = [track.update(stroke_offset=0.150, mu_kinetic=0.135) for part in range(30)]
    >>> for part in range(2):
    ...     alarms = track.update(stroke_offset=0.157, mu_kinetic=0.135)
    >>> alarms[0].quantity, alarms[0].since, alarms[0].part
    ('stroke_offset', 30, 31)
    >>> alarms[0].advice
    'clean the locating faces and look for a shifted pusher, probe or zero'
    >>> round(track.estimate["stroke_offset"], 4), round(track.detection_probability(), 4)
    (0.157, 0.993)
    >>> track.acknowledge()
    >>> track.alarms
    ()
    """

    kind = "centering.drift"

    def __init__(
        self,
        noise_sd: Mapping[str, float | None] | None = None,
        *,
        units: Mapping[str, str] | None = None,
        walk: float = 0.03,
        parts_per_false_alarm: float = 2000.0,
    ) -> None:
        given = dict.fromkeys(UNITS) if noise_sd is None else _quantities(noise_sd, units)
        self._units = units_of(given, units)
        self._walk = checks.positive("walk", walk, "1")
        parts = checks.within("parts_per_false_alarm", parts_per_false_alarm, 10.0, 1e8, "1")
        self._parts = parts
        self._limit = cusum_limit(REFERENCE, parts * len(given))
        unknown = any(sd is None for sd in given.values())
        self._widening = learned_widening(REFERENCE, parts * len(given), FEWEST) if unknown else 0.0
        self._given = given
        self.reset()

    def reset(self) -> None:
        """Forget every part."""
        self._tracks = {
            name: Tracked(
                name,
                self._units[name],
                sd,
                walk=self._walk,
                limit=self._limit,
                widening=0.0 if sd else self._widening,
            )
            for name, sd in self._given.items()
        }
        self._past: list[DriftAlarm] = []
        self._acknowledged: list[tuple[int, str]] = []  # parts before it, quantity
        self._count = 0

    @property
    def count(self) -> int:
        """Number of parts so far."""
        return self._count

    @property
    def limit(self) -> float:
        """Limit of the cumulative sums for a known noise, unit 1 (standard deviations); `dataset` tells that of each part."""
        return self._limit

    def update(self, **readings: float) -> tuple[DriftAlarm, ...]:
        """Take in one part.

        Parameters
        ----------
        **readings
            Quantities by name, in their units; one that is left out, or NaN, was not read.

        Returns
        -------
        tuple of DriftAlarm
            New alarms, mostly none.

        Raises
        ------
        ValueError, TypeError
            For a name that is not tracked, or what is no number.
        """
        for name, reading in readings.items():
            checks.one_of("readings", name, self._tracks)
            if not not_read(reading):
                checks.number(name, reading, self._units[name])
        found = [
            track.update(self._count, float(readings.get(name, np.nan)))
            for name, track in self._tracks.items()
        ]
        new = tuple(alarm for alarm in found if alarm is not None)
        self._past.extend(new)
        self._count += 1
        return new

    @property
    def alarms(self) -> tuple[DriftAlarm, ...]:
        """Alarms that are not acknowledged; quantities in their units."""
        return tuple(track.alarm for track in self._tracks.values() if track.alarm is not None)

    @property
    def history(self) -> tuple[DriftAlarm, ...]:
        """Alarms so far, acknowledged or not; quantities in their units."""
        return tuple(self._past)

    def acknowledge(self, *names: str) -> None:
        """Say that the cause was seen to: the level (in the unit of its quantity) starts anew with the next part.

        Parameters
        ----------
        *names
            Quantities; by default all that alarm.

        Raises
        ------
        ValueError
            For a name that is not tracked.
        """
        for name in names or [alarm.quantity for alarm in self.alarms]:
            self._tracks[checks.one_of("names", name, self._tracks)].restart()
            self._acknowledged.append((self._count, name))

    @property
    def estimate(self) -> Estimate:
        """Levels after the last part with their covariance, each in its unit; undetermined while one was never read."""
        levels = [track.level for track in self._tracks.values()]
        values, sds = (np.array(column) for column in zip(*levels, strict=True))
        status = Status.OK if np.all(np.isfinite(sds)) else Status.UNDETERMINED
        return Estimate(
            tuple(self._tracks), values, np.diag(sds**2), status, units=tuple(self._units.values())
        )

    def detection_probability(self, step: float = 3.0, within: int = 5, after: int = 100) -> float:
        """Return how sure a step of one quantity is to be flagged in time, for a known `noise_sd`.

        It is the least probability, that of a sum at 0 when the step comes, by the Markov chain of the sum.

        Parameters
        ----------
        step : float
            Size of the step in standard deviations of a reading, unit 1.
        within : int
            Parts after the step that may be made until the alarm, the first changed one included.
        after : int
            Parts before the step, >= 1: the fewer, the less sure the filter is of the level.
        """
        size, parts, before = (
            checks.number("step", step, "1"),
            checks.count("within", within),
            checks.count("after", after),
        )
        walk, means = RandomWalk(("level",), walk_variance=self._walk**2, noise_variance=1.0), []
        for reading in [0.0] * before + [abs(size)] * parts:
            walk.update(reading)
            means.append(float(walk.innovation[0] / walk.innovation_sd[0]))
        return cusum_detection(REFERENCE, self._limit, means[before:])

    @property
    def dataset(self) -> xr.Dataset:
        """Readings, levels, sums (the greater side, signed, unit 1) and their limits over the parts; NaN where none was read.

        A limit is infinite as long as too little is known of a noise that is learned. A sum is NaN where the quantity is not
        watched, after an alarm until `acknowledge`.
        """
        data = {}
        for name, track in self._tracks.items():
            rows = np.array(track.rows).reshape(-1, 4)
            units = (self._units[name], self._units[name], "1", "1")
            for column, suffix, unit in zip(rows.T, ("", "_level", "_sum", "_limit"), units, strict=True):
                data[name + suffix] = ("part", column, {"units": unit})
        return xr.Dataset(data, {"part": np.arange(self._count)}, {"limit": self._limit})

    def plot(self) -> Any:
        """Draw readings and levels over the parts, in their units, the sums below, with alarms; return the figure."""
        return pictures.drawn("centering.monitoring._drift_picture:plot", self)

    def _written(self) -> xr.Dataset:
        settings = {
            "noise_sd": self._given, "units": self._units, "walk": self._walk, "parts_per_false_alarm": self._parts,
            "acknowledged": self._acknowledged,
        }  # fmt: skip
        readings = {name: [row[0] for row in track.rows] for name, track in self._tracks.items()}
        return part_record.dataset_of(readings, self._units, settings)

    @classmethod
    def restored(cls, dataset: xr.Dataset) -> Self:
        settings = part_record.settings_in(dataset)
        acknowledged = [(int(part), str(name)) for part, name in settings.pop("acknowledged")]
        track = cls(settings.pop("noise_sd"), **settings)
        for readings in part_record.parts_in(dataset):
            track._acknowledge_again(acknowledged)
            track.update(**readings)
        track._acknowledge_again(acknowledged)
        return track

    def _acknowledge_again(self, acknowledged: list[tuple[int, str]]) -> None:
        """Do what was acknowledged after as many parts as there are now."""
        while acknowledged and acknowledged[0][0] == self._count:
            self.acknowledge(acknowledged.pop(0)[1])

    def __repr__(self) -> str:
        told = "; ".join(map(str, self.alarms)) or "no alarm"
        return f"DriftTrack({', '.join(self._tracks)} over {self._count} parts: {told})"


def _quantities(
    noise_sd: Mapping[str, float | None], units: Mapping[str, str] | None
) -> dict[str, float | None]:
    """Names, and what is known of the noise of each."""
    if not isinstance(noise_sd, Mapping) or not noise_sd:
        raise TypeError(
            f"noise_sd must be a mapping of names to numbers or None; got {checks.shown(noise_sd)}"
        )
    unit = units_of(noise_sd, units)
    return {
        name: None if sd is None else checks.positive(f"noise_sd[{name!r}]", sd, unit[name])
        for name, sd in noise_sd.items()
    }
