"""Counters of samples of a foreign machine: whether it shows something new, stands still, was restarted."""

from collections.abc import Mapping

from asyncua import ua

from hwsim.opcua._kinds import ends


def moved(kind: ua.VariantType, before: int, now: int) -> int:
    """Number of counts by which a counter has moved on, modulo the numbers of its type; < 0: it went back.

    A counter that runs over goes on at the other end of its type. Half of the type's numbers tell a move
    from a step back: a restart within the upper half of a short type looks like one on its way round.
    """
    low, high = ends(kind)
    numbers = int(high) - int(low) + 1
    step = (now - before) % numbers
    return step if step < numbers // 2 else step - numbers


class SampleCounters:
    """Counts the rounds in which each of several counters has moved on: the slowest one tells what is new."""

    def __init__(self) -> None:
        self.rounds = 0
        self._last: dict[str, int] = {}
        self._moved: set[str] = set()

    def look(self, counts: Mapping[str, int], kinds: Mapping[str, ua.VariantType]) -> int:
        """Take in the counters of a sample and return the rounds; one less after a counter that went back."""
        steps = {node: moved(kinds[node], self._last.get(node, now), now) for node, now in counts.items()}
        self._last |= counts
        self._moved |= {node for node, step in steps.items() if step}
        back = min(steps.values()) < 0
        if back or self._moved >= counts.keys():
            self.rounds, self._moved = self.rounds + (-1 if back else 1), set()
        return self.rounds
