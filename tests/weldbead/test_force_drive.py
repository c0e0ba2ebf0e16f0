"""The compiled drive: its transfer function without friction; sticking, play and backlash by closed forms and
a slow twin.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from weldbead_inside import _backlash_step, _play_step

from sdpgrind import units
from sdpgrind.base.compiling.compiled import opened
from sdpgrind.weldbead import force
from sdpgrind.weldbead.force.kernels import drive_step

backlash_step = opened(_backlash_step)
play_step = opened(_play_step)

STEP = 1 / 2880
DESIGN = force.table_drive()
THIRD = force.table_drive("appendix-b")
FAR = np.inf


def run(drive, commands, start=0.0, touch=FAR):
    """Every state of the drive for a command a sub-step."""
    core, state = drive.core(STEP), drive.start(start)
    out = []
    for command in commands:
        drive_step(state, command, core, touch)
        out.append(state.copy())
    return np.array(out)


@pytest.mark.parametrize("name", ["design", "appendix-b-linear"])
@pytest.mark.parametrize("hertz", [0.5, 5.0, 30.0])
def test_without_friction_it_is_the_transfer_function(name, hertz):
    drive = force.table_drive(name)
    t = STEP * np.arange(int(3 / STEP))
    x = run(drive, np.sin(units.hz(hertz) * t))[:, 0]  # state after the sub-step: time t + STEP
    kept = slice(len(t) // 3, None)
    w = units.hz(hertz)
    basis = np.column_stack([np.sin(w * (t + STEP)), np.cos(w * (t + STEP))])[kept]
    a, b = np.linalg.lstsq(basis, x[kept], rcond=None)[0]
    hold = np.sinc(hertz * STEP) * np.exp(-0.5j * w * STEP)
    assert a + 1j * b == pytest.approx(complex(drive.response(np.array([w]))[0] * hold), rel=1e-3, abs=1e-5)


def test_one_sub_step_is_exact_for_a_held_command():
    drive = force.table_drive("appendix-b-linear")
    A, command, _ = drive.matrices()
    start = np.array([0.1, 3.0, -0.2])
    found = solve_ivp(
        lambda _, s: A @ s + 0.5 * command, (0, STEP), start, method="Radau", rtol=1e-11, atol=1e-13
    )
    state = np.concatenate([start, [0.1, 0.1]])
    drive_step(state, 0.5, drive.core(STEP), FAR)
    assert state[:3] == pytest.approx(found.y[:, -1], rel=1e-8, abs=1e-10)


@pytest.mark.parametrize("drive", [THIRD, DESIGN.replace(stuck_band=0.01)], ids=["third", "design"])
def test_sticks_within_the_band_and_nowhere_else(drive):
    band = drive.stuck_band
    held = run(drive, np.full(2000, 0.99 * band))
    assert np.all(held[:, :2] == 0.0)  # not a nanometre, and not a nanometre a second
    moved = run(drive, np.full(4000, 1.5 * band))
    assert abs(moved[-1, 1]) < 1e-12  # overdamped: it creeps to the edge of the band for ever
    assert abs(moved[-1, 0] - 1.5 * band) <= band * (1 + 1e-9)
    assert moved[-1, 0] > 0


def test_no_chatter_at_rest_and_in_reversal():
    """The speed is exactly 0 in one stretch around each reversal of a slow sine, and changes sign only
    through it.
    """
    t = STEP * np.arange(int(4 / STEP))
    states = run(THIRD, 0.05 * np.sin(units.hz(0.5) * t))
    v = states[2000:, 1]
    signs = np.sign(v)
    changes = np.flatnonzero(np.diff(signs) != 0)
    stretches = np.split(signs, changes + 1)
    assert 8 <= len(stretches) <= 20
    for before, now, after in zip(stretches, stretches[1:], stretches[2:], strict=False):
        if now[0] == 0:
            assert before[0] * after[0] == -1
            assert len(now) > 50


def test_stick_time_of_a_reversal_in_closed_form():
    """Slow triangle: the command travels twice the band before the platform turns (lead and damping make it a
    bit less).
    """
    slope, band = 0.02, 0.01
    drive = DESIGN.replace(stuck_band=band)
    t = STEP * np.arange(int(4 / STEP))
    states = run(drive, slope * np.minimum(t, 4 - t))
    rest = np.flatnonzero((states[:, 1] == 0.0) & (t > 1))
    assert len(rest) * STEP == pytest.approx(2 * band / slope, rel=0.05)


@settings(deadline=None, max_examples=25)
@given(st.floats(-0.5, 0.5), st.floats(-20, 20), st.floats(1e-4, 0.05))
def test_friction_only_takes_energy(x, v, band):
    """v^2/2 + gain x^2/2 of the design drive does not grow while the command rests, and it comes to rest
    inside the band.

    The sub-step in which it stops or turns is the exception: friction has one sign in it, wrong by at most
    its work there."""
    drive = DESIGN.replace(stuck_band=band)
    core, state = drive.core(STEP), np.array([x, v, 0.0, x, x])
    energy, allowed = [0.5 * v**2 + 0.5 * drive.gain * x**2], []
    for _ in range(1500):
        before = state[1]
        drive_step(state, 0.0, core, FAR)
        energy.append(0.5 * state[1] ** 2 + 0.5 * drive.gain * state[0] ** 2)
        turned = state[1] * before <= 0
        allowed.append(drive.gain * band * abs(before) * STEP if turned else 0.0)
    assert np.all(np.diff(energy) <= np.array(allowed) + 1e-12 * energy[0])
    assert abs(state[0]) <= band * (1 + 1e-6) + 1e-9


def test_against_a_smooth_twin():
    """Friction as a steep function of speed, integrated by a stiff method: the same path but for its
    steepness.
    """
    drive, width = DESIGN.replace(stuck_band=0.01), 1e-4
    A, command, friction = drive.matrices()
    limit = drive.gain * drive.stuck_band

    def rates(t, s):
        return A @ s + command * 0.1 * np.sin(units.hz(1.0) * t) + friction * limit * np.tanh(s[1] / width)

    t = STEP * np.arange(1, 2881)
    twin = solve_ivp(
        rates, (0, 1), np.zeros(3), t_eval=t, method="LSODA", rtol=1e-8, atol=1e-10, max_step=1e-3
    ).y[0]
    ours = run(drive, 0.1 * np.sin(units.hz(1.0) * (t - STEP / 2)))[:, 0]
    assert np.abs(ours - twin).max() < 1e-4
    linear = run(DESIGN, 0.1 * np.sin(units.hz(1.0) * (t - STEP / 2)))[:, 0]
    assert np.abs(ours - linear).max() > 5e-3


def test_friction_shrinks_with_the_step():
    """The implicit step converges with its length."""
    drive = DESIGN.replace(stuck_band=0.01)
    ends = []
    for number in (1, 4, 16, 256):
        core, state = drive.core(STEP / number), drive.start(0.0)
        path = []
        for k in range(2880 * number // 4):
            drive_step(state, 0.1 * np.sin(units.hz(2.0) * (k + 0.5) * STEP / number), core, FAR)
            if (k + 1) % number == 0:
                path.append(state[0])
        ends.append(np.array(path))
    errors = [np.abs(end - ends[-1]).max() for end in ends[:3]]
    assert errors[1] < errors[0] / 2.5
    assert errors[2] < errors[1] / 2.5


def test_play_follows_its_closed_form():
    t = np.linspace(0, 2 * np.pi, 2001)
    played, out = 0.0, []
    for x in np.sin(t):
        played = play_step(x, played, 0.2)
        out.append(played)
    out = np.array(out)
    assert out[500] == pytest.approx(0.8, abs=1e-6)  # pushed up to the crest less half the width
    # waits through the whole width
    assert np.all(out[(t > np.pi / 2) & (np.sin(t) > 0.6)] == pytest.approx(0.8, abs=1e-6))
    assert out[1500] == pytest.approx(-0.8, abs=1e-6)


@settings(deadline=None, max_examples=50)
@given(st.floats(-1, 1), st.floats(-1, 1), st.floats(0, 0.3), st.floats(-1, 1))
def test_backlash_stays_in_its_zone_and_a_load_closes_it(position, platform, half, touch):
    out = backlash_step(position, platform, half, touch)
    assert position - half - 1e-12 <= out <= position + half + 1e-12
    if out > touch + 1e-12:
        assert out == pytest.approx(position - half, abs=1e-12)  # force, so it lies on the lower flank
    assert backlash_step(position, out, half, touch) == out


def test_backlash_matters_only_without_contact():
    drive = DESIGN.replace(backlash=0.02)
    t = STEP * np.arange(8000)
    commands = 0.3 + 0.1 * np.sin(units.hz(1.0) * t)
    pressed = run(drive, commands, touch=-1.0)
    assert pressed[100:, 4] == pytest.approx(pressed[100:, 0] - 0.01, abs=1e-12)
    loose = run(drive, commands)
    gap = loose[3000:, 0] - loose[3000:, 4]
    assert gap.min() == pytest.approx(-0.01, abs=1e-9)
    assert gap.max() == pytest.approx(0.01, abs=1e-9)
