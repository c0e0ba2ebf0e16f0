"""FMUs of the tests, exported once; an FMU that is stepped; what the library answers."""

import tempfile
from functools import cache
from pathlib import Path

import fmpy
import numpy as np
from codegen_inside import LibrarySteps, LocusTable
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE

import sdpgrind
from sdpgrind import finishing, plunge, weldbead
from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.codegen import Recipe, Signal
from sdpgrind.weldbead import force

STEPS = 400
PLACE = tempfile.TemporaryDirectory()


@compiled(error_model="numpy")
def limited(state, share, pull, weight, out):
    """Low-pass filter of a pull; the weight must be from 0 to 10."""
    if weight < 0.0 or weight > 10.0:
        return -1
    state[0] += share * (pull - state[0]) if pull == pull else 0.0
    state[1] += 1.0
    out[0], out[1] = weight * state[0], np.exp(-state[1] * share)
    return 1 if pull != pull else 0


def pulls(rng, count):
    return [np.column_stack([rng.normal(0.0, 3.0, count), rng.uniform(0.0, 10.0, count)])]


def low_pass(share=0.125, **more):
    inputs = {"pull": Signal("N", missing=True), "weight": ""}
    given = {"inputs": inputs, "outputs": {"pressing": "N", "rest": ""}, **more}
    return Recipe(
        "low_pass", limited, law=(share,), state=(0.5, 0.0), vectors=pulls, status=("go on", "no reading"), **{"period": 0.001, **given},
    )  # fmt: skip


def table():
    key = np.linspace(0.5, 2.0, 9)
    columns = np.column_stack([np.sin(key), key**2])
    units = {"depth_of_cut": "mm", "force": "N", "rate": "mm^3/(mm*min)"}
    return LocusTable(key, columns, np.column_stack([np.cos(key), 2.0 * key]), units)


def torque():
    return finishing.TorqueController(finishing.TorqueAxis(), normal_force=1.111, kind="lqg")


def press():
    plan = type("Plan", (), {"time": [0.0, 1.0], "normal_force": [30.0, 30.0], "fly_height": [10.0, 10.0]})
    return force.ForceController(plan, force.PI.design(crossover=sdpgrind.units.hz(3.0)))


@cache
def bead():
    return weldbead.plan(weldbead.preset("P1"), tolerance=None, nodes=81)


THINGS = {
    "stages": lambda: plunge.StagedController(plunge.preset("simulation")),
    "cycle": lambda: plunge.CycleController(plunge.preset("simulation"), safety_margin=0.05),
    "torque": torque,
    "press": press,
    "bead": bead,
    "table": table,
    "low_pass": low_pass,
}


@cache
def exported(name):
    return sdpgrind.export(THINGS[name](), Path(PLACE.name) / f"{name}.fmu", target="fmi2")


@cache
def described(name):
    """Description and folder of an FMU."""
    path = str(exported(name).path)
    folder = Path(PLACE.name) / f"{name}_unpacked"
    fmpy.extract(path, str(folder))
    return fmpy.read_model_description(path), str(folder)


class Unit:
    """An instance of an FMU, past its initialization."""

    def __init__(self, name, start=0.0, **given):
        self.recipe = exported(name).recipe
        self.description, folder = described(name)
        self.references = {one.name: one.valueReference for one in self.description.modelVariables}
        identity = {"guid": self.description.guid, "modelIdentifier": name, **given}
        self.slave = FMU2Slave(unzipDirectory=folder, instanceName="one", **identity)
        self.messages = []
        self._logger = fmi2CallbackLoggerTYPE(self._log)  # kept: the FMU calls it
        callbacks = fmi2CallbackFunctions()
        callbacks.logger = self._logger
        self.slave.instantiate(callbacks=callbacks)
        self.begin(start)

    def _log(self, environment, instance, status, category, message):
        self.messages.append(message.decode("ascii"))

    def begin(self, start=0.0):
        self.time = start
        self.slave.setupExperiment(startTime=start)
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()

    @property
    def period(self):
        return self.recipe.period or 0.25

    def give(self, row):
        """Set the inputs; a NaN by its flag where it has one."""
        for (name, one), value in zip(self.recipe.inputs.items(), row, strict=True):
            if one.missing:
                self.slave.setBoolean([self.references[f"{name}_valid"]], [not np.isnan(value)])
            if not np.isnan(value):
                self.slave.setReal([self.references[name]], [value])

    def outputs(self):
        status = self.slave.getInteger([self.references["status"]])[0]
        return np.array([*self.slave.getReal([self.references[one] for one in self.recipe.outputs]), status])

    def advance(self):
        self.slave.doStep(currentCommunicationPoint=self.time, communicationStepSize=self.period)
        self.time += self.period

    def stepped(self, row):
        """Outputs and status after a row; as the library's where inputs out of range are refused."""
        self.give(row)
        try:
            self.advance()
        except FMICallException:
            return np.array([0.0] * len(self.recipe.outputs) + [-1.0])
        return self.outputs()

    def taken(self, rows):
        """Outputs and status of each row."""
        return np.array([self.stepped(row) for row in rows])

    def state(self):
        """State of the step, from the bytes of the FMU's state."""
        held = self.slave.getFMUstate()
        kept = self.slave.serializeFMUstate(held)
        self.slave.freeFMUstate(held)
        return np.frombuffer(kept[16:])[-self.recipe.state.size :]

    def close(self):
        self.slave.freeInstance()


@cache
def rows(name, seed=0):
    """Inputs of a recipe, a row a step, the chains one after the other."""
    recipe = exported(name).recipe
    chains = recipe.chains(np.random.default_rng(seed), STEPS)
    return np.concatenate(chains)[:STEPS]


@cache
def answers(name, seed=0):
    """Outputs with status, and states, of the library."""
    given = rows(name, seed)
    found = LibrarySteps(exported(name).recipe).take(given, np.zeros(len(given), dtype=bool))
    return np.column_stack([found.outputs, found.codes]), found.states
