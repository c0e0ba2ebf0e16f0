"""Kernels that take their constants as one row: the constants come back unchanged."""

import numpy as np
import pytest

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.base.states import flat
from sdpgrind.base.units import hz
from sdpgrind.weldbead import force
from sdpgrind.weldbead.force._kernels import control_sample, control_step
from sdpgrind.weldbead.force.kernels import drive_of, sensor_of


@compiled
def drive_back(row):
    return drive_of(row)


@compiled
def sensor_back(row, order):
    return sensor_of(row, order)


def same(one, other):
    return all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


def test_a_drive():
    core = force.table_drive("appendix-b").core(1e-4)
    assert same(drive_back(flat(*core)), core)


@pytest.mark.parametrize("cutoff", [None, hz(120.0)])
def test_a_sensor(cutoff):
    core = force.SensorChain(analogue_cutoff=cutoff).core(1 / 60 / 56)
    assert same(sensor_back(flat(*core), core.output.size), core)


def test_a_controller_commands_the_same():
    controller = force.ForceController(None, force.PI.design(crossover=hz(3.0)))
    core, order = controller.core, controller.core.law.B.size
    row = flat(*core.law, *core.model, *core[2:])
    one = np.zeros(order + core.model.B.size + 4)
    one[order + core.model.B.size + 1] = np.nan  # no command yet
    other, work = one.copy(), np.empty_like(one)
    for reading in (0.0, 10.0, np.nan, 12.5, 0.0):
        known = control_step(core, other, work, reading, 12.0, -3.0)
        assert control_sample(row, order, one, work, reading, 12.0, -3.0) == known
        assert np.array_equal(one, other)
