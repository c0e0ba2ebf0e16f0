"""Predicted rotation of the table on the way to its set point."""

from math import inf, sqrt

from centering.cycle._strategy.turning_kernels import speed_after, turn_time


class TableMotion:
    """Predicted motion of a table that changes to its set point at a known acceleration.

    Parameters
    ----------
    acceleration : float
        Acceleration at first, rad/s^2; `acceleration` may be set to another.

    Examples
    --------
    >>> table = TableMotion(10.0)
    >>> table.see(0.0, 0.0, 0.0)
    >>> table.set_point = 10.0
    >>> table.time_to(5.0), table.time_to(15.0), table.speed_at(1.25)  # 1 s of ramp, another at full speed
    (1.0, 2.0, 5.0)
    """

    def __init__(self, acceleration: float) -> None:
        self._most = acceleration
        self.reset()

    def reset(self) -> None:
        """Stand still, with the initial acceleration."""
        self.acceleration = self._most
        self.time = self.angle = self.speed = self.set_point = 0.0

    def see(self, time: float, angle: float, speed: float) -> None:
        """Store the measured motion.

        Parameters
        ----------
        time, angle, speed : float
            Time, s; angle, rad, turns counted; speed, rad/s.
        """
        self.time, self.angle, self.speed = time, angle, speed

    def time_to(self, angle: float, steady: float = 0.0) -> float:
        """Return the time until an angle is reached, s; 0 for an angle already passed.

        Parameters
        ----------
        angle : float
            Angle, rad, turns counted.
        steady : float
            Time before that in which the table keeps its speed, s.
        """
        way = angle - self.angle
        if way <= 0.0:
            return 0.0
        if self.set_point == self.speed == 0.0:
            return inf
        return float(turn_time(way, self.speed, self.set_point, self.acceleration, 0.0, steady))

    def speed_at(self, angle: float) -> float:
        """Return the speed at an angle ahead, rad/s.

        Parameters
        ----------
        angle : float
            Angle, rad, turns counted.
        """
        way = max(angle - self.angle, 0.0)
        if self.set_point >= self.speed:
            return min(sqrt(self.speed * self.speed + 2.0 * self.acceleration * way), self.set_point)
        return max(sqrt(max(self.speed * self.speed - 2.0 * self.acceleration * way, 0.0)), self.set_point)

    def speed_in(self, time: float) -> float:
        """Return the speed in a time (s) from now, rad/s."""
        return float(speed_after(time, self.speed, self.set_point, self.acceleration, 0.0, 0.0))
