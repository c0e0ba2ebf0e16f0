"""Centering of rings on a turning table, and measuring them there (Mears 2006).

Where to begin:

* circle: `GeometryEstimator` (reading by reading, until it is certain) or `identify` (a batch);
* push: `preset` gives a `CenteringProblem` (part, friction, limits, scatter), `plan_push` aims a push,
  ``push.simulate()`` predicts it, `simulate_push` follows any `TipProfile`;
* friction from pushes: `FrictionEstimator`, then ``problem.updated(estimate)``;
* cycle: `plan` gives the `Strategy` of least time, `CenteringController` follows it on
  `hwsim.CenteringMachine` or a real machine; `PrintedController` is the source's, for comparison;
* form: `Profile` for roundness, `plan_changeover` for the grinder, `DriftTrack` and `ControlChart` for parts
  over weeks.

Lengths are in mm, readings outward, angles in rad, forces in N. `hwsim.Probe` simulates the measuring head.
The first call of a kind compiles it, once on a machine; `sdpgrind.warm("centering")` does so beforehand.

Examples
--------
>>> import centering
>>> import hwsim
>>> ring = hwsim.Ring(radius=62.0, offset=2.0, offset_angle=0.5)  # mm, rad
>>> scan = hwsim.Probe(ring, samples_per_turn=360).scan(turns=1.0, rng=0)
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
