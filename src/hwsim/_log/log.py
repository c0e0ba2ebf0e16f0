"""The log of a run: tables by tier, outcomes of parts, a picture, a file."""

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from hwsim._log import frames as _frames
from hwsim._log.frames import Frames
from hwsim._log.labels import Labels
from hwsim._part.motions import is_of_rows, rows_of
from hwsim._part.part import Column, LivePart
from sdpgrind.base.records import Record

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


class Log(Record):
    """Everything measured, commanded and planned in a run; made by `run`, `compare` and `sdpgrind.load`.

    ``log[tier]`` is the table (`xarray.Dataset`, dimension ``row``) of one tier of control: one row a step of
    its controller, and a last row without a command when something was measured after its last step.
    Coordinates: ``part`` (number), ``time`` (s, from the start of the part) and, after `compare`,
    ``controller``. Columns, with ``units`` in their attributes: ``<name>`` measured before the step,
    ``<name>_command`` commanded, ``<name>_planned`` reported by the controller. NaN: no reading, no command.

    The column of a motion (a commanded table) holds its number of rows. The rows of all motions are
    concatenated in ``log["<tier>:<name>"]``, with the ``time`` of the step (s); of motions of more than 64
    rows only a digest is kept.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import weldbead
    >>> problem = weldbead.preset("P1")
    >>> class OnePass:
    ...     period = None
    ...     tier = "sequence"
    ...     def reset(self):
    ...         self.passes = 0
    ...     def step(self, **measured):
    ...         self.passes += 1
    ...         return {"stop": 1.0} if self.passes > 1 else {"duration": 20.0, "normal_force": 40.0}
    >>> log = hwsim.run(hwsim.WeldBeadStand(problem), OnePass(), parts=3)
    >>> log
    <hwsim.Log: 3 parts on WeldBeadStand, tables sequence>
    >>> log["sequence"].height.units, log.outcome.passes.values
    ('mm', array([1., 1., 1.]))
    >>> import sdpgrind, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     log.save(f"{folder}/run.nc")
    ...     sdpgrind.load(f"{folder}/run.nc").outcome.equals(log.outcome)
    True
    """

    kind = "hwsim.log"

    def __init__(self, make: Callable[[], Frames], parts: Sequence[LivePart] | None = None) -> None:
        self._make, self._parts = make, parts

    @classmethod
    def of(cls, parts: Sequence[LivePart], labels: Labels) -> Self:
        """Log of the parts of a run, labelled when first used (private to this package)."""
        return cls(lambda: _frames.from_parts(parts, labels), parts)

    @classmethod
    def restored(cls, dataset: "xr.Dataset") -> Self:
        return cls(lambda: _frames.from_dataset(dataset))

    @cached_property
    def _frames(self) -> Frames:
        return self._make()

    @property
    def outcome(self) -> "xr.Dataset":
        """Outcome of each part (dimension ``part``; of `compare` also ``controller``), with units.

        ``<name>_planned`` is the first report of a controller without a period.
        """
        return self._frames.outcome

    @property
    def tiers(self) -> tuple[str, ...]:
        """Names of the tables, without those of rows of motions."""
        return tuple(name for name in self._frames.tables if not is_of_rows(name))

    def __getitem__(self, tier: str) -> "xr.Dataset":
        try:
            return self._frames.tables[tier]
        except KeyError:
            raise KeyError(f"tier must be one of {', '.join(self._frames.tables)}; got {tier!r}") from None

    def column(self, tier: str, name: str) -> Column:
        """Return the values of a column of a table as an array, without making labels.

        Parameters
        ----------
        tier : str
            Name of the table.
        name : str
            Name of the column; its unit is in ``log[tier][name].units``.

        Examples
        --------
        >>> import hwsim
        >>> from sdpgrind import plunge
        >>> problem = plunge.preset("simulation")
        >>> log = hwsim.run(hwsim.PlungeGrinder(problem, noise=None), plunge.CycleController(problem))
        >>> log.column("controller", "size")[-1].round(3)  # mm
        np.float64(0.282)
        """
        if self._parts is not None and all(name in part.tables.get(tier, ()) for part in self._parts):
            return np.concatenate([part.tables[tier][name] for part in self._parts])
        return np.asarray(self[tier][name].values)

    def figure(self, name: str) -> Column:
        """Return an outcome of each part as an array, without making labels.

        Parameters
        ----------
        name : str
            Name of the outcome; its unit is in ``log.outcome[name].units``.

        Examples
        --------
        >>> import hwsim
        >>> from sdpgrind import plunge
        >>> problem = plunge.preset("simulation")
        >>> log = hwsim.run(hwsim.PlungeGrinder(problem, noise=None), plunge.CycleController(problem))
        >>> log.figure("time")  # s
        array([12.08])
        """
        if self._parts is not None and all(name in part.outcome for part in self._parts):
            return np.array([part.outcome[name] for part in self._parts])
        return np.asarray(self.outcome[name].values)

    def __len__(self) -> int:
        return int(self.outcome.sizes["part"])

    def __repr__(self) -> str:
        return (
            f"<hwsim.Log: {len(self)} parts on {self.outcome.attrs['plant']}, tables {', '.join(self.tiers)}>"
        )

    def _written(self) -> "xr.Dataset":
        return _frames.to_dataset(self._frames)

    def plot(self) -> "Figure":
        """Draw the run: the picture of its plant, or every measured quantity against time.

        Returns
        -------
        matplotlib.figure.Figure
            Axes in mm, s, N, W, $ as labelled.

        Raises
        ------
        ImportError
            Without matplotlib (extra ``plot``).

        Examples
        --------
        >>> import hwsim
        >>> from sdpgrind import weldbead
        >>> problem = weldbead.preset("P1")
        >>> controller = weldbead.SequenceController(weldbead.plan(problem, tolerance=1e-2))
        >>> log = hwsim.run(hwsim.WeldBeadStand(problem), controller, parts=20)
        >>> log.plot().savefig("run.png")  # doctest: +SKIP
        """
        from hwsim._log.picture import draw

        return draw(self)


def rows(log: Log, tier: str, name: str) -> "xr.Dataset | None":
    """Rows of the motions that a tier commanded under a name; None: the log has none."""
    return log._frames.tables.get(rows_of(tier, name))


def same(one: Log, other: Log) -> bool:
    """Whether two logs are equal bit for bit, NaN included."""
    if one._frames.tables.keys() != other._frames.tables.keys():
        return False
    tables: list[Any] = [(table, other[name]) for name, table in one._frames.tables.items()]
    return all(a.identical(b) for a, b in [*tables, (one.outcome, other.outcome)])
