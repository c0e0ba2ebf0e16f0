"""Counting weak effects as error: only by an explicit rule, once, and with a record of what that did."""

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, TypeAlias

from sdpgrind.base import checks

if TYPE_CHECKING:
    from sdpgrind.finishing.study._analysed import Analysed
    from sdpgrind.finishing.study._anova import AnovaTable

Pool: TypeAlias = Literal["F<1"] | Sequence[str] | None
LEVEL = 0.05
"""Probability below which an effect is said to have become significant by pooling."""


@dataclasses.dataclass(frozen=True)
class Pooling:
    """What was counted as error, by which rule, and what that did.

    Attributes
    ----------
    rule : str
        "F < 1" or "named".
    names : tuple of str
        The effects that were pooled.
    df : int
        Their degrees of freedom, a whole number.
    error_df : int
        Degrees of freedom of the error afterwards, pooled ones included, a whole number.
    only_after : tuple of str
        Effects with p < 0.05 after pooling, but not before: `AnovaTable.significant` does not count them.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> print(fin.Study.published("wang-2001").anova(pool="F<1").pooling)
    rule F < 1: feed_rate counted as error, 2 of its 12 degrees of freedom
    """

    rule: str
    names: tuple[str, ...]
    df: int
    error_df: int
    only_after: tuple[str, ...] = ()

    @classmethod
    def of(cls, pool: Pool, names: tuple[str, ...], before: "AnovaTable", after: "AnovaTable") -> "Pooling":
        """Record one pooling; private to this package."""
        late = tuple(row.source for row in after.effects if _below(row.p) and not _below(before[row.source].p))
        df = after.error.df - before.error.df
        return cls("F < 1" if pool == "F<1" else "named", names, df, after.error.df, late)

    def __str__(self) -> str:
        if not self.names:
            return f"rule {self.rule}: nothing counted as error"
        text = f"rule {self.rule}: {', '.join(self.names)} counted as error, {self.df} of its {self.error_df} degrees of freedom"
        return f"{text}; {', '.join(self.only_after)} significant only after pooling, not counted" if self.only_after else text


def _below(p: float | None) -> bool:
    return p is not None and p < LEVEL


def pooled(found: "Analysed", whole: "AnovaTable", pool: Pool) -> tuple[str, ...]:
    """Names of the terms that a rule pools; an effect whose interaction stays must stay too."""
    names = _by_rule(whole) if pool == "F<1" else _named(whole, pool)
    terms = [term for term in found.model.terms if found.named(term) in names]
    for term in [term for term in found.model.terms if term not in terms]:
        part = next((small for small in terms if set(small) < set(term)), None)
        if part is None:
            continue
        if pool != "F<1":
            raise ValueError(f"pool must name {found.named(term)!r} too where it names {found.named(part)!r}")
        terms = [small for small in terms if not set(small) < set(term)]
    return tuple(map(found.named, terms))


def _by_rule(whole: "AnovaTable") -> list[str]:
    if any(row.F is None for row in whole.effects):
        raise ValueError('pool must name the effects: "F<1" cannot be judged without an error; got "F<1"')
    return [row.source for row in whole.effects if row.F is not None and row.F < 1]


def _named(whole: "AnovaTable", pool: Pool) -> list[str]:
    if pool is None or isinstance(pool, str):
        raise ValueError(f'pool must be None, "F<1" or a sequence of names of effects; got {pool!r}')
    return [str(checks.one_of("pool", name, [row.source for row in whole.effects])) for name in pool]
