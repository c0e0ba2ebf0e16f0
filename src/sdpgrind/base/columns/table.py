"""Table of what is measured and commanded: unit, and the range that a machine can mean."""

import difflib
import re
from math import inf
from typing import NamedTuple

COMMAND, PLANNED = "_command", "_planned"
COMMANDED = "command_rate"
"""Quantity that is a command by its meaning."""
TEXT = "text"
"""Unit of columns of words."""

TRAVELS = frozenset(["size"])
"""Quantities that count from anywhere: what they move is held against the upper end of their range."""


class Meant(NamedTuple):
    """Unit ("": a pure number), least and greatest magnitude of a quantity."""

    unit: str
    least: float = 0.0
    greatest: float = inf


# chosen: wide on purpose, from the smallest to the greatest machine; where a field of the same name is
# declared with a usual range, that range (a test compares them)
_RANGES = {
    "size": Meant("mm", 0.005, 20.0),
    "command_rate": Meant("mm/s", 1e-5, 5.0),
    "infeed_rate": Meant("mm/s", 1e-5, 20.0),
    "grinding_power": Meant("W", 5.0, 2e5),
    "cut_depth": Meant("mm", 1e-4, 3.0),
    "roughness_ra": Meant("mm", 5e-6, 0.05),
    "deviation": Meant("mm", 1e-6, 2.0),
    "reading": Meant("mm", 1.0, 3000.0),
    "current": Meant("A", 1e-3, 100.0),
    "friction_ratio": Meant("", 0.05, 2.0),
    "normal_force": Meant("N", 0.2, 5000.0),
    "peak_force": Meant("N", 0.2, 5000.0),
    "tangential_force": Meant("N", 0.05, 5000.0),
    "feed_rate": Meant("mm/s", 0.1, 1000.0),
    "removal_rate": Meant("mm^3/s", 0.01, 1e4),
    "tool_diameter": Meant("mm", 0.05, 1000.0),
    "work_rotation": Meant("rad/s", 0.05, 300.0),
    "disk_speed": Meant("rad/s", 5.0, 4000.0),
    "free_speed": Meant("rad/s", 10.0, 5000.0),
    "disk_radius": Meant("mm", 5.0, 1000.0),
    "wheel_diameter": Meant("mm", 1.0, 3000.0),
    "work_diameter": Meant("mm", 1.0, 1e4),
    "wheel_speed": Meant("mm/s", 1e3, 3e5),
    "specific_energy": Meant("J/mm^3", 0.5, 500.0),
    "bead_length": Meant("mm", 1.0, 1e4),
    "bead_width": Meant("mm", 0.5, 500.0),
    "width": Meant("mm", 0.05, 1000.0),
    "mean_cut": Meant("mm", 0.0, 60.0),
}
_UNITS = {
    "mm": "sd_cut depth_of_cut equivalent_diameter height remaining burn_depth safety_margin slack"
    " noise_buffer offset center_x center_y slide probe table_position profile profile_x platform removed"
    " feed flank_wear dressing_lead start_x",
    "mm/s": "work_speed velocity cutting_speed",
    "mm^2/s": "specific_removal_rate",
    "s": "time_left duration reset_time time_constant pass_time path_time",
    "N": "force friction_force",
    "W": "idle_power burning_power",
    "rad": "angle offset_angle motor_angle profile_angle",
    "rad/s": "spindle_speed speed",
    "rad/s^2": "acceleration",
    "rad/(s N mm)": "speed_droop",
    "kg mm^2": "inertia",
    "$": "value height_charge lateness_charge finish_charge",
    "": "wear_flat_area step mu_static mu_kinetic power_saturated pushing refreshed phase balancing retract"
    " finished feed_override start stop dullness dressing_state",
    TEXT: "pattern section",
}
_FIRST = (  # chosen: one or two of each kind of file
    "size command_rate infeed_rate grinding_power normal_force tangential_force feed_rate cut_depth"
    " removal_rate roughness_ra reading deviation"
)
DIFFERENCES = {"cut_depth": "cut_depth is the height before a pass less the height after it"}
"""What makes a quantity of others that files have in its place."""
_HEIGHTS = re.compile(r"height.*(before|after|start|end)|(before|after).*height")
_CLOSE = 0.7  # chosen: likeness of a name that is suggested; "groesse" is less like "roughness_ra"
KNOWN = _RANGES | {name: Meant(unit) for unit, names in _UNITS.items() for name in names.split()}
"""Name -> unit and range of what files may hold."""


def bare(name: str) -> str:
    """Name without the ending of a command or of a controller's report."""
    return name.removesuffix(COMMAND).removesuffix(PLANNED)


def is_command(name: str) -> bool:
    """Whether a column is of commands: it holds from its time on."""
    return name.endswith(COMMAND) or name == COMMANDED


def _ending_in(name: str) -> list[str]:
    """Names that end in this word, as grinding_power in power."""
    return sorted(known for known in KNOWN if known.endswith(f"_{name}"))


def quantity_of(name: str) -> Meant:
    """Return unit and range of a name or ``<name>_command``; another is refused with the nearest ones."""
    found = KNOWN.get(name) or KNOWN.get(bare(name))
    if found is None:
        raise ValueError(
            f"{name} must be a quantity of the library or <quantity>_command; {_instead_of(bare(name))}"
        )
    return found


def _instead_of(name: str) -> str:
    """What may be meant by a name that is not known: the nearest, else the first ones to think of."""
    if _HEIGHTS.search(name):
        return DIFFERENCES["cut_depth"]
    if close := difflib.get_close_matches(name, KNOWN, 1, _CLOSE) or _ending_in(name):
        return f"is {' or '.join(close)} meant?"
    first = _FIRST.split()
    return f"known are {', '.join(first)} and {len(KNOWN) - len(first)} more (documentation: Units and names)"
