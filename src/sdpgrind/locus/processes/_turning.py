"""Turning, milling and drilling: cost of a surface, tool life, tool breakage, spindle power."""

from collections.abc import Mapping
from dataclasses import KW_ONLY
from math import inf
from typing import Any

from sdpgrind.base import checks
from sdpgrind.base.quantities import Described, described, forgotten, quantity
from sdpgrind.base.units import N_MM_S_PER_W
from sdpgrind.locus._problem.process import Varying

SPEEDS = 5.0, 50.0  # chosen: life_speed over the least, and the greatest over life_speed, of a range's end


def tool_change_time(
    *, change: float, edge_cost: float, machine_rate: float, profit_rate: float = 0.0
) -> float:
    """Return the time tau (s) that a worn edge is worth: t1 + C2/(C1 + profit rate), after Koren (3).

    Profit rate 0: least cost. Infinite: greatest production rate. The greatest profit per time lies between,
    where `profit_rate` equals the profit rate at the optimum itself.

    Parameters
    ----------
    change : float
        Time t1 of a tool change, s.
    edge_cost : float
        Cost C2 of an edge, or of its regrinding, $.
    machine_rate : float
        Cost C1 of machine and operator, $/s.
    profit_rate : float
        Profit per time, $/s. ``math.inf``: greatest production rate.

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
    """Cutting at least cost with a wearing tool: Koren (1) to (6), (27) to (35).

    Controls: ``cutting_speed`` v (mm/s), ``feed`` f (mm per turn; milling: mm per tooth). Hidden state:
    ``flank_wear`` W (mm), width of the wear land. Tool life T = life (v/life_speed)^-n (f/life_feed)^-p.

    * Cost (1 + tau/T)/(v f): time per surface with tool changes, s/mm^2.
    * Constraint ``cutting_force`` K_c f^q - C_v v + C_w W (30) <= breaking force K_b f^nb (27), N.
    * Constraint ``cutting_power``, that force times v, <= greatest power of the machine, W.

    At least one limit is needed. Koren's (28), K v f^m, is the power that cutting takes, here the response.

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
        C_v, decrease of the force per speed, N/(mm/s).
    wear_force : float
        C_w, force per flank wear, N/mm.
    breaking_force, breaking_exponent : float, optional
        K_b, breaking force at a feed of 1 mm, N/mm^nb, and its exponent nb, unit 1. None: unbreakable.
    power_max : float, optional
        Greatest power at the tool, W.

    Raises
    ------
    ValueError
        When n <= 1 (cost falls with speed), nb >= q (any feed is safe), no limit or a value out of range.

    Examples
    --------
    >>> turning = Turning(
    ...     tool_change_time=210.0, life=900.0, life_speed=3000.0, life_feed=0.3,
    ...     taylor_v_exp=4.0, taylor_f_exp=1.6, feed_force=3400.0, force_exponent=0.75,
    ...     speed_force=0.072, wear_force=1200.0, breaking_force=2860.0)
    >>> speed = turning.taylor_speed(feed=0.5)  # mm/s
    >>> round(speed, 2), round(turning.tool_life(speed, 0.5), 2)  # mm/s, s
    (2673.67, 630.0)
    >>> round(turning.onset_wear(feed_max=0.5), 6)  # mm: the force limits beyond
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

    def check(
        self, controls: Mapping[str, tuple[float, float]], hidden: Mapping[str, tuple[float, float]]
    ) -> None:
        """Refuse a range of the cutting speed in another unit than mm/s.

        Parameters
        ----------
        controls, hidden : mapping of str to (float, float)
            Ranges (low, high) of a problem, in their units; only that of ``cutting_speed`` (mm/s) is checked.

        Raises
        ------
        ValueError
            When the greatest cutting speed is below a fifth of `life_speed`, or above fifty times it.
        """
        fastest, typical = controls.get("cutting_speed", (0.0, self.life_speed))[1], self.life_speed
        usual = (typical / SPEEDS[0], typical * SPEEDS[1])
        if not usual[0] <= fastest <= usual[1]:
            meant = forgotten(fastest, "mm/s", usual, typical)
            raise ValueError(
                f"cutting_speed must be in mm/s, its greatest some {typical:g} as life_speed{meant};"
                f" got {fastest!r}"
            )

    @property
    def constraints(self) -> tuple[Varying, ...]:
        """Force <= breaking force (N) and power <= that of the machine (W), as given."""
        force = Varying(response=self._force, limit=self._breaking, name="cutting_force", unit="N")
        power = Varying(response=self._power, limit=self._power_limit, name="cutting_power", unit="W")
        given = (self.breaking_force, force), (self.power_max, power)
        return tuple(varying for value, varying in given if value is not None)

    @property
    def units(self) -> Mapping[str, str]:
        """Units of controls, hidden state and cost."""
        return {"cutting_speed": "mm/s", "feed": "mm", "flank_wear": "mm", "cost": "s/mm^2"}

    def cost(self, s: Any, c: Any) -> Any:
        """Return (1 + tau/T)/(v f) (s/mm^2) for controls ``c``, Koren (2); ``s`` is unused."""
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
        """Return the tool life (s) for a cutting speed (mm/s) and feed (mm), Koren (5) at one feed."""
        slower = (cutting_speed / self.life_speed) ** -self.taylor_v_exp
        return self.life * slower * (feed / self.life_feed) ** -self.taylor_f_exp

    def cutting_force(self, cutting_speed: Any, feed: Any, flank_wear: Any) -> Any:
        """Return the force (N), Koren (30), for a cutting speed (mm/s), feed (mm) and flank wear (mm)."""
        return (
            self.feed_force * feed**self.force_exponent
            - self.speed_force * cutting_speed
            + self.wear_force * flank_wear
        )

    def breaking(self, feed: Any) -> Any:
        """Return the breaking force (N) at a feed (mm): K_b f^nb, Koren (27)."""
        return self._breaks("breaking") * feed**self.breaking_exponent

    def taylor_speed(self, feed: Any) -> Any:
        """Return the cheapest unlimited speed (mm/s) at a feed (mm): T = tau (n - 1), Koren (6)."""
        longer = self.life / (self.tool_change_time * (self.taylor_v_exp - 1))
        n = self.taylor_v_exp
        return self.life_speed * longer ** (1 / n) * (feed / self.life_feed) ** (-self.taylor_f_exp / n)

    @property
    def strongest_feed(self) -> float:
        """Feed f_pk = (nb K_b/(q K_c))^(1/(q - nb)) (mm) of the greatest admissible wear."""
        ratio = (
            self.breaking_exponent * self._breaks("strongest_feed") / (self.force_exponent * self.feed_force)
        )
        return float(ratio ** (1 / (self.force_exponent - self.breaking_exponent)))

    def wear_at_limit(self, cutting_speed: Any, feed: Any) -> Any:
        """Return the flank wear (mm) at breakage for a cutting speed (mm/s) and feed (mm): (34)."""
        return (self.breaking(feed) - self.cutting_force(cutting_speed, feed, 0.0)) / self.wear_force

    def onset_wear(self, feed_max: float) -> float:
        """Return the flank wear (mm) above which the force limits a cut at the feed `feed_max` (mm).

        The speed is its Taylor speed.

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
        """Return the flank wear (mm) of breakage at any feed up to `cutting_speed_max` (mm/s)."""
        speed = checks.positive("cutting_speed_max", cutting_speed_max, "mm/s")
        return float(self.wear_at_limit(speed, self.strongest_feed))

    def force_residual(self, cutting_speed: Any, feed: Any) -> Any:
        """Return the residual (N) of Koren (35), 0 on the locus, for a cutting speed (mm/s), feed (mm).

        [1 + (1 - n) tau/T] (nb P_b - q K_c f^q) - [1 + (1 - p) tau/T] C_v v, free of wear. On the locus v is
        above the Taylor speed of its feed, as the force falls with speed.
        """
        by_speed, by_feed = self._savings(cutting_speed, feed)
        gap = self.breaking_exponent * self.breaking(feed) - self._feed_slope(feed)
        return by_speed * gap - by_feed * self.speed_force * cutting_speed

    def power_residual(self, cutting_speed: Any, feed: Any) -> Any:
        """Return the residual (W) of the locus of the power, at a cutting speed (mm/s) and feed (mm).

        P_c v = P_max in the stationarity condition gives, free of wear,
        ``[1 + (1 - n) tau/T] q K_c f^q v - [1 + (1 - p) tau/T] (P_max - C_v v^2)``. With small C_v it has no
        zero: the optimum keeps the greatest feed and reduces the speed.
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
        """Return the brackets of (35): relative fall of the cost with speed and with feed, times v f."""
        changes = self.tool_change_time / self.tool_life(cutting_speed, feed)
        return 1 + changes * (1 - self.taylor_v_exp), 1 + changes * (1 - self.taylor_f_exp)

    def _feed_slope(self, feed: Any) -> Any:
        """Return the slope of the force by the logarithm of the feed, N."""
        return self.force_exponent * self.feed_force * feed**self.force_exponent

    def _breaks(self, what: str) -> float:
        if self.breaking_force is None:
            raise ValueError(f"breaking_force must be given for {what}; got None: the tool does not break")
        return self.breaking_force
