"""The log of a run: tables by tier, outcomes of parts, a picture, a file."""

import os
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from hwsim._log import frames as _frames
from hwsim._log.frames import Frames
from hwsim._log.labels import Labels
from hwsim._part.motions import is_of_rows, rows_of
from hwsim._part.part import Column, LivePart
from sdpgrind.base import notebook
from sdpgrind.base.brief import counted
from sdpgrind.base.by_name import called
from sdpgrind.base.records import Record
from sdpgrind.base.tables import names_of_parts

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from sdpgrind.base.columns.source import Source


class Log(Record):
    """Everything measured, commanded and planned in a run; made by `run`, `compare`, `read`, `sdpgrind.load`.

    ``log[tier]`` is the table (`xarray.Dataset`, dimension ``row``) of one tier of control: one row a step of
    its controller, and a last row without a command when something was measured after its last step.
    Coordinates: ``part`` (number), ``time`` (s, from the start of the part) and, after `compare`,
    ``controller``. Columns, with ``units`` in their attributes: ``<name>`` measured before the step,
    ``<name>_command`` commanded, ``<name>_planned`` reported by the controller. NaN: no reading, no command.

    The column of a motion (a commanded table) holds its number of rows, and ``<name>_digest_command`` a hash
    of its entries. The rows of each motion stand once in ``log["<tier>:<name>"]``, with the ``part`` and the
    ``time`` (s) of its first command; beyond a million rows only digests are kept.

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

    made_of: Mapping[str, Any] | None = None
    """Arguments of `run` or `compare` by name (private to this package); None: read from a file."""

    def __init__(self, make: Callable[[], Frames], parts: Sequence[LivePart] | None = None) -> None:
        self._make, self._parts = make, parts

    @classmethod
    def of(cls, parts: Sequence[LivePart], labels: Labels) -> Self:
        """Log of the parts of a run, labelled when first used (private to this package)."""
        return cls(lambda: _frames.from_parts(parts, labels), parts)

    @classmethod
    def restored(cls, dataset: "xr.Dataset") -> Self:
        return cls(lambda: _frames.from_dataset(dataset))

    @classmethod
    def read(
        cls,
        data: Any,
        *,
        time: Any = None,
        period: float | None = None,
        part: Any = None,
        group: str | Sequence[str] | None = None,
        commands_at: str = "begin",
        duplicates: str = "refuse",
        on_restart: str = "refuse",
        resample: float | None = None,
        missing: Sequence[str] = (),
        time_format: str | None = None,
        plausible: bool = True,
        **columns: Any,
    ) -> Self:
        """Read a file of a machine, a rig or a gauge; units stand in the call or in the file.

        The log has one table, ``"data"``: coordinates ``part`` (0, 1, ... in order of appearance) and
        ``time`` (s), columns in the library's units, commands as ``<name>_command``. `outcome` holds
        ``duration`` (s) and ``rows`` of each part. The words of the file for the parts are in the attribute
        ``labels`` of both; reports, messages and `to_csv` show them, and ``identify`` takes them as ``part``.

        Parameters
        ----------
        data : path, list of paths, pandas.DataFrame, xarray.Dataset, mapping of arrays
            Text (.csv, .tsv, .txt, .dat, .log, .prn, .lvm, .asc), .tdms, .h5 or .hdf5; of a list, each file
            is a part. Also what has ``__dataframe__``. Attributes ``units`` of a dataset count.
        time : str or tuple, optional
            Header of the times, ``"t"`` or ``("t", "ms")``. Stamps count from the first row of a part,
            numbers are kept. Default: waveforms of a TDMS file.
        period : float, optional
            Step from row to row where there is no column of times, s.
        part : str, optional
            Header of the numbers or words of the parts, kept as written: 0017 and 17 are two parts.
            Default: each group, each file is one.
        group : str or list of str, optional
            Groups of a TDMS or HDF5 file. Default: all that hold the columns, run10 after run9.
        commands_at : {"begin", "end", "centre"}
            Whether the command of a row holds from the row on, led to the row, or is the mean about it.
        duplicates : {"refuse", "first", "last", "mean", "keep"}
            Which of several different rows at one time is kept. Equal rows are left out and counted, except
            with "keep": all rows as they stand, as those of motions.
        on_restart : {"refuse", "new part"}
            Whether a time that falls is refused, or begins a part.
        resample : float, optional
            Step of common instants, s: means of faster columns, lines through slower ones, commands as held.
            Needed where columns are of unequal lengths.
        missing : sequence of str
            Further words for no reading.
        time_format : str, optional
            Format of stamps (strptime), such as ``"%d/%m/%Y %H:%M:%S"``.
        plausible : bool
            Whether units are checked: against what a machine can mean, and columns against each other.
        **columns
            Name in the library = header, ``(header, unit)`` or ``(header, unit, factor)``. The header may
            lack its bracket. A factor turns what is recorded into what the name means: -0.5 for what is left
            on a diameter.

        Returns
        -------
        Log
            The log; its `source` records what was read.

        Raises
        ------
        ValueError
            In one sentence with file, header, row and the call that would do: a unit that is missing,
            unknown, of another kind or implausible, a header that is missing or doubled, a word among
            numbers, a row of another width, falling time, an ambiguous date or decimal sign, unequal lengths,
            a `resample` that leaves less than 10 of 100 rows or more, an empty or damaged file.
        ImportError
            Without npTDMS or h5py (extra ``io``).

        Warns
        -----
        UserWarning
            Where more than 5 % of a column are missing; where the call gives another unit than the file;
            where `duplicates` leaves less than half of the rows; where rows of a size are more than 2 s apart
            or its parts shorter than 0.3 s; where a removal rate implies an unusual specific energy or width.

        Examples
        --------
        >>> import hwsim, numpy as np
        >>> time = np.arange(0.0, 8.0, 0.1)
        >>> table = {"t [s]": time, "D": 500 - 2 * 40 * time, "v [mm/min]": np.full(80, 2.4)}
        >>> log = hwsim.Log.read(table, time="t", size=("D", "um", -0.5), command_rate="v")
        >>> print(log.source)
        the mapping
        column                unit  header      recorded in  from     factor        missing
        time                  s     t [s]       s            bracket  1             0
        size                  mm    D           um           call     -0.0005       0
        command_rate_command  mm/s  v [mm/min]  mm/min       bracket  0.0166666667  0
        80 rows read, 0 left out, 80 kept in 1 part, commands_at 'begin'
        """
        from hwsim.io import _recorded
        from sdpgrind.base.columns.read import read
        from sdpgrind.base.columns.taken import Rules

        rules = Rules(
            period=period,
            group=group,
            commands_at=commands_at,
            duplicates=duplicates,
            on_restart=on_restart,
            resample=resample,
            missing=missing,
            time_format=time_format,
            plausible=plausible,
        )
        recording = read(data, columns, time=time, part=part, rules=rules)
        table, outcome = _recorded.data_table(recording), _recorded.outcome_of(recording)
        return cls(lambda: Frames({_recorded.TABLE: table}, outcome))

    @property
    def source(self) -> "Source | None":
        """Origin of a log that was read: files, units, factors, rows left out; None: made by a run."""
        from sdpgrind.base.columns.source import source_of

        return next(filter(None, map(source_of, self._frames.tables.values())), None)

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
        attrs, by = self.outcome.attrs, ""
        if "controller" in self.outcome.dims:
            by = f" by each of {attrs['controller']}"
        parts = counted(len(self), "part")
        return f"<hwsim.Log: {parts} on {attrs['plant']}{by}, tables {', '.join(self.tiers)}>"

    def _repr_html_(self) -> str:
        shown = self.outcome if self.source is None else self[self.tiers[0]]  # of a file what was read
        return notebook.columns(repr(self)[1:-1], shown)

    def _written(self) -> "xr.Dataset":
        return _frames.to_dataset(self._frames)

    def to_csv(self, path: str | os.PathLike[str], table: str | None = None) -> None:
        """Write a table as text, whole or not at all: headers ``name [unit]``, floats in full.

        `Log.read` of the file gives the same numbers to the bit; where rows stand at one time, as those of
        motions do, with ``duplicates="keep"``. Entries of arrays are columns ``name.0`` and on. Parts of a
        log that was read have the words of its file.

        Parameters
        ----------
        path : str or path
            File in an existing folder.
        table : str, optional
            Name of the table; ``"outcome"``: what the parts became. Default: the first table.

        Examples
        --------
        >>> import hwsim, pathlib, tempfile
        >>> log = hwsim.Log.read({"t [s]": [0.0, 0.1], "P [kW]": [1.2, 1.3]}, time="t", grinding_power="P")
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     log.to_csv(f"{folder}/log.csv")
        ...     print(pathlib.Path(folder, "log.csv").read_text())
        part,time [s],grinding_power [W]
        0,0.0,1200.0
        0,0.1,1300.0
        <BLANKLINE>
        """
        from hwsim.io import _written

        wanted = table if table is not None else self.tiers[0]
        named = names_of_parts(self[self.tiers[0]])
        _written.write(path, self.outcome if wanted == "outcome" else self[wanted], named)

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
        >>> controller = weldbead.SequenceController(weldbead.plan(problem, tolerance=None, nodes=101))
        >>> log = hwsim.run(hwsim.WeldBeadStand(problem), controller, parts=20)
        >>> log.plot().savefig("run.png")  # doctest: +SKIP
        """
        from hwsim._log.picture import draw

        return draw(self)

    def report(
        self,
        path: str | os.PathLike[str] | None = None,
        plan: Any = None,
        problem: Any = None,
        *,
        doubts: Any = None,
    ) -> str:
        """Write one HTML page: verdict, worst parts first, planned against realised, all parts, origin.

        Each quantity has one unit, µm for lengths below 0.05 mm. ``hwsim verify`` finds a changed number.

        Parameters
        ----------
        path : str or path, optional
            HTML file in an existing folder, written complete or not at all. None: only the text is returned.
        plan : Plan, optional
            The plan that the controller followed; it is compared with what came of it.
        problem : optional
            The problem, where it is not that of the plan.
        doubts : Doubts, optional
            What the log says about a problem, as ``problem.doubts(log)`` gives it.

        Returns
        -------
        str
            The path of the file, or the text of the page.

        Raises
        ------
        ImportError
            With a path, without the extra ``report`` (jinja2, matplotlib).

        Examples
        --------
        >>> import hwsim
        >>> from sdpgrind import plunge
        >>> problem = plunge.preset("simulation")
        >>> log = hwsim.run(hwsim.PlungeGrinder(problem), plunge.CycleController(problem), parts=3)
        >>> print(log.report(plan=plunge.plan(problem)).splitlines()[3])
        3 parts on PlungeGrinder by CycleController: all finished
        """
        return str(called("hwsim._report.log_page:report", self, path, plan, problem, doubts))


def of_parts(log: Log, numbers: Sequence[int]) -> Log:
    """Log of some parts of a run, numbered from 0 in the given order."""
    return Log(lambda: _frames.of_parts(log._frames, numbers))


def rows(log: Log, tier: str, name: str) -> "xr.Dataset | None":
    """Rows of the motions that a tier commanded under a name; None: the log has none."""
    return log._frames.tables.get(rows_of(tier, name))


def same(one: Log, other: Log) -> bool:
    """Whether two logs are equal bit for bit, NaN included."""
    if one._frames.tables.keys() != other._frames.tables.keys():
        return False
    tables: list[Any] = [(table, other[name]) for name, table in one._frames.tables.items()]
    return all(a.identical(b) for a, b in [*tables, (one.outcome, other.outcome)])
