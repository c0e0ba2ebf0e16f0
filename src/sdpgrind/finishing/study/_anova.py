"""Analysis of variance: sums of squares, F tests and shares of the effects."""

import dataclasses
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import fdtrc

from sdpgrind.base.checks import Floats, one_of
from sdpgrind.finishing.study._analysed import Analysed
from sdpgrind.finishing.study._general import type_two
from sdpgrind.finishing.study._linear_model import LinearModel
from sdpgrind.finishing.study._observations import Observations, analysed
from sdpgrind.finishing.study._pooling import LEVEL, Pool, Pooling, pooled
from sdpgrind.finishing.study._texts import aligned, number, percent

if TYPE_CHECKING:
    import xarray as xr


ORTHOGONAL = "orthogonal: sums of squares of the level means"
ALONE = (
    "not orthogonal: sums of squares of type II, of a model without an error;"
    " they need not add up to the total"
)
GENERAL = (
    "not orthogonal: general linear model, sums of squares of type II (statsmodels);"
    " they need not add up to the total"
)
HEAD = ("source", "df", "SS", "MS", "F", "p", "pure SS", "share", "pure share", "")


@dataclasses.dataclass(frozen=True)
class AnovaRow:
    """Row of an analysis of variance; None: not available.

    Attributes
    ----------
    source : str
        Factor, interaction "A x B", "error" or "total".
    df : int
        Degrees of freedom, a whole number.
    ss, ms : float
        Sum of squares and mean square, dB^2.
    F, p : float or None
        MS over that of the error, and the probability of at least this F without an effect, unit 1.
    pure_ss : float or None
        SS' = SS - df V_e with the mean square V_e of the error, dB^2; for the error SS plus all df V_e.
    contribution, pure_contribution : float or None
        SS and pure SS over the total, unit 1.
    note : str
        Remark: "F < 1: pool", "only after pooling", or the reason for a missing error.
    """

    source: str
    df: int
    ss: float
    ms: float | None
    F: float | None = None
    p: float | None = None
    pure_ss: float | None = None
    contribution: float | None = None
    pure_contribution: float | None = None
    note: str = ""

    @property
    def cells(self) -> tuple[str, ...]:
        """Texts of the row: SS in dB^2, shares in percent."""
        ss = f"{self.ss:.5f}"
        if self.source == "total":
            return (self.source, str(self.df), ss, "", "", "", "", _share(self.contribution), "", "")
        tested = ("", "") if self.source == "error" else (number(self.F, ".3f"), number(self.p, ".3g"))
        middle = (number(self.ms, ".5f"), *tested, number(self.pure_ss, ".3f"))
        shares = (_share(self.contribution), _share(self.pure_contribution))
        return (self.source, str(self.df), ss, *middle, *shares, self.note)


def _share(value: float | None) -> str:
    return number(None) if value is None else percent(value)


@dataclasses.dataclass(frozen=True, repr=False)
class AnovaTable:
    """Analysis of variance, printed as a table, after pooling as both tables.

    Attributes
    ----------
    rows : tuple of AnovaRow
        Effects, then "error", then "total"; SS in dB^2.
    method : str
        Method of the sums of squares.
    unit : str
        Unit of the analysed values: "dB", with ratio "none" that of the response.
    pooling : Pooling or None
        Effects counted as error, and the rule.
    unpooled : AnovaTable or None
        Table before pooling.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> table = fin.Study.published("wang-2001").anova()
    >>> round(table["feed_rate"].F, 3), table["feed_rate"].note, table.error.df
    (0.62, 'F < 1: pool', 10)
    """

    rows: tuple[AnovaRow, ...]
    method: str
    unit: str = "dB"
    pooling: Pooling | None = None
    unpooled: "AnovaTable | None" = None

    def __getitem__(self, source: str) -> AnovaRow:
        """Return the row of a factor, an interaction, "error" or "total"; SS in dB^2."""
        names = [row.source for row in self.rows]
        return self.rows[names.index(one_of("source", source, names))]

    @property
    def effects(self) -> tuple[AnovaRow, ...]:
        """Rows of factors and interactions; SS in dB^2."""
        return self.rows[:-2]

    @property
    def error(self) -> AnovaRow:
        """Row of the error; SS in dB^2."""
        return self.rows[-2]

    @property
    def total(self) -> AnovaRow:
        """Row of the total; SS in dB^2."""
        return self.rows[-1]

    @property
    def ranking(self) -> tuple[str, ...]:
        """Effects in descending order of their sums of squares (dB^2)."""
        return tuple(row.source for row in sorted(self.effects, key=lambda row: -row.ss))

    def significant(self, alpha: float = 0.05) -> tuple[str, ...]:
        """Return the effects with p < `alpha` (unit 1), without those significant only after pooling."""
        late = self.pooling.only_after if self.pooling else ()
        return tuple(
            row.source
            for row in self.effects
            if row.p is not None and row.p < alpha and row.source not in late
        )

    @property
    def dataset(self) -> "xr.Dataset":
        """Numbers by source, with units; NaN: not available."""
        import xarray as xr

        units = dict.fromkeys(("ss", "ms", "pure_ss"), f"{self.unit}^2" if self.unit else "")
        fields = [f.name for f in dataclasses.fields(AnovaRow) if f.name not in ("source", "note")]
        data = {}
        for name in fields:
            values = [getattr(row, name) for row in self.rows]
            data[name] = (
                "source",
                np.array([np.nan if v is None else v for v in values]),
                {"units": units.get(name, "1")},
            )
        return xr.Dataset(data, {"source": [row.source for row in self.rows]}, {"method": self.method})

    def __repr__(self) -> str:
        shown = f"{aligned(HEAD, [row.cells for row in self.rows])}\n{self.method}"
        if self.pooling is None or self.unpooled is None:
            return shown
        return f"before pooling\n{self.unpooled!r}\n\nafter pooling: {self.pooling}\n{shown}"


def anova(study: Observations, pool: Pool) -> AnovaTable:
    """Table of a study; see `Study.anova`."""
    found = analysed(study)
    whole = _table(found)
    if pool is None:
        return whole
    names = pooled(found, {row.source: row.F for row in whole.effects}, pool)
    table = _table(found.without(set(names)))
    record = _recorded(pool, names, whole, table)
    rows = tuple(
        dataclasses.replace(row, note="only after pooling") if row.source in record.only_after else row
        for row in table.rows
    )
    assert found.y.size - 1 == table.total.df  # pooling moves degrees of freedom, it makes none
    return dataclasses.replace(table, rows=rows, pooling=record, unpooled=whole)


def _recorded(pool: Pool, names: tuple[str, ...], before: AnovaTable, after: AnovaTable) -> Pooling:
    """Record of a pooling."""
    late = tuple(row.source for row in after.effects if _below(row.p) and not _below(before[row.source].p))
    df = after.error.df - before.error.df
    return Pooling("F < 1" if pool == "F<1" else "named", names, df, after.error.df, late)


def _below(p: float | None) -> bool:
    return p is not None and p < LEVEL


def _table(found: Analysed) -> AnovaTable:
    y, model = found.y, found.model
    rest = error_square(model, y)
    if model.orthogonal:
        squares, method = model.squares(y), ORTHOGONAL
    elif rest == 0:  # statsmodels divides by the error
        squares, method = model.squares(y), ALONE
    else:
        squares, method = type_two(model, y), GENERAL
    names = [found.named(term) for term in model.terms]
    return AnovaTable(_rows(names, model, squares, rest, y), method, found.unit)


def error_square(model: LinearModel, y: Floats) -> float:
    """Residual sum of squares; exactly 0 within rounding."""
    square = float(np.sum(model.residuals(y) ** 2))
    rounding = (16 * np.finfo(float).eps) ** 2 * float(np.sum(y**2)) * y.size
    return 0.0 if model.error_df == 0 or square <= rounding else square


def error_variance(model: LinearModel, y: Floats) -> float | None:
    """Mean square of the error; None where the error is 0 or has no degrees of freedom."""
    square = error_square(model, y)
    return square / model.error_df if square > 0 else None


def _rows(
    names: list[str], model: LinearModel, squares: Floats, rest: float, y: Floats
) -> tuple[AnovaRow, ...]:
    total = float(np.sum((y - y.mean()) ** 2))
    freedom = model.error_df
    variance = rest / freedom if rest > 0 else None
    found = [
        _effect(name, df, float(ss), total, variance, freedom)
        for name, df, ss in zip(names, model.df, squares, strict=True)
    ]
    pure = None if variance is None else rest + sum(model.df) * variance
    shares, note = (_over(rest, total), _over(pure, total)), _no_error(model, rest)
    error = AnovaRow("error", freedom, rest, variance, None, None, pure, *shares, note)
    return (*found, error, AnovaRow("total", y.size - 1, total, None, contribution=_over(total, total)))


def _no_error(model: LinearModel, rest: float) -> str:
    if model.error_df == 0:
        return "saturated: no degrees of freedom are left"
    return "nothing is left to judge by" if rest == 0 else ""


def _effect(name: str, df: int, ss: float, total: float, variance: float | None, error_df: int) -> AnovaRow:
    share = _over(ss, total)
    if variance is None:
        return AnovaRow(name, df, ss, ss / df, contribution=share)
    F, pure = ss / df / variance, ss - df * variance
    p = float(fdtrc(df, error_df, F))
    return AnovaRow(
        name, df, ss, ss / df, F, p, pure, share, _over(pure, total), "F < 1: pool" if F < 1 else ""
    )


def _over(part: float | None, total: float) -> float | None:
    return None if part is None or total <= 0 else part / total
