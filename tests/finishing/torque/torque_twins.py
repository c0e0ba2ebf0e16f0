"""Slow, obvious twins of the torque axis and of its controllers."""

import numpy as np


def axis_twin(start, drives, surface, axis, steps=50):
    """Angle and speed after each tick, by many small steps of Runge and Kutta, cut where it touches or lifts."""
    inertia, stiffness, _, tick = axis
    x, found = np.array(start, dtype=float), []
    for k, drive in enumerate(drives):
        slope = (surface[k + 1] - surface[k]) / tick
        x = x - np.array([surface[k], slope])
        for _ in range(steps):
            x = _step(x, tick / steps, x[0] > 0 or (x[0] == 0 and x[1] > 0), drive, inertia, stiffness)
        x = x + np.array([surface[k + 1], slope])
        found.append(x)
    return np.array(found)


def _step(x, h, touching, drive, inertia, stiffness):
    def flow(x):
        return np.array([x[1], (drive - stiffness * x[0] * touching) / inertia])

    def run(h):
        a = flow(x)
        b = flow(x + h / 2 * a)
        c = flow(x + h / 2 * b)
        return x + h / 6 * (a + 2 * b + 2 * c + flow(x + h * c))

    end = run(h)
    if (end[0] > 0) == touching:
        return end
    low, high = 0.0, h
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if (run(middle)[0] > 0) == touching else (low, middle)
    there = np.array([0.0, run(low)[1]])
    return _step(there, h - low, not touching, drive, inertia, stiffness)


class PidffTwin:
    """PID plus feedforward with the observer in its PID or its state form, sample by sample, as one would
    write it down.
    """

    def __init__(self, axis, gains, observer="pid", prefilter=False):
        self.axis, self.g, self.observer = axis, gains, observer
        self.rate = gains.prefilter_rate(axis) if prefilter else None
        self.before = None

    def sample(self, angle, wanted):
        a, g, h = self.axis, self.g, self.axis.sample_time
        if self.before is None:
            self.before, self.angle, self.speed, self.third, self.sum, self.filtered = (
                angle,
                angle,
                0.0,
                0.0,
                0.0,
                0.0,
            )
        omega, self.before = (angle - self.before) / h, angle
        e = angle - self.angle
        if self.observer == "pid":
            self.third += h * g.obs_ki * e
            pull = g.obs_kp * e + self.third + g.obs_kd * (omega - self.speed)
            estimate = -pull
        else:
            estimate = self.third
        if self.rate is not None:
            self.filtered += (1 - np.exp(-self.rate * h)) * (wanted - self.filtered)
            wanted = self.filtered
        error = wanted - estimate
        total = self.sum + h * error
        feedback = g.kp * error + g.ki * total - g.kd * a.contact_angular_stiffness * omega
        torque = a.inertia / a.contact_angular_stiffness * feedback + wanted
        limit = a.torque_constant * a.current_limit
        if not (abs(torque) > limit and torque * error > 0):
            self.sum = total
        current = rounded(a, torque / a.torque_constant)
        drive = a.torque_constant * current
        if self.observer == "pid":
            gain = (drive + pull) / a.inertia
            self.angle += h * self.speed + h * h / 2 * gain
        else:
            gain = (drive - self.third + g.obs_kp * e) / a.inertia
            self.angle += h * self.speed + h * h / 2 * gain + h * g.obs_kd / a.inertia * e
            self.third -= h * g.obs_ki * e
        self.speed += h * gain
        return current, estimate


class DampedTwin:
    """Constant torque less damping."""

    def __init__(self, axis, gains):
        self.axis, self.g, self.before, self.slow = axis, gains, None, 0.0

    def sample(self, angle, wanted):
        h = self.axis.sample_time
        omega = 0.0 if self.before is None else (angle - self.before) / h
        self.before = angle
        share = np.exp(-h / self.g.highpass_time)
        self.slow = share * self.slow + (1 - share) * omega
        damping = 2 * self.g.damping * np.sqrt(self.axis.contact_angular_stiffness * self.axis.inertia)
        current = rounded(self.axis, (wanted - damping * (omega - self.slow)) / self.axis.torque_constant)
        return current, self.axis.torque_constant * current


class LqgTwin:
    """Kalman filter and state feedback with matrices; the gain of the filter by iterating the covariance."""

    def __init__(self, axis, gains):
        self.axis, self.g, self.x = axis, gains, None
        self.A, self.B, self.Q = gains.sampled(axis)
        self.L = riccati(self.A, self.Q, axis.angle_step**2 / 12)

    def sample(self, angle, wanted):
        a, C = self.axis, np.array([1.0, 0, 0, 0])
        if self.x is None:
            self.x = np.array([angle, 0, -a.contact_angular_stiffness * angle, 0])  # nothing is touched there
        now = self.x + self.L * (angle - C @ self.x)
        k = a.contact_angular_stiffness
        estimate = k * now[0] + now[2]
        first = self.g.bandwidth**2 * a.inertia - k
        second = 2 * self.g.damping * self.g.bandwidth * a.inertia
        torque = wanted - first * (estimate - wanted) / k - second * (now[1] + now[3] / k)
        current = rounded(a, torque / a.torque_constant)
        self.x = self.A @ now + self.B * a.torque_constant * current
        return current, estimate


def riccati(A, Q, R):
    """Stationary gain of a Kalman filter of the first state, by what happens sample by sample."""
    P = 1e3 * np.eye(4)
    for _ in range(3000):
        L = P[:, 0] / (P[0, 0] + R)
        P = A @ (P - np.outer(L, P[0])) @ A.T + Q
        P = (P + P.T) / 2
    return P[:, 0] / (P[0, 0] + R)


def rounded(axis, current):
    """In the converter's steps and within the limit."""
    step = 2 * axis.current_range / 2**axis.bits
    most = step * np.floor(axis.current_limit / step + 1e-9)
    return float(np.clip(step * np.floor(current / step + 0.5), -most, most))
