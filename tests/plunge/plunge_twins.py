"""Slow twins of the compiled loops of plunge cycles, from the formulas of the source."""

import copy
import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ndtri


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
        reach = np.sqrt(self.alpha * np.sqrt(self.d_e * v / self.turns) / self.v_w) / 0.915
        return reach * np.log((self.power(v) - self.u0 * removal) / (stood - self.u0 * removal))

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


class Axis:
    """Axis (mm) of a drive: the exact answer of p' = (target - p)/lag to commands that act later."""

    def __init__(self, drive, dt):
        self.lag, self.dt, self.waiting = drive.feed_lag, dt, [0.0] * drive.delay_samples(dt)
        self.target = self.at = 0.0

    def move(self, command):
        """Positions before, in the middle and at the end of a sample."""
        u = [*self.waiting, command][0]
        self.waiting = [*self.waiting, command][1:]
        places = [self._after(u, share * self.dt) for share in (0.0, 0.5, 1.0)]
        self.target, self.at = self.target + u * self.dt, places[-1]
        return places

    def _after(self, u, t):
        if self.lag == 0:
            return self.target + u * t
        late = u * self.lag + (self.target - self.at - u * self.lag) * math.exp(-t / self.lag)
        return self.target + u * t - late


class Filter:
    """The extended Kalman filter of a part with matrices: q, c', s, a, gamma, g, power shown."""

    def __init__(self, problem):
        self.problem, self.model, self.doubts = problem, problem.model, problem.uncertainty
        self.dt, self.idle = problem.sample_time, problem.drive.idle_power
        self.lag = problem.drive.power_lag
        self.pole = math.exp(-self.dt / self.lag) if self.lag else 0.0
        self.axis, self.base = Axis(problem.drive, self.dt), Wheel(self.model)
        self.touched, self.before, self.mean = False, [], np.zeros(7)

    def wheel(self, area):
        return Wheel(self.model, self.model.wear_flat_area * area)

    def deflection(self, mean, position):
        q, load, stiff, _, wear, _, _ = mean
        return (load / stiff + position - (1 + wear) * q) * stiff

    def rate(self, x, area):
        return self.wheel(area).rate(x - self.base.K0)

    def stepped(self, mean, before, middle):
        """Mean a sample later, and deflection and rate in its middle."""
        q, _, stiff, area, wear, _, shown = mean
        ground = (1 + wear) * stiff * 0.5 * self.dt * self.rate(self.deflection(mean, before), area)
        half = self.deflection(mean, middle) - ground
        v = self.rate(half, area)
        growth = 0.0 if self.model.wear is None else self.model.wear.growth / self.model.wear_flat_area
        after = mean.copy()
        after[0], after[3] = q + v * self.dt, area + growth * v * self.dt
        after[6] = self.pole * shown + (1 - self.pole) * self.base.watts * max(half, 0.0)
        return after, half, v

    def by_states(self, mean, x, v):
        """Derivatives of deflection and rate by the states."""
        q, load, stiff, area, wear, _, _ = mean
        by_x = np.array([-(1 + wear) * stiff, 1.0, (x - load) / stiff, 0.0, -q * stiff, 0.0, 0.0])
        if v <= 0:
            return by_x, np.zeros(7)
        slope = self.wheel(area).slope(v)
        return by_x, by_x / slope - self.base.K2 * v**0.85 / slope * np.eye(7)[3]

    def jacobian(self, mean, x, v):
        """Slopes of `stepped`, by those in the middle of the sample."""
        by_x, by_v = self.by_states(mean, x, v)
        out = np.eye(7)
        out[0] += self.dt / (1 - 0.5 * self.dt * by_v[0]) * by_v
        out[6] = self.pole * np.eye(7)[6] + (1 - self.pole) * self.base.watts * by_x
        return out

    def predict(self, command):
        before, middle, _ = self.axis.move(command)
        if not self.touched:
            return
        after, x, v = self.stepped(self.mean, before, middle)
        slopes = self.jacobian(self.mean, x, v)
        share = v * self.dt / self.problem.stock
        drift = np.diag(
            [1e-10 * self.dt, 0.0, 0.0, self.doubts.sharpness_change_sd**2 * share, 0.0, 0.0, 0.0]
        )
        self.mean, self.covariance = after, slopes @ self.covariance @ slopes.T + drift

    def correct(self, off, row, variance):
        gain = self.covariance @ row / (row @ self.covariance @ row + variance)
        self.mean = self.mean + gain * off
        self.covariance = (np.eye(7) - np.outer(gain, row)) @ self.covariance

    def touch(self, power, noise):
        """Errors that are independent: size, power, what the monitor lags, stiffness, area, wear, gain."""
        d, wear = self.doubts, self.model.wheel_wear
        self.touched, x, q = True, power / self.base.watts, float(np.mean(self.before))
        late = self.dt + self.problem.drive.feed_lag + 2 * self.lag
        lagged = self.problem.command_rate_max * late if late > self.dt else 0.0
        lever = (1 + wear) * q - self.axis.at
        self.mean = np.array([q, x + lever, 1.0, 1.0, wear, 0.0, power])
        sources = {
            "size": (d.size_sd / math.sqrt(len(self.before)), {0: 1, 1: 1}),
            "power": (noise / self.base.watts, {1: 1}),
            "lagged": (lagged, {1: 1}),
            "shown": (noise, {6: 1}),
            "stiffness": (d.deflection_sd, {1: lever, 2: 1}),
            "area": (d.sharpness_sd, {3: 1}),
            "wear": (d.wheel_wear_sd, {4: 1}),
            "gain": (d.power_gain_sd, {1: -x, 5: 1}),
        }
        errors = np.zeros((7, len(sources)))
        for k, (sd, moved) in enumerate(sources.values()):
            for state, share in moved.items():
                errors[state, k] = sd * share
        self.covariance = errors @ errors.T

    def read(self, size, power):
        """Take readings; NaN: none."""
        power -= self.idle
        if not self.touched:
            self.before += [] if np.isnan(size) else [size]
            noise = self.doubts.power_sd * (max(power, self.base.watts * self.base.K0) + self.idle)
            if power > 5 * noise:
                self.touch(power, noise)
            return
        if not np.isnan(size):
            self.correct(size - self.mean[0], np.eye(7)[0], self.doubts.size_sd**2)
        if power > 0:
            self.read_power(power)

    def read_power(self, power):
        gain, watts, x = 1 + self.mean[5], self.base.watts, self.deflection(self.mean, self.axis.at)
        if self.lag:
            shown, row = self.mean[6], gain * np.eye(7)[6]
        else:
            shown, row = watts * x, gain * watts * self.by_states(self.mean, x, 0.0)[0]
        row = row + shown * np.eye(7)[5]
        noise = self.doubts.power_sd * (max(gain * shown, watts * self.base.K0) + self.idle)
        self.correct(power - gain * shown, row, noise**2)


class SafePosition:
    """min over q of E(q) by a scan of q and, for each, of the rates: the rule as it is written."""

    def __init__(self, controller, mean, covariance):
        self.c, self.problem, self.model = controller, controller.problem, controller.problem.model
        self.mean, self.covariance, self.doubts = mean, covariance, controller.problem.uncertainty
        self.k, self.k_filter = -ndtri(1 - controller.confidence), -ndtri((1 - controller.confidence) / 10)
        growth = 0.0 if self.model.wear is None else self.model.wear.growth / self.model.wear_flat_area
        self.growth = growth

    def wheel(self, left):
        """Wheel when a stock (mm) is left."""
        gone = max(self.problem.stock - left - self.mean[0], 0.0)
        return Wheel(self.model, self.model.wear_flat_area * (self.mean[3] + self.growth * gone))

    def depth(self, v, wheel):
        """Depth of damage (mm) exceeded with the chance allowed, by derivatives of r - z by the states."""
        v = np.atleast_1d(v)
        reach = np.sqrt(self.model.diffusivity * np.sqrt(wheel.d_e * v / wheel.turns) / wheel.v_w) / 0.915
        z, slope = wheel.burn_depth(v), wheel.slope(v)
        q, load, stiff, area, wear, _, _ = self.mean
        x, one, none = wheel.K0 + wheel.beyond(v), np.ones(v.size), np.zeros(v.size)
        by_x = np.array([-(1 + wear) * stiff * one, one, (x - load) / stiff, none, -q * stiff * one])
        of_area = np.array([none, none, none, wheel.K2 / area * v**0.85, none])  # dx/da at a rate
        by_v = (by_x - of_area) / slope
        hot = wheel.power(v) - wheel.u0 * math.pi * wheel.diameter * wheel.width * v
        h = 1e-5 * v
        of_rate = (wheel.burn_depth(v + h) - wheel.burn_depth(v - h)) / (2 * h)
        rows = -np.eye(5)[:, :1] - of_rate * by_v - reach * wheel.watts / hot * of_area
        static = (reach * (self.doubts.burning_sd or 0.0)) ** 2 + (0.5 * z * self.doubts.diffusivity_sd) ** 2
        of_filter = np.maximum(np.einsum("iv,ij,jv->v", rows, self.covariance[:5, :5], rows), 0.0)
        return z + np.sqrt(self.k**2 * static + self.k_filter**2 * of_filter)

    def rate(self, left, slowest):
        """Greatest rate whose depth is within a stock (mm) less the margin; else the slowest."""
        allowed = 0.0 if self.c.no_burn else max(left - self.c.safety_margin, 0.0)
        low, high = slowest, self.problem.command_rate_max
        for count in (1000, 20):  # linear between the last: 1e-9 mm, and near the slowest rate, too
            rates = np.geomspace(low, high, count)
            off = self.depth(rates, self.wheel(left)) - allowed
            fits = np.flatnonzero(off <= 0.0)
            if not fits.size or fits[-1] == rates.size - 1:
                return rates[-1] if fits.size else low
            k = fits[-1]
            low, high = rates[k], rates[k + 1]
        return rates[k] + (rates[k + 1] - rates[k]) * off[k] / (off[k] - off[k + 1])

    def limit(self, left, v):
        """E (mm) at a stock left."""
        wheel, wear = self.wheel(left), self.mean[4]
        x = wheel.K0 + wheel.beyond(v)
        return (1 + wear) * (self.problem.stock - left) + (x - self.mean[1]) / self.mean[2]

    def least(self, ahead, slowest, steps=200):
        """Least E from now on (mm), and the rate at size (mm/s)."""
        now = max(self.problem.stock - self.mean[0] - ahead, 0.0)
        lefts = np.unique(np.append(np.linspace(0.0, now, steps), min(self.c.safety_margin, now)))
        found = [self.limit(left, self.rate(left, slowest)) for left in lefts]
        final = min(self.c.final_rate, self.rate(0.0, slowest))
        return min(*found, self.limit(0.0, final) - self.kept(final)), final

    def kept(self, v):
        """Three standard deviations of E at size (mm), by differences, beyond the noise of the size."""
        steps = np.diag([1e-5, 1e-5, 1e-4, 1e-4, 1e-4])
        slope = np.empty(5)
        for k, step in enumerate(steps):
            moved = []
            for sign in (1, -1):
                other = copy.copy(self)
                other.mean = self.mean + np.append(sign * step, (0.0, 0.0))
                moved.append(other.limit(0.0, v))
            slope[k] = (moved[0] - moved[1]) / (2 * step[k])
        return max(3 * math.sqrt(slope @ self.covariance[:5, :5] @ slope) - self.doubts.size_sd, 0.0)


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
