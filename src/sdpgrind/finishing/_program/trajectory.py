"""Programs as trajectories of ROS: places and speeds of the joints at times, in JSON."""

import json
from collections.abc import Sequence

from sdpgrind.base.checks import Floats
from sdpgrind.finishing._program.form import MM_PER_M, told

NANOSECONDS = 10**9  # derived
_DECIMALS = 10  # derived: 1e-10 rad at 1.4 m reach, and 1e-10 m, are 0.1 nm
_SI = {"rad": ("rad", 1.0), "mm": ("m", 1 / MM_PER_M)}
_HEADER = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}  # a stamp of 0: begin at once


def trajectory(
    head: list[str], rows: Floats, speeds: Floats, names: Sequence[str], units: Sequence[str]
) -> str:
    """Write times and joints (m, n + 1) with their speeds (m, n) as a ``trajectory_msgs/JointTrajectory``.

    Numbers have no exponent: readers of YAML would take 1e-10 for a text.

    No accelerations: by places and speeds a ``joint_trajectory_controller`` follows the cubics of which the
    motion is made; by accelerations, too, it would follow other curves.
    """
    si, factors = zip(*(_SI[unit] for unit in units), strict=True)
    points = (
        f'{{"positions": [{told(place, _DECIMALS)}], "velocities": [{told(pace, _DECIMALS)}],'
        f' "time_from_start": {json.dumps(_time(time))}}}'
        for time, place, pace in zip(
            rows[:, 0].tolist(), rows[:, 1:] * factors, speeds * factors, strict=True
        )
    )
    about = f'"about": {json.dumps(head, indent=1)},\n"units": {json.dumps(si)}'
    message = f'"header": {json.dumps(_HEADER)}, "joint_names": {json.dumps(list(names))}'
    lines = ",\n  ".join(points)
    return f'{{{about},\n"trajectory": {{{message}, "points": [\n  {lines}\n]}}}}\n'


def _time(seconds: float) -> dict[str, int]:
    whole, rest = divmod(round(seconds * NANOSECONDS), NANOSECONDS)
    return {"sec": whole, "nanosec": rest}
