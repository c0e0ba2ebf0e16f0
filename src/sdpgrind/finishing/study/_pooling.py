"""Pooling of weak effects into the error: by an explicit rule, once, and with a record."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Literal, TypeAlias

from sdpgrind.base import checks
from sdpgrind.finishing.study._analysed import Analysed

Pool: TypeAlias = Literal["F<1"] | Sequence[str] | None
LEVEL = 0.05  # probability of `Pooling.only_after`; chosen: default level of `AnovaTable.significant`


@dataclasses.dataclass(frozen=True)
class Pooling:
    """Record of a pooling.

    Attributes
    ----------
    rule : str
        "F < 1" or "named".
    names : tuple of str
        Pooled effects.
    df, error_df : int
        Degrees of freedom of these and of the error after pooling, each a whole number.
    only_after : tuple of str
        Effects with p < 0.05 after pooling, but not before; `AnovaTable.significant` leaves them out.

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

    def __str__(self) -> str:
        if not self.names:
            return f"rule {self.rule}: nothing counted as error"
        text = (
            f"rule {self.rule}: {', '.join(self.names)} counted as error,"
            f" {self.df} of its {self.error_df} degrees of freedom"
        )
        if self.only_after:
            text += f"; {', '.join(self.only_after)} significant only after pooling, not counted"
        return text


def pooled(found: Analysed, ratios: Mapping[str, float | None], pool: Pool) -> tuple[str, ...]:
    """Names of the terms pooled by a rule from the F of each effect; parts of a kept interaction are kept."""
    names = _by_rule(ratios) if pool == "F<1" else _named(ratios, pool)
    terms = [term for term in found.model.terms if found.named(term) in names]
    for term in [term for term in found.model.terms if term not in terms]:
        part = next((small for small in terms if set(small) < set(term)), None)
        if part is None:
            continue
        if pool != "F<1":
            raise ValueError(f"pool must name {found.named(term)!r} too where it names {found.named(part)!r}")
        terms = [small for small in terms if not set(small) < set(term)]
    return tuple(map(found.named, terms))


def _by_rule(ratios: Mapping[str, float | None]) -> list[str]:
    if None in ratios.values():
        raise ValueError('pool must name the effects: "F<1" cannot be judged without an error; got "F<1"')
    return [name for name, ratio in ratios.items() if ratio is not None and ratio < 1]


def _named(ratios: Mapping[str, float | None], pool: Pool) -> list[str]:
    if pool is None or isinstance(pool, str):
        raise ValueError(f'pool must be None, "F<1" or a sequence of names of effects; got {pool!r}')
    return [str(checks.one_of("pool", name, ratios)) for name in pool]
