"""Readings of rings with lobes and of a roller that is not round, solved sample by sample, for tests."""

import numpy as np

RADIUS, TIP = 61.94, 3.75
# Mears, Table 6.5: upr and um
TABLE = {
    43: 0.235,
    3: 0.206,
    2: 0.155,
    6: 0.048,
    44: 0.040,
    21: 0.038,
    22: 0.036,
    42: 0.029,
    4: 0.018,
    18: 0.018,
}  # Mears 6.5, um
LOBES = {upr: 1e-3 * amplitude for upr, amplitude in TABLE.items()}


def turn(turns=1.0, points=360, start=0.0):
    """Spindle angles of whole or broken turns."""
    return start + np.arange(round(turns * points)) * 2 * np.pi / points


def phases(seed, lobes=LOBES):
    rng = np.random.default_rng(seed)
    return {upr: (amplitude, float(rng.uniform(-np.pi, np.pi))) for upr, amplitude in lobes.items()}


def form(part_angle, lobes):
    return sum((a * np.cos(n * part_angle - p) for n, (a, p) in lobes.items()), np.zeros_like(part_angle))


def measured(
    angle,
    *,
    offset=0.0,
    direction=0.7,
    lobes=None,
    tip=TIP,
    runout=(0.0, 1.0, 0.0),
    slip=None,
    noise=0.0,
    rng=0,
):
    """Readings: the tip's centre c + far(beta) u(beta), far = R + tip + form + runout, must lie on the line at
    `angle`: far(beta) sin(beta - angle) = offset sin(angle - direction), by iteration.
    """
    c = offset * np.array([np.cos(direction), np.sin(direction)])
    amplitude, ratio, phase = runout

    def far(beta):
        late = 0.0 if slip is None else np.where(beta > slip[0], slip[1] / tip, 0.0)
        return RADIUS + tip + form(beta, lobes or {}) + amplitude * np.cos(ratio * beta - phase + late)

    beta, aside = angle, offset * np.sin(angle - direction)
    for _ in range(6):  # each reduces the error by offset/far times the slope of the form: 200 times or more
        beta = angle + np.arcsin(aside / far(beta))
        if offset == 0.0:
            break
    away = far(beta)
    reading = np.hypot(c[0] + away * np.cos(beta), c[1] + away * np.sin(beta)) - tip
    return reading + noise * np.random.default_rng(rng).normal(size=angle.size)


def vector(spectrum, upr):
    """Amplitude and phase of one undulation as a complex number."""
    return spectrum.amplitude[upr - 1] * np.exp(1j * spectrum.phase[upr - 1])
