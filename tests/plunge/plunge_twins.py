"""Slow twins of the compiled loops of plunge cycles, from the formulas of the source."""

import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq


class Wheel:
    """Deflection x = K0 + K1 v + K2 v^0.85 (mm), power (W) and depth of damage (mm) of a wear flat area."""

    def __init__(self, model, area=None):
        m, area = model, model.wear_flat_area if area is None else area
        turns, speed = m.work_rotation / (2 * math.pi), m.wheel_speed / 1000
        d_e = m.wheel_diameter * m.work_diameter / (m.work_diameter - m.wheel_diameter)
        gives = m.normal_force_ratio * m.width / m.stiffness
        self.d_e, self.turns, self.v_w = d_e, turns, math.pi * m.work_diameter * turns
        self.K0 = gives * m.power.ploughing_force
        self.K1 = gives * m.power.specific_energy * math.pi * m.work_diameter / speed
        self.K2 = gives * 842 / 9 * (d_e / turns) ** 0.85 * area
        self.watts = speed * m.stiffness / m.normal_force_ratio  # of a mm of deflection
        self.width, self.diameter, self.u0, self.B, self.alpha = (
            m.width,
            m.work_diameter,
            m.burning.u0,
            m.burning.B,
            m.diffusivity,
        )

    def beyond(self, v):
        return self.K1 * v + self.K2 * v**0.85

    def rate(self, y):
        """Infeed rate (mm/s) of a deflection y beyond ploughing."""
        return (
            brentq(lambda v: self.beyond(v) - y, 0.0, y / self.K1, xtol=1e-300, rtol=1e-14) if y > 0 else 0.0
        )

    def slope(self, v):
        return self.K1 + 0.85 * self.K2 * v**-0.15

    def power(self, v):
        return self.watts * (self.K0 + self.beyond(v))

    def burn_depth(self, v):
        """Signed depth of damage, mm."""
        removal = math.pi * self.diameter * self.width * v
        stood = self.u0 * removal + self.B * self.width * (self.d_e * v / self.turns) ** 0.25 * math.sqrt(
            self.v_w
        )
        reach = math.sqrt(self.alpha * math.sqrt(self.d_e * v / self.turns) / self.v_w) / 0.915
        return reach * math.log((self.power(v) - self.u0 * removal) / (stood - self.u0 * removal))

    def burn_rate(self, high):
        """Rate at which damage begins, by a scan from above; None: the work burns at every rate."""
        rates = np.geomspace(high, 1e-6, 400)
        depths = [self.burn_depth(v) for v in rates]
        for v, below, depth in zip(rates[:-1], rates[1:], depths[1:], strict=True):
            if depth < 0:
                return (
                    high
                    if v == high and self.burn_depth(high) <= 0
                    else brentq(self.burn_depth, below, v, rtol=1e-14)
                )
        return None

    def step(self, y, command, duration):
        """One step of Runge and Kutta of y' = u - v(y), a straight line below 0."""
        if y < 0:
            if y + command * duration <= 0:
                return y + command * duration
            y, duration = 0.0, (y + command * duration) / command
        a = command - self.rate(y)
        b = command - self.rate(y + duration / 2 * a)
        c = command - self.rate(y + duration / 2 * b)
        d = command - self.rate(y + duration * c)
        return y + duration / 6 * (a + 2 * b + 2 * c + d)


def ground(model, commands, sample_time, y, worn=1.0):
    """Deflection beyond ploughing, removed stock (mm) and wear after each command, by a high-order
    integrator.
    """
    wear, rows = model.wear, []
    removed = 0.0

    def slope(command, state):
        wheel = Wheel(model, model.wear_flat_area * state[2])
        v = wheel.rate(state[0])
        grows = (
            0.0
            if wear is None
            else wear.growth * (v / wear.reference_rate) ** wear.exponent * v / model.wear_flat_area
        )
        return [command - v, v, grows]

    for held in commands:
        end = solve_ivp(
            lambda _, state, command=held: slope(command, state),
            (0, sample_time),
            [y, removed, worn],
            rtol=1e-9,
            atol=1e-12,
            max_step=sample_time / 2,
        ).y[:, -1]
        y, removed, worn = (float(value) for value in end)
        rows.append((y, removed, worn))
    return np.array(rows)


class Filter:
    """The extended Kalman filter of deflection x, contact zero, scale and area, with matrices."""

    def __init__(self, controller):
        self.c, self.problem = controller, controller.problem
        self.model, self.dt = self.problem.model, self.problem.sample_time
        self.base = Wheel(self.model)
        self.touched, self.commanded, self.before = False, 0.0, []

    @property
    def wheel(self):
        return Wheel(self.model, self.model.wear_flat_area * self.mean[3])

    def touch(self, x, noise):
        self.touched = True
        self.mean = np.array([x, np.mean(self.before) + x - self.commanded, 1.0, 1.0])
        errors = np.zeros((4, 4))  # of x, of the gauge, of the scale, of the area
        errors[0, 0] = noise
        errors[1, :3] = noise, self.c.size_sd / math.sqrt(len(self.before)), x * self.c.deflection_sd
        errors[2, 2], errors[3, 3] = self.c.deflection_sd, self.c.sharpness_sd
        self.covariance = errors @ errors.T

    def predict(self, command):
        self.commanded += command * self.dt
        if not self.touched:
            return
        x, _, scale, area = self.mean
        y = self.wheel.step(x - self.base.K0, command, self.dt / scale)
        ground_off = command * self.dt - scale * (y - (x - self.base.K0))
        self.mean[0] = y + self.base.K0
        jacobian = self.jacobian(y, ground_off / self.dt, command, scale, area)
        self.covariance[3, 3] += 5e-4**2 if y > 0 else 0.0  # the area drifts first, and moves the deflection
        self.covariance = jacobian @ self.covariance @ jacobian.T + np.diag([5e-6**2, 0.0, 0.0, 0.0])

    def jacobian(self, y, v, command, scale, area):
        out = np.eye(4)
        if y <= 0:
            out[0, 2] = -command * self.dt / scale**2
            return out
        slope = Wheel(self.model, self.model.wear_flat_area * area).slope(v)
        out[0, 0] = math.exp(-self.dt / (scale * slope))
        out[0, 2] = -(command - v) * self.dt / scale**2
        out[0, 3] = self.base.K2 * v**0.85 / slope * self.dt / scale
        return out

    def correct(self, off, row, variance):
        gain = self.covariance @ row / (row @ self.covariance @ row + variance)
        self.mean = self.mean + gain * off
        self.covariance = (np.eye(4) - np.outer(gain, row)) @ self.covariance

    def read(self, size, power):
        """Take readings; NaN: none."""
        if not self.touched and not np.isnan(size):
            self.before.append(size)
        x, noise = power / self.base.watts, self.c.power_sd * (power / self.base.watts + self.base.K0)
        if not self.touched:
            if x > 5 * noise:
                self.touch(x, noise)
            return
        if not np.isnan(power) and self.mean[0] > 0:
            self.correct(x - self.mean[0], np.array([1.0, 0.0, 0.0, 0.0]), noise**2)
        x, zero, scale, _ = self.mean
        if not np.isnan(size):
            off = size - (zero + self.commanded - scale * x)
            self.correct(off, np.array([-scale, 1.0, -x, 0.0]), self.c.size_sd**2)


class Printed:
    """The cycle as printed, section by section: (2), (3), (5), (7)."""

    def __init__(self, controller):
        c = self.c = controller
        p = self.p = c.problem
        self.wheel = Wheel(p.model)
        self.pole = math.exp(-p.sample_time / p.time_constant)
        self.burn_rate = self.wheel.burn_rate(p.command_rate_max)
        self.section, self.rate, self.left, self.commanded, self.command = 1, 0.0, None, 0.0, 0.0

    def step(self, size):
        dt, p = self.p.sample_time, self.p
        self.commanded += self.command * dt
        if self.left is None:
            self.left = p.stock - size
        else:
            self.left -= self.rate * dt
            cutting = self.commanded - self.wheel.K0  # of the command, beyond what ploughing takes
            if cutting > 0:
                share = 1.0 if self.command == 0 else min(cutting / (self.command * dt), 1.0)
                self.rate = self.pole**share * self.rate + (1 - self.pole**share) * self.command
            self.left += self.c.observer_gain * (p.stock - size - self.left)
        self.command = self._decide()
        return self.command

    def _decide(self):
        v, left, margin, p = self.rate, self.left, self.c.safety_margin, self.p
        if left <= 0:
            self.section = 4
            return None
        if self.section == 1:
            burn = self.wheel.burn_depth(v) if v > self.burn_rate else 0.0
            if v >= self.burn_rate if self.c.no_burn else burn > 0 and burn >= left - margin:
                self.section = 2
        if self.section < 3 and v > self.c.final_rate and left <= p.time_constant * (v - self.c.final_rate):
            self.section = 3
        if self.section == 1:
            return p.command_rate_max
        if self.section == 3:
            return self.c.final_rate if v <= self.c.final_rate else 0.0
        target = left - v * p.sample_time - margin
        aim = self.burn_rate
        if target > 0 and not self.c.no_burn:
            deepest = self.wheel.burn_depth(p.command_rate_max)
            aim = p.command_rate_max
            if deepest > target:
                aim = brentq(
                    lambda v: self.wheel.burn_depth(v) - target, self.burn_rate, aim, xtol=1e-300, rtol=1e-14
                )
        return min(max((aim - self.pole * v) / (1 - self.pole), 0.0), p.command_rate_max)
