"""What tests of the centering machine and of its command use of the inside."""

from centering._plant import friction_kernels as friction
from centering._plant import kernels
from centering._plant import slide_kernels as slots
from centering._plant.settings import FOLLOWING, MASSES, lag_time, lag_times
from centering.cycle._strategy.as_sdp import Size
from centering.cycle._strategy.plan import prepared, solved
from centering.push.turning import _plane_kernels as plane
from hwsim._log.fingerprint import fingerprint
from hwsim._log.log import same
from hwsim._report.centering import reasons
from hwsim.command._centering.film import FilmStrip
from hwsim.command._centering.live import Chart, LiveView, watched
from hwsim.command._centering.toml import read
from hwsim.plants._centering.tasks import source_tasks

__all__ = [
    "FOLLOWING",
    "MASSES",
    "Chart",
    "FilmStrip",
    "LiveView",
    "Size",
    "fingerprint",
    "friction",
    "kernels",
    "lag_time",
    "lag_times",
    "plane",
    "prepared",
    "read",
    "reasons",
    "same",
    "slots",
    "solved",
    "source_tasks",
    "watched",
]
