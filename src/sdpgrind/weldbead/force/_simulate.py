"""Force loop over a stiff contact, without grinding: drive with friction, sensor, delay, controller."""

import copy
import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from sdpgrind.base import checks, pictures
from sdpgrind.base.budget import afford
from sdpgrind.base.checks import Floats
from sdpgrind.base.rng import Seed, children
from sdpgrind.weldbead.force._controller import ForceController
from sdpgrind.weldbead.force._feedback import ForcePlant
from sdpgrind.weldbead.force._kernels import delay_step, plant_sample, sensor_read, simulate_core

SUB_STEPS = 48  # chosen: sub-steps of the plant per sample; a multiple of the sensor's inner samples


@dataclasses.dataclass(frozen=True, eq=False)
class LoopRecord:
    """Record of a simulated force loop; arrays over runs first, then time.

    Attributes
    ----------
    time : array, (samples * sub-steps,)
        End of each sub-step, s.
    force, planned : array
        Force at the contact and planned force at these times, N; (runs, times) and (times,).
    command, reading : array, (runs, samples)
        Platform command, mm, and reading of the sensor, N.
    """

    time: Floats
    force: Floats
    planned: Floats
    command: Floats
    reading: Floats

    def error_rms(self, after: float = 0.0) -> Floats:
        """Return the rms force error of each run, N, leaving out what was before `after`, s."""
        kept = self.time > checks.nonnegative("after", after, "s")
        return np.asarray(np.sqrt(np.mean((self.force[:, kept] - self.planned[kept]) ** 2, axis=1)))

    def plot(self) -> Any:
        """Draw planned and actual force (N), and the platform command (mm), over time (s)."""
        return pictures.drawn("sdpgrind.weldbead.force._picture:plot_loop", self)


def simulate_loop(
    controller: ForceController,
    *,
    duration: float,
    plant: ForcePlant | None = None,
    surface: Callable[[Floats], Floats] | None = None,
    runs: int = 1,
    rng: Seed = 0,
) -> LoopRecord:
    """Run a force controller with its plan against a stiff contact, K_x = K_theta/R^2.

    The surface is where the plan expects it: a platform at the planned height makes the planned force if the
    contact is as stiff as the controller's model.

    Parameters
    ----------
    controller : ForceController
        Controller with a plan.
    duration : float
        Simulated time, s.
    plant : ForcePlant, optional
        True drive, sensor, stiffness (N/mm) and delay. Default: those of the controller's model.
    surface : callable, optional
        Deviation of the surface from the plan, towards the disc (mm), as a function of times (s): runout,
        waves.
    runs : int
        Number of runs with other sensor noise, a whole number.
    rng : int, Generator or SeedSequence
        Source of that noise.

    Returns
    -------
    LoopRecord
        Forces (N) of all runs.

    Raises
    ------
    ValueError
        When plant and controller differ in sample time (s).

    Examples
    --------
    >>> import types
    >>> from sdpgrind import units
    >>> from sdpgrind.weldbead import force
    >>> plan = types.SimpleNamespace(time=[0.0, 5.0], normal_force=[30.0, 30.0], fly_height=[10.0, 10.0])
    >>> controller = force.ForceController(plan, force.PI.design(crossover=units.hz(3.0)))
    >>> record = force.simulate_loop(controller, duration=2.0, rng=1)
    >>> bool(record.error_rms(after=1.0)[0] < 0.5)
    True
    """
    checks.kind("controller", controller, ForceController, ", as force.ForceController(plan, loop) makes one")
    plant = controller.loop.plant if plant is None else checks.kind("plant", plant, ForcePlant)
    if abs(plant.sample_time - controller.period) > 1e-9 * controller.period:
        raise checks.refuse(
            "sample_time", f"the controller's {controller.period:g} in the plant", plant.sample_time, "s"
        )
    samples = int(np.ceil(checks.positive("duration", duration, "s") / controller.period - 1e-9))
    size = 2 * 8.0 * (SUB_STEPS + 2) * samples * checks.count("runs", runs)
    afford(f"{runs} runs of {samples} samples", size, "fewer runs or a shorter duration need less")
    time = (1 + np.arange(samples * SUB_STEPS)) * controller.period / SUB_STEPS
    planned, touch = _contact(controller, time)
    touch = touch - _heights(surface, time)
    sources = children(rng, runs)
    noise = [plant.sensor.noise_sd * each.standard_normal(samples) for each in sources]
    done = [_run(controller, plant, touch.reshape(samples, SUB_STEPS), each) for each in noise]
    forces, commands, readings = (np.array([each[k] for each in done]) for k in range(3))
    return LoopRecord(time, forces.reshape(runs, -1), planned, commands, readings)


def _heights(surface: Callable[[Floats], Floats] | None, time: Floats) -> Floats:
    """Deviation of the surface from the plan, mm, at times, s."""
    if surface is None:
        return np.zeros_like(time)
    checks.able("surface", surface, "None or a function of times (s) that gives heights (mm)", "__call__")
    heights = checks.finite_array("surface(time)", surface(time), "mm")
    if heights.shape not in ((), time.shape):
        raise ValueError(
            f"surface(time) must be one height (mm) for each time (s); got {heights.shape} for {time.shape}"
        )
    return np.broadcast_to(heights, time.shape)


def _contact(controller: ForceController, time: Floats) -> tuple[Floats, Floats]:
    """Planned force, N, and platform position at which contact begins, mm, at times, s."""
    force, position = controller.planned_along(time)
    return force, position - force / controller.loop.plant.contact_stiffness


def _run(
    controller: ForceController, plant: ForcePlant, touch: Floats, noise: Floats
) -> tuple[Floats, Floats, Floats]:
    """One run: forces, commands, readings."""
    samples, step = len(noise), plant.sample_time / SUB_STEPS
    cores = plant.drive.core(step), plant.sensor.core(step)
    first = controller.planned(0.0)[1]
    drive, sensor = plant.drive.start(first), plant.sensor.start()
    queue, record = np.full(plant.delay_samples, first), np.empty_like(touch)
    if type(controller) is not ForceController:
        return _by_steps(controller, (drive, sensor, queue, cores), touch, plant.contact_stiffness, noise)
    demand, position = controller.trajectory(samples)
    commands, readings = simulate_core(
        *(controller.core, controller.start(), drive, sensor, queue, cores, demand, position),
        *(np.ascontiguousarray(touch), plant.contact_stiffness, noise, record),
    )
    return record, commands, readings


def _by_steps(
    controller: ForceController, machine: Any, touch: Floats, stiffness: float, noise: Floats
) -> tuple[Floats, Floats, Floats]:
    """One run with the controller's own `step`."""
    (drive, sensor, queue, cores), driver = machine, copy.deepcopy(controller)
    driver.reset()
    record, commands, readings = np.empty_like(touch), np.empty(len(noise)), np.empty(len(noise))
    for k in range(len(noise)):
        readings[k] = sensor_read(sensor, cores[1], noise[k])
        commands[k] = driver.step(force=readings[k])["platform_command"]
        plant_sample(delay_step(queue, commands[k]), drive, sensor, *cores, touch[k], stiffness, record[k])
    return record, commands, readings
