"""The stretch of a locus for a controller: continuous, without fold or jump, over one coordinate."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self, TypeAlias

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.locus._path.law_kernels import find_many
from sdpgrind.locus._path.single_valued import check_hidden, check_single, told
from sdpgrind.locus._trace.segments import apart, bends
from sdpgrind.locus._trace.table import LocusTable

if TYPE_CHECKING:
    from sdpgrind.locus._path.calibration import Calibration


@dataclass(frozen=True)
class StretchPoint:
    """A point of a stretch, or many.

    Attributes
    ----------
    controls : dict
        Value of each control.
    hidden : float or array
        Hidden state with this optimum.
    limit : float or array
        P_b, equal to the response.
    loop_slope : float or array
        e_s: slope of the slack along the locus at this hidden state, per unit of the coordinate.

    Examples
    --------
    >>> from sdpgrind import locus
    >>> point = locus.plan(locus.preset("koren-example")).stretch("v").at(3.0)
    >>> round(point.controls["u"], 6), round(point.hidden, 6), round(point.limit, 6)  # without units
    (2.0, 1.0, 7.0)
    """

    controls: dict[str, Any]
    hidden: Any
    limit: Any
    loop_slope: Any


Values: TypeAlias = Callable[[Floats, Floats], tuple[Floats, Floats]]
"""Response and limit (...,) of controls (..., n) and hidden state (...,)."""
ENDS = ("range", "interior", "bound", "fold", "jump")
OUTSIDE = 1e-9  # chosen: share of the range; a coordinate may lie outside by rounding


@dataclass(frozen=True, eq=False, repr=False)
class Stretch:
    """The part of a locus for a controller, as tables with exact slopes by one coordinate.

    One measured constraint is active: response = limit. See `Locus.stretch`.

    Parameters
    ----------
    along : str
        Coordinate s: name of a control or of the hidden state.
    names : tuple of str
        Names of the n controls.
    hidden_name : str
        Name of the hidden state x.
    coordinate : array, (K,)
        s, strictly rising.
    controls, controls_slope : array, (K, n)
        Controls and their slopes by s.
    hidden, hidden_slope : array, (K,)
        x, strictly monotone, and dx/ds.
    limit, limit_slope : array, (K,)
        P_b, and dP_b/ds along the locus.
    response_slope : array, (K,)
        dP_c/ds along the locus at fixed x.
    ends : (str, str)
        Causes of the ends: "range", "interior" (the constraint becomes inactive), "bound", "fold", "jump".
    values : callable
        Response and limit (...,) of controls (..., n) and x (...,).
    response : str
        Name of the response.
    units : mapping
        Units of controls, hidden state and response.

    Raises
    ------
    ValueError
        When tables do not fit each other, or s or x is not strictly monotone.

    Examples
    --------
    >>> from sdpgrind import locus
    >>> stretch = locus.plan(locus.preset("koren-example")).stretch("v")
    >>> stretch
    Stretch(v from 0.109726 to 4, x from 0.5 to 20; ends: range, interior)
    >>> round(stretch.coordinate_of(1.0), 6), round(stretch.at(3.0).loop_slope, 6)
    (3.0, -1.5)
    >>> round(float(stretch.slack(3.0, 1.1)), 6)
    -0.3
    """

    along: str
    names: tuple[str, ...]
    hidden_name: str
    coordinate: Floats
    controls: Floats
    hidden: Floats
    limit: Floats
    response_slope: Floats
    controls_slope: Floats
    hidden_slope: Floats
    limit_slope: Floats
    ends: tuple[str, str]
    values: Values
    response: str = "response"
    units: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", checks.unique("names", self.names))
        checks.one_of("along", self.along, (*self.names, self.hidden_name))
        for end in self.ends:
            checks.one_of("ends", end, ENDS)
        self._check_tables()
        if not np.all(np.diff(self.coordinate) > 0):
            named = dict(zip((*self.names, self.hidden_name), (*self.controls.T, self.hidden), strict=True))
            raise ValueError(f"coordinate {self.along!r} must rise strictly; {told(named)}")
        check_hidden(self.hidden_name, self.hidden, self.hidden_slope)

    def _check_tables(self) -> None:
        rows = np.shape(self.coordinate)
        if len(rows) != 1 or rows[0] < 2:
            raise checks.refuse("coordinate", "a row of 2 numbers or more", rows)
        shapes = dict.fromkeys(("hidden", "limit", "response_slope", "hidden_slope", "limit_slope"), rows)
        wide = dict.fromkeys(("controls", "controls_slope"), (*rows, len(self.names)))
        for name, shape in {"coordinate": rows, **shapes, **wide}.items():
            array = checks.finite_array(name, getattr(self, name)).copy()
            if array.shape != shape:
                raise checks.refuse(name, f"of shape {shape}", array.shape)
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def __repr__(self) -> str:
        (low, high), name = self.x, self.hidden_name
        told = f"{self.along} from {self.low:.6g} to {self.high:.6g}, {name} from {low:.6g} to {high:.6g}"
        return f"Stretch({told}; ends: {', '.join(self.ends)})"

    def __deepcopy__(self, memo: object) -> Self:
        return self  # immutable

    @classmethod
    def of_curve(
        cls,
        along: str,
        *,
        names: Sequence[str],
        hidden_name: str,
        controls: Floats,
        hidden: Floats,
        limit: Floats,
        tangents: tuple[Floats, Floats, Floats, Floats],
        ends: tuple[str, str],
        values: Values,
        response: str = "response",
        units: Mapping[str, str] | None = None,
    ) -> Self:
        """Make a stretch from points in order along a curve.

        Parameters
        ----------
        along : str
            Coordinate.
        names, hidden_name, controls, hidden, limit, ends, values, response, units
            As of the class, in the order of the curve.
        tangents : arrays, (K, n), (K,), (K,), (K,)
            Slopes of controls, hidden state, limit, and response at fixed hidden state, by any parameter.

        Raises
        ------
        ValueError
            When the coordinate is not single-valued.
        """
        checks.one_of("along", along, (*names, hidden_name))
        controls, hidden, limit = apart(
            [*names, hidden_name].index(along), (controls, hidden, limit), tangents
        )
        place = dict(zip((*names, hidden_name), (*controls.T, hidden), strict=True))
        by = dict(zip(place, (*np.asarray(tangents[0]).T, tangents[1]), strict=True))
        check_single(along, place, by)
        speed, order = by[along], slice(None, None, 1 if place[along][-1] > place[along][0] else -1)
        slopes = [(np.asarray(t).T / speed).T[order] for t in tangents]
        return cls(
            along=along,
            names=tuple(names),
            hidden_name=hidden_name,
            coordinate=place[along][order],
            controls=controls[order],
            hidden=hidden[order],
            limit=limit[order],
            response_slope=slopes[3],
            controls_slope=slopes[0],
            hidden_slope=slopes[1],
            limit_slope=slopes[2],
            ends=ends if order.step == 1 else (ends[1], ends[0]),
            values=values,
            response=response,
            units=dict(units or {}),
        )

    @property
    def low(self) -> float:
        """Least coordinate, in its unit."""
        return float(self.coordinate[0])

    @property
    def high(self) -> float:
        """Greatest coordinate, in its unit."""
        return float(self.coordinate[-1])

    @cached_property
    def x(self) -> tuple[float, float]:
        """Least and greatest hidden state, in its unit."""
        return float(self.hidden.min()), float(self.hidden.max())

    @cached_property
    def loop_slope(self) -> Floats:
        """e_s (K,): slope of the slack along the locus at fixed x (units of response over coordinate)."""
        return self.limit_slope - self.response_slope

    @cached_property
    def table(self) -> LocusTable:
        """Controls, hidden state, limit, loop slope in their units: n + 3 columns by the coordinate."""
        values = np.column_stack([self.controls, self.hidden, self.limit, self.loop_slope])
        slopes = np.column_stack([self.controls_slope, self.hidden_slope, self.limit_slope, self._bend])
        return LocusTable(self.coordinate, values, slopes)

    @cached_property
    def slopes(self) -> LocusTable:
        """The loop slope alone by the coordinate, in its unit."""
        return LocusTable(self.coordinate, self.loop_slope[:, None], self._bend[:, None])

    @cached_property
    def _bend(self) -> Floats:
        """Slope of the loop slope."""
        return bends(self.coordinate, self.loop_slope)

    def rows(self, s: Any) -> Floats:
        """Return the columns of `table` (..., n + 3) at coordinates `s` (...,), clamped, in their units."""
        out = self.table.at(s)
        if self.along in self.names:
            own = np.minimum(np.maximum(s, self.low), self.high)  # in half the time of clip
            out[..., self.names.index(self.along)] = own
        return out

    def at(self, s: Any) -> StretchPoint:
        """Return the point at a coordinate, or many.

        Parameters
        ----------
        s : float or array
            Coordinate, in its unit.

        Raises
        ------
        ValueError
            When a coordinate is outside the stretch.
        """
        given = checks.finite_array(self.along, s, self.unit)
        room = OUTSIDE * (self.high - self.low)
        for value in given.ravel():
            if not self.low - room <= value <= self.high + room:
                raise ValueError(f"{self.along} must be in {self._told(self.low, self.high)}; got {value:g}")
        row = self.rows(given)
        columns = [row[..., k] if given.ndim else float(row[k]) for k in range(row.shape[-1])]
        return StretchPoint(dict(zip(self.names, columns, strict=False)), *columns[len(self.names) :])

    @property
    def unit(self) -> str:
        """Unit of the coordinate; empty where none is known."""
        return self.units.get(self.along, "")

    def coordinate_of(self, x: Any, *, clamp: bool = False) -> Any:
        """Return s*(x), the coordinate of the optimum for a hidden state.

        Parameters
        ----------
        x : float or array
            Hidden state, in its unit.
        clamp : bool
            Whether to clamp hidden states to the stretch. False: refuse those outside.

        Raises
        ------
        ValueError
            When a hidden state is outside, without `clamp`.
        """
        given = checks.finite_array(self.hidden_name, x, self.units.get(self.hidden_name, ""))
        (low, high), room = self.x, OUTSIDE * (self.x[1] - self.x[0])
        for value in () if clamp else given.ravel():
            if not low - room <= value <= high + room:
                raise ValueError(f"{self.hidden_name} must be in {self._told(low, high)}; got {value:g}")
        out = np.empty(given.size)
        find_many(np.ascontiguousarray(given.ravel()), self.coordinate, self.hidden, self.hidden_slope, out)
        return out.reshape(given.shape) if given.ndim else float(out[0])

    def _told(self, low: float, high: float) -> str:
        """Return a range as text, with the causes of its ends."""
        ends = {end for end in self.ends if end != "range"}
        why = f", where the stretch ends ({', '.join(sorted(ends))})" if ends else ""
        return f"[{low:g}, {high:g}]{why}"

    def slack(self, s: Any, x: Any) -> Any:
        """Return P_b - P_c of the model at a coordinate and any hidden state; negative: violation.

        Parameters
        ----------
        s : float or array
            Coordinate, clamped to the stretch.
        x : float or array
            Hidden state.
        """
        s, x = np.asarray(s, dtype=float), np.asarray(x, dtype=float)
        if s.shape != x.shape:
            s, x = np.broadcast_arrays(s, x)
        response, limit = self.values(self.rows(s)[..., : len(self.names)], x)
        return limit - response

    def calibrated(self) -> "Calibration":
        """Return whether and where the response can read the stretch (in its units); see `Calibration`."""
        from sdpgrind.locus._path.calibration import calibration

        slopes = self.response_slope, self.limit_slope
        return calibration(
            self.coordinate, self.hidden, self.limit, slopes, lambda s: self.rows(s)[:, len(self.names)]
        )
