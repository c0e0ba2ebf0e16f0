"""Grinding physics: pure functions, each law once."""

from sdpgrind.physics._burn import malkin_burn_coefficients, malkin_burn_energy
from sdpgrind.physics._disc import disc_power, disc_speed, disc_torque, peak_torque, removal_rate, torque_of_power
from sdpgrind.physics._power import (
    BurningLimit,
    BurnOnset,
    DongSliding,
    GrindingPower,
    MalkinSliding,
    SlidingLaw,
    burn_onset,
)

__all__ = [
    "BurnOnset",
    "BurningLimit",
    "DongSliding",
    "GrindingPower",
    "MalkinSliding",
    "SlidingLaw",
    "burn_onset",
    "disc_power",
    "disc_speed",
    "disc_torque",
    "malkin_burn_coefficients",
    "malkin_burn_energy",
    "peak_torque",
    "removal_rate",
    "torque_of_power",
]
