"""Kalman track of slowly changing quantities over the parts, with alarms at steps."""

from collections.abc import Mapping
from typing import Any, Self

import numpy as np
import xarray as xr

from centering.monitoring import _part_record as part_record
from centering.monitoring._alarm import UNITS, DriftAlarm, units_of
from centering.monitoring._sequential import cusum_detection, cusum_limit, is_missing, learned_widening
from centering.monitoring._tracked import FEWEST, REFERENCE, Tracked
from sdpgrind.base import checks, pictures
from sdpgrind.base.brief import counted
from sdpgrind.base.records import Record
from sdpgrind.base.reported import Reported
from sdpgrind.identify import Estimate, RandomWalk, Status


class DriftTrack(Reported, Record):
    """Track of slowly changing quantities over parts, with an alarm when one steps.

    Each quantity is a random walk: ``level <- level + walk noise_sd w``, ``reading = level + noise_sd e``,
    with w and e normal and independent. The Kalman filter (`sdpgrind.identify.RandomWalk`) averages over some
    1/walk parts; without a step its standardised innovations are independent and standard normal. Their
    two-sided cumulative sum has a limit for one false alarm of all quantities in `parts_per_false_alarm`
    parts on average. For the delay after a step see `detection_probability`.

    After an alarm the level is that of the readings since the step, and the quantity is not watched until
    `acknowledge`. A steady trend is also reported as a step: one of 0.02 sd per part alarms after some 130
    parts, of 0.05 sd after 45; "since" is then the part at which it exceeded the noise.

    Parameters
    ----------
    noise_sd : mapping of str to float or None, optional
        Quantities, and the standard deviation of a reading about the level, in the unit of the quantity.
        None: learned from the innovations before the last 10 parts, with Student's distribution in place of
        the normal one and a higher limit for the same rate of false alarms. Alarms are then possible from the
        32nd part on; a step of 3 sd is found within 5 parts with probability 0.96 after 40 parts, 0.988 after
        100, 0.992 after 200 (0.993 with a known one). Where readings are all alike, their rounding is assumed
        to be the first change: a lasting change is found with the second or third part. Default: None for
        "stroke_offset" (mm: P of Mears (6.16), the running correction of the push for the closing gap of
        probe and part and the shortfall of the stroke) and "mu_kinetic" (1: sliding friction).
    walk : float
        Standard deviation of the walk per part over that of a reading, unit 1. Too small a value causes
        alarms: 0.03 with a true 0.06 once in 790 parts for 2000 wanted, with 0.1 once in 260.
    units : mapping of str to str, optional
        Units. Default: mm ("mu_kinetic": 1).
    parts_per_false_alarm : float
        Mean number of parts between false alarms of all quantities, unit 1.

    Raises
    ------
    ValueError
        If a number is not > 0, or the parts between false alarms are not within 10 and 1e8.
    TypeError
        If there is no quantity, or a unit is no text.

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
        """Forget all parts."""
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
        self._acknowledged: list[tuple[int, str]] = []  # number of parts before it, quantity
        self._count = 0

    @property
    def count(self) -> int:
        """Number of parts so far."""
        return self._count

    @property
    def limit(self) -> float:
        """Limit of the cumulative sums for a known noise, in standard deviations, unit 1; see `dataset`."""
        return self._limit

    def update(self, **readings: float) -> tuple[DriftAlarm, ...]:
        """Take in one part.

        Parameters
        ----------
        **readings
            Quantities by name, in their units; left out or NaN: no reading.

        Returns
        -------
        tuple of DriftAlarm
            New alarms.

        Raises
        ------
        ValueError, TypeError
            For an unknown name, or a value that is no number.
        """
        for name, reading in readings.items():
            checks.one_of("readings", name, self._tracks)
            if not is_missing(reading):
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
        """Alarms not yet acknowledged; quantities in their units."""
        return tuple(track.alarm for track in self._tracks.values() if track.alarm is not None)

    @property
    def history(self) -> tuple[DriftAlarm, ...]:
        """All alarms so far; quantities in their units."""
        return tuple(self._past)

    def acknowledge(self, *names: str) -> None:
        """Watch a quantity again after an alarm: its level (in its unit) starts anew with the next part.

        Parameters
        ----------
        *names
            Quantities. Default: all with an alarm.

        Raises
        ------
        ValueError
            For an unknown name.
        """
        for name in names or [alarm.quantity for alarm in self.alarms]:
            self._tracks[checks.one_of("names", name, self._tracks)].restart()
            self._acknowledged.append((self._count, name))

    @property
    def estimate(self) -> Estimate:
        """Levels after the last part with covariance, in their units; undetermined before all were read."""
        levels = [track.level for track in self._tracks.values()]
        values, sds = (np.array(column) for column in zip(*levels, strict=True))
        status = Status.OK if np.all(np.isfinite(sds)) else Status.UNDETERMINED
        return Estimate(
            tuple(self._tracks), values, np.diag(sds**2), status, units=tuple(self._units.values())
        )

    def detection_probability(self, step: float = 3.0, within: int = 5, after: int = 100) -> float:
        """Return the probability of finding a step of one quantity in time, for a known `noise_sd`.

        It is a lower bound, for a sum of 0 at the step, by the Markov chain of the sum.

        Parameters
        ----------
        step : float
            Size of the step in standard deviations of a reading, unit 1.
        within : int
            Parts after the step up to the alarm, the first changed one included.
        after : int
            Parts before the step, >= 1; fewer leave the level less certain.
        """
        size = checks.number("step", step, "1")
        parts, before = checks.count("within", within), checks.count("after", after)
        walk, means = RandomWalk(("level",), walk_variance=self._walk**2, noise_variance=1.0), []
        for reading in [0.0] * before + [abs(size)] * parts:
            walk.update(reading)
            means.append(float(walk.innovation[0] / walk.innovation_sd[0]))
        return cusum_detection(REFERENCE, self._limit, means[before:])

    @property
    def dataset(self) -> xr.Dataset:
        """Readings (NaN: none), levels, sums (the greater side, signed, unit 1) and limits over the parts.

        A limit is infinite until a learned noise is known; a sum is NaN from an alarm until `acknowledge`.
        """
        data = {}
        for name, track in self._tracks.items():
            rows = np.array(track.rows).reshape(-1, 4)
            units = (self._units[name], self._units[name], "1", "1")
            for column, suffix, unit in zip(rows.T, ("", "_level", "_sum", "_limit"), units, strict=True):
                data[name + suffix] = ("part", column, {"units": unit})
        return xr.Dataset(data, {"part": np.arange(self._count)}, {"limit": self._limit})

    def plot(self) -> Any:
        """Draw readings, levels and sums over the parts, in their units, with alarms; return the figure."""
        return pictures.drawn("centering.monitoring._drift_picture:plot", self)

    def _written(self) -> xr.Dataset:
        settings = {
            "noise_sd": self._given, "units": self._units, "walk": self._walk,
            "parts_per_false_alarm": self._parts, "acknowledged": self._acknowledged,
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
        """Repeat the acknowledgements made after the present number of parts."""
        while acknowledged and acknowledged[0][0] == self._count:
            self.acknowledge(acknowledged.pop(0)[1])

    def __repr__(self) -> str:
        told = "; ".join(map(str, self.alarms)) or "no alarm"
        return f"DriftTrack({', '.join(self._tracks)} over {counted(self._count, 'part')}: {told})"


def _quantities(
    noise_sd: Mapping[str, float | None], units: Mapping[str, str] | None
) -> dict[str, float | None]:
    """Checked names and noise of the quantities."""
    if not isinstance(noise_sd, Mapping) or not noise_sd:
        raise TypeError(
            f"noise_sd must be a mapping of names to numbers or None; got {checks.shown(noise_sd)}"
        )
    unit = units_of(noise_sd, units)
    return {
        name: None if sd is None else checks.positive(f"noise_sd[{name!r}]", sd, unit[name])
        for name, sd in noise_sd.items()
    }
