"""Centering of rings on a turning table, and measuring them there: where a ring lies, pushes, whole cycles (Mears 2006).

Where to begin:

* a ring's place: `GeometryEstimator` (reading by reading, sure or not yet) or `identify` (a batch);
* a push: `preset` gives a `CenteringProblem` (part, friction, limits, scatter), `plan_push` aims one, ``push.simulate()`` says
  what it does, `simulate_push` follows any `TipProfile`;
* friction from pushes: `FrictionEstimator`, then ``problem.updated(estimate)``;
* a cycle: `plan` solves for the `Strategy` of least time, `CenteringController` follows it, on `hwsim.CenteringMachine` or a real
  machine; `PrintedController` is the source's, to compare with;
* form: `Profile` for roundness, `plan_changeover` for the grinder, `DriftTrack` and `ControlChart` for parts over weeks.

Lengths are in mm, readings outward, angles in rad, forces in N. `hwsim.Probe` simulates the measuring head. The first call of a
kind compiles it, once on a machine: `sdpgrind.warm("centering")` does it beforehand.

Examples
--------
>>> import centering
>>> import hwsim
>>> scan = hwsim.Probe(hwsim.Ring(radius=62.0, offset=2.0, offset_angle=0.5), samples_per_turn=360).scan(turns=1.0, rng=0)
>>> circle = centering.identify((scan.angle, scan.reading), "circle", tip_radius=3.75)
>>> bool(abs(circle.radius - 62.0) < 1e-3), bool(abs(circle.offset - 2.0) < 1e-3)  # mm
(True, True)
>>> problem = centering.preset("printed").replace(mass=0.8)
>>> push = centering.plan_push(problem, offset=2.0, spindle_speed=2.0, push_speed=20.0)  # mm, rad/s, mm/s
>>> round(push.simulate().free_slide, 2) < 0.5, push.stroke > 2.0  # mm
(True, True)
"""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(
    __name__,
    __file__,
    ("circle", "roundness", "push", "friction", "cycle", "setup", "monitoring", "push.turning"),
)
