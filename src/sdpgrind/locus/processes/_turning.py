"""Turning, milling and drilling: the price of a surface, a tool that wears, a tooth that breaks, a spindle that tires."""

from collections.abc import Mapping
from dataclasses import KW_ONLY
from math import inf
from typing import Any

from sdpgrind.base import checks
from sdpgrind.base.quantities import Described, described, quantity
from sdpgrind.base.units import N_MM_S_PER_W
from sdpgrind.locus._problem.process import Varying


def tool_change_time(
    *, change: float, edge_cost: float, machine_rate: float, profit_rate: float = 0.0
) -> float:
    """Return the time tau (s) that a worn edge is worth: t1 + C2/(C1 + profit rate), after Koren (3).

    Nothing earned besides: least cost, t1 + C2/C1. An unbounded `profit_rate`: greatest production rate, t1, as an edge costs
    nothing beside the time. Between them lies the greatest profit for each unit of time, which is where what is earned in a
    unit of time at the best point itself is `profit_rate`.

    Parameters
    ----------
    change : float
        Time t1 to change the tool, s.
    edge_cost : float
        Price C2 of an edge, or of its regrind, $.
    machine_rate : float
        Price C1 of machine and operator, $/s.
    profit_rate : float
        What is earned in a unit of time when all is paid, $/s; ``math.inf`` for the greatest production rate.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> from math import inf
    >>> price = {"change": 90.0, "edge_cost": 1.5, "machine_rate": 0.0125}  # s, $, $/s
    >>> [tool_change_time(**price, profit_rate=earned) for earned in (0.0, 0.0125, inf)]
    [210.0, 150.0, 90.0]
    """
    t1 = checks.nonnegative("change", change, "s")
    price = checks.nonnegative("edge_cost", edge_cost, "$")
    rate = checks.positive("machine_rate", machine_rate, "$/s")
    earned = inf if profit_rate == inf else checks.nonnegative("profit_rate", profit_rate, "$/s")
    return t1 + price / (rate + earned)


@described("locus.turning")
class Turning(Described):
    """Cut at the least cost while the tool wears: Koren (1) to (6), (27) to (35).

    Controls are ``cutting_speed`` v (mm/s) and ``feed`` f (mm in a turn; of a milling cutter, mm for each tooth); hidden is
    ``flank_wear`` W (mm), the width of the worn land. With the tool life T = life (v/life_speed)^-n (f/life_feed)^-p:

    * cost (1 + tau/T)/(v f): the time for each mm^2 of surface, tool changes included, s/mm^2;
    * ``cutting_force`` K_c f^q - C_v v + C_w W (30) stays under the force at which the tool breaks, K_b f^nb (27), N;
    * ``cutting_power``, that force at the speed v, stays under the greatest power of the machine, W.

    One of both limits at least is to be given. Koren's (28) has K v f^m as a limit of power; but that is what cutting needs,
    not what a machine has, and it stands here on the side of the response.

    Parameters
    ----------
    tool_change_time : float
        tau, time that a worn edge is worth, s; see the function `tool_change_time`.
    life : float
        Tool life at `life_speed` and `life_feed`, s.
    life_speed, life_feed : float
        Cutting speed (mm/s) and feed (mm) of that life.
    taylor_v_exp, taylor_f_exp : float
        n and p, exponents of the tool life in speed and feed, unit 1.
    feed_force, force_exponent : float
        K_c, force at a feed of 1 mm, N/mm^q, and its exponent q, unit 1.
    speed_force : float
        C_v, by which speed softens the force, N/(mm/s).
    wear_force : float
        C_w, force for each mm of flank wear, N/mm.
    breaking_force, breaking_exponent : float, optional
        K_b, the force at which the tool breaks at a feed of 1 mm, N/mm^nb, and its exponent nb, unit 1; None: it does not
        break.
    power_max : float, optional
        Greatest power at the tool, W.

    Raises
    ------
    ValueError
        When n <= 1 (no speed is best), nb >= q (no feed is too great), neither limit is given, or a value is out of range.

    Examples
    --------
    >>> turning = Turning(
    ...     tool_change_time=210.0, life=900.0, life_speed=3000.0, life_feed=0.3, taylor_v_exp=4.0, taylor_f_exp=1.6,
    ...     feed_force=3400.0, force_exponent=0.75, speed_force=0.072, wear_force=1200.0, breaking_force=2860.0)
    >>> speed = turning.taylor_speed(feed=0.5)  # mm/s
    >>> round(speed, 2), round(turning.tool_life(speed, 0.5), 2)  # mm/s, s
    (2673.67, 630.0)
    >>> round(turning.onset_wear(feed_max=0.5), 6)  # mm: from here on the force limits
    0.160981
    """

    _: KW_ONLY
    tool_change_time: float = quantity("s", above=0)
    life: float = quantity("s", above=0)
    life_speed: float = quantity("mm/s", above=0, usual=(10.0, 1e6), typical=3000)
    life_feed: float = quantity("mm", above=0, usual=(1e-3, 50.0), typical=0.3)
    taylor_v_exp: float = quantity("1", above=1, hint=": else the fastest cut is the cheapest")
    taylor_f_exp: float = quantity("1", at_least=0)
    feed_force: float = quantity("N/mm^q", above=0)
    force_exponent: float = quantity("1", above=0)
    speed_force: float = quantity("N/(mm/s)", at_least=0)
    wear_force: float = quantity("N/mm", above=0)
    breaking_force: float | None = quantity("N/mm^nb", above=0, default=None)
    breaking_exponent: float = quantity("1", at_least=0, default=0.5)
    power_max: float | None = quantity("W", above=0, default=None)

    def _check(self) -> None:
        if self.breaking_force is None and self.power_max is None:
            raise ValueError(
                "breaking_force (N) or power_max (W) must be given: nothing else limits the cut; got neither"
            )
        if self.breaking_force is not None and self.breaking_exponent >= self.force_exponent:
            rule = f"< force_exponent = {self.force_exponent:g}: else no feed is too great for the tool"
            raise self._refused("breaking_exponent", rule)

    @property
    def constraints(self) -> tuple[Varying, ...]:
        """Force under the force that breaks the tool (N), and power under that of the machine (W), as they are given."""
        force = Varying(response=self._force, limit=self._breaking, name="cutting_force", unit="N")
        power = Varying(response=self._power, limit=self._power_limit, name="cutting_power", unit="W")
        given = (self.breaking_force, force), (self.power_max, power)
        return tuple(varying for value, varying in given if value is not None)

    @property
    def units(self) -> Mapping[str, str]:
        """Units of controls, hidden state and cost."""
        return {"cutting_speed": "mm/s", "feed": "mm", "flank_wear": "mm", "cost": "s/mm^2"}

    def cost(self, s: Any, c: Any) -> Any:
        """Return (1 + tau/T)/(v f) by the controls ``c``, Koren (2): s for each mm^2; no hidden state ``s`` is in it."""
        v, f = c.cutting_speed, c.feed
        return (1 + self.tool_change_time / self.tool_life(v, f)) / (v * f)

    def _force(self, s: Any, c: Any) -> Any:
        return self.cutting_force(c.cutting_speed, c.feed, s.flank_wear)

    def _breaking(self, s: Any, c: Any) -> Any:
        return self.breaking(c.feed)

    def _power(self, s: Any, c: Any) -> Any:
        return self._force(s, c) * c.cutting_speed / N_MM_S_PER_W

    def _power_limit(self, s: Any, c: Any) -> Any:
        return self.power_max

    def tool_life(self, cutting_speed: Any, feed: Any) -> Any:
        """Return the tool life (s) of a cutting speed (mm/s) and a feed (mm): T v^n f^p = const; Koren (5) at one feed."""
        slower = (cutting_speed / self.life_speed) ** -self.taylor_v_exp
        return self.life * slower * (feed / self.life_feed) ** -self.taylor_f_exp

    def cutting_force(self, cutting_speed: Any, feed: Any, flank_wear: Any) -> Any:
        """Return the force (N) of a cutting speed (mm/s), feed (mm) and flank wear (mm): K_c f^q - C_v v + C_w W, Koren (30)."""
        return (
            self.feed_force * feed**self.force_exponent
            - self.speed_force * cutting_speed
            + self.wear_force * flank_wear
        )

    def breaking(self, feed: Any) -> Any:
        """Return the force (N) that breaks the tool at a feed (mm): K_b f^nb, Koren (27)."""
        return self._breaks("breaking") * feed**self.breaking_exponent

    def taylor_speed(self, feed: Any) -> Any:
        """Return the cheapest speed (mm/s) at a feed (mm) that nothing limits: T = tau (n - 1), Koren (6)."""
        longer = self.life / (self.tool_change_time * (self.taylor_v_exp - 1))
        n = self.taylor_v_exp
        return self.life_speed * longer ** (1 / n) * (feed / self.life_feed) ** (-self.taylor_f_exp / n)

    @property
    def strongest_feed(self) -> float:
        """Feed f_pk = (nb K_b/(q K_c))^(1/(q - nb)) (mm) at which the tool can bear most wear."""
        ratio = (
            self.breaking_exponent * self._breaks("strongest_feed") / (self.force_exponent * self.feed_force)
        )
        return float(ratio ** (1 / (self.force_exponent - self.breaking_exponent)))

    def wear_at_limit(self, cutting_speed: Any, feed: Any) -> Any:
        """Return the flank wear (mm) of which the tool breaks at a cutting speed (mm/s) and a feed (mm): (34) solved for W."""
        return (self.breaking(feed) - self.cutting_force(cutting_speed, feed, 0.0)) / self.wear_force

    def onset_wear(self, feed_max: float) -> float:
        """Return the flank wear (mm) from which on the force limits a cut at the greatest feed, `feed_max` (mm).

        The speed is the Taylor speed of that feed.

        Raises
        ------
        ValueError
            When the greatest feed is not the cheapest: n <= p.
        """
        if self.taylor_f_exp >= self.taylor_v_exp:
            rule = f"< taylor_v_exp = {self.taylor_v_exp:g}: else the least feed is the cheapest"
            raise checks.refuse("taylor_f_exp", rule, self.taylor_f_exp)
        feed = checks.positive("feed_max", feed_max, "mm")
        return float(self.wear_at_limit(self.taylor_speed(feed), feed))

    def end_wear(self, cutting_speed_max: float) -> float:
        """Return the flank wear (mm) that no feed stands, up to a greatest speed `cutting_speed_max` (mm/s)."""
        speed = checks.positive("cutting_speed_max", cutting_speed_max, "mm/s")
        return float(self.wear_at_limit(speed, self.strongest_feed))

    def force_residual(self, cutting_speed: Any, feed: Any) -> Any:
        """Return left less right side (N) of Koren (35) at a cutting speed (mm/s) and feed (mm): 0 on the locus of the force.

        No wear is in it: [1 + (1 - n) tau/T] (nb P_b - q K_c f^q) - [1 + (1 - p) tau/T] C_v v. On it v is above the Taylor
        speed of its feed, as force falls with speed: the optimum buys feed with speed.
        """
        by_speed, by_feed = self._savings(cutting_speed, feed)
        gap = self.breaking_exponent * self.breaking(feed) - self._feed_slope(feed)
        return by_speed * gap - by_feed * self.speed_force * cutting_speed

    def power_residual(self, cutting_speed: Any, feed: Any) -> Any:
        """Return what is 0 on the locus of the power (W), at a cutting speed (mm/s) and feed (mm).

        With P_c v = P_max put into stationarity no wear is in it: [1 + (1 - n) tau/T] q K_c f^q v - [1 + (1 - p) tau/T]
        (P_max - C_v v^2). Where C_v is small it is nowhere 0: a spindle at its limit wants the greatest feed, and the speed
        gives way.
        """
        if self.power_max is None:
            raise ValueError(
                "power_max must be given for power_residual; got None: the machine has power enough"
            )
        by_speed, by_feed = self._savings(cutting_speed, feed)
        speed = cutting_speed / N_MM_S_PER_W
        return by_speed * self._feed_slope(feed) * speed - by_feed * (
            self.power_max - self.speed_force * speed * cutting_speed
        )

    def _savings(self, cutting_speed: Any, feed: Any) -> tuple[Any, Any]:
        """By how much the cost falls with speed and with feed, in shares of 1/(v f): the brackets of (35)."""
        changes = self.tool_change_time / self.tool_life(cutting_speed, feed)
        return 1 + changes * (1 - self.taylor_v_exp), 1 + changes * (1 - self.taylor_f_exp)

    def _feed_slope(self, feed: Any) -> Any:
        """How the force rises with the logarithm of the feed, N."""
        return self.force_exponent * self.feed_force * feed**self.force_exponent

    def _breaks(self, what: str) -> float:
        if self.breaking_force is None:
            raise ValueError(f"breaking_force must be given for {what}; got None: the tool does not break")
        return self.breaking_force
