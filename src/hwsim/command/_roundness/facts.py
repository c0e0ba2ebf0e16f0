"""Facts of a ring for the terminal: one a line, the sheet, and whether its limits are known to be kept."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from hwsim.command._roundness.terms import in_terms


class Facts(NamedTuple):
    """Profile, circle, limit of RONt (mm), budget and its tester and height (mm), harmonics, change."""

    profile: Any
    circle: Any
    limit: float | None
    budget: Any
    instrument: Any
    height: float | None
    harmonics: Any
    change: Any

    @property
    def accepted(self) -> bool:
        """Whether all limits are known to be kept."""
        waves = () if self.harmonics is None else self.harmonics.decisions
        kept = all(each.found == "accepted" for each in waves)
        return kept and (self.limit is None or self._decision() == "accepted")

    def lines(self) -> Iterator[str]:
        """A fact a line."""
        yield f"file    {self.profile.source.files[0].name}: {len(self.profile.angle)} points"
        yield from (note for note in self.profile.source.notes if note.startswith("section "))
        yield from self._turns()
        yield from (f"step    {step}" for step in self.profile.steps)
        yield f"filter  {self.circle.filter or 'none: all undulations'}"
        yield f"circle  {self.circle!r}"
        if self.budget is not None:
            yield f"budget  {self.budget!r}"
        elif self.instrument is not None:
            yield f"budget  left out: {self.circle.why_no_budget}"
        if self.change is not None:
            yield f"change  {self.change!r}"
            yield from (f"change  {in_terms(each)}" for each in self.change.remarks)
        remarks = (each for each in (self.budget or self.circle).remarks if each != self.profile.unlike_turns)
        yield from (f"note    {in_terms(each)}" for each in remarks)
        if self.limit is not None:
            yield f"limit   {in_terms((self.budget or self.circle).verdict(self.limit))}"
        yield from (f"limit   {each}" for each in (self.harmonics.decisions if self.harmonics else ()))

    def report(self, path: Path) -> str:
        """Write the sheet to sign and return its path."""
        tester = {} if self.instrument is None else {"instrument": self.instrument, "height": self.height}
        limits = None if self.limit is None else {"RONt": self.limit}
        more = {"harmonics": self.harmonics, "change": self.change}
        return str(self.circle.report(path, limits=limits, **tester, **more))

    def _turns(self) -> Iterator[str]:
        """Line on turns that differ as those of two parts; none where they agree."""
        if told := self.profile.unlike_turns:
            yield f"note    {told.partition('?')[0]}? --section NAME=WORD takes one of several in a file"

    def _decision(self) -> str:
        """Decision on the limit: none without an interval, which a budget always has."""
        if self.budget is None and self.circle.why_no_interval:
            return "not decided"
        return str((self.budget or self.circle).conforms(self.limit))
