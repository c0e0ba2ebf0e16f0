"""Programs as trajectories of ROS: places and speeds of the joints at times, in JSON."""

import json
from collections.abc import Sequence

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing._program.form import MM_PER_M, told

NANOSECONDS = 10**9  # derived
# derived: 1e-12 rad at 1.4 m reach, and 1e-12 m, are 1e-9 mm; of a place, 4 ms apart from the next one, that
# changes the feed by 1e-6 mm/s
_DECIMALS = 12
_SI = {"rad": ("rad", 1.0), "mm": ("m", 1 / MM_PER_M)}
HEADER = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}  # a stamp of 0: begin at once


def trajectory(
    head: list[str], rows: Floats, speeds: Floats, names: Sequence[str], units: Sequence[str]
) -> str:
    """Write times and joints (m, n + 1) with their speeds (m, n) as a ``trajectory_msgs/JointTrajectory``.

    Numbers have no exponent: readers of YAML would take 1e-10 for a text.

    Places are those at the times as told, in whole nanoseconds: else feeds between points 4 ms apart would
    be off by 4e-7.

    No accelerations: by places and speeds a ``joint_trajectory_controller`` follows the cubics of which the
    motion is made; by accelerations, too, it would follow other curves.
    """
    si, factors = zip(*(_SI[unit] for unit in units), strict=True)
    times = np.round(rows[:, 0] * NANOSECONDS).astype(np.int64)
    places = rows[:, 1:] + (times / NANOSECONDS - rows[:, 0])[:, None] * speeds
    points = (
        f'{{"positions": [{told(place, _DECIMALS)}], "velocities": [{told(pace, _DECIMALS)}],'
        f' "time_from_start": {json.dumps(_time(time))}}}'
        for time, place, pace in zip(times.tolist(), places * factors, speeds * factors, strict=True)
    )
    about = f'"about": {json.dumps(head, indent=1)},\n"units": {json.dumps(si)}'
    message = f'"header": {json.dumps(HEADER)}, "joint_names": {json.dumps(list(names))}'
    lines = ",\n  ".join(points)
    return f'{{{about},\n"trajectory": {{{message}, "points": [\n  {lines}\n]}}}}\n'


def _time(nanoseconds: int) -> dict[str, int]:
    whole, rest = divmod(nanoseconds, NANOSECONDS)
    return {"sec": whole, "nanosec": rest}
