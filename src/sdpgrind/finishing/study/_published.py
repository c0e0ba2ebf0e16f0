"""Published experiments, as printed."""

from typing import Any

# source: Wang, Y. T. and Jan, Y. J. (2001), path planning for robot-assisted grinding processes, Table 2;
# factors in the order of the columns, levels in that of the standard L18
WANG_2001: dict[str, Any] = {
    "array": "L18",
    "factors": {
        "tool_diameter": (4.0, 3.0),  # mm
        "pattern": ("hilbert5", "hilbert4", "zigzag"),
        "feed_rate": (12.5, 25.0, 37.5),  # mm/s
        "normal_force": (0.556, 1.111, 1.667),  # N
    },
    "units": {"tool_diameter": "mm", "feed_rate": "mm/s", "normal_force": "N"},
    "roughness_um": (  # R_a of each run, µm
        5.00, 3.50, 3.75, 8.25, 6.00, 6.00, 4.25, 5.25, 6.75,
        4.50, 6.25, 5.00, 7.50, 6.75, 10.50, 6.75, 9.25, 6.50,
    ),
    "reference_um": 10.0,
}  # fmt: skip

PUBLISHED = {"wang-2001": WANG_2001}
