"""Grinding physics: pure functions, each law once."""

from sdpgrind.physics._burn import (
    BurningLimit,
    BurnOnset,
    burn_onset,
    depths_between,
    malkin_burn_coefficients,
    malkin_burn_energy,
)
from sdpgrind.physics._disk import disk_power, disk_speed, disk_torque, peak_torque, removal_rate, torque_of_power
from sdpgrind.physics._power import GrindingPower
from sdpgrind.physics._sliding import DongSliding, MalkinSliding, SlidingLaw

__all__ = [
    "BurnOnset",
    "BurningLimit",
    "DongSliding",
    "GrindingPower",
    "MalkinSliding",
    "SlidingLaw",
    "burn_onset",
    "depths_between",
    "disk_power",
    "disk_speed",
    "disk_torque",
    "malkin_burn_coefficients",
    "malkin_burn_energy",
    "peak_torque",
    "removal_rate",
    "torque_of_power",
]
