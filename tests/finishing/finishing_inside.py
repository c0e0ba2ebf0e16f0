"""What the tests of finishing reach inside the area."""

from sdpgrind.finishing._plant.course import course_of
from sdpgrind.finishing._plant.kernels import WEIGHT
from sdpgrind.finishing._problem import joint_runs
from sdpgrind.finishing._program.course import lifted
from sdpgrind.finishing._program.read_program import read_text
from sdpgrind.finishing.arm import _kinematics_kernels as kinematics_kernels
from sdpgrind.finishing.arm import _spin_choice as spin_choice
from sdpgrind.finishing.arm import _spin_kernels as spin_kernels
from sdpgrind.finishing.arm import _spin_states as spin_states
from sdpgrind.finishing.arm import _spin_sweep as spin_sweep
from sdpgrind.finishing.arm._heading import check_corners, pitch_cosine
from sdpgrind.finishing.arm._spin_course import CourseTask
from sdpgrind.finishing.path import _hilbert as hilbert
from sdpgrind.finishing.path import _spacing as spacing
from sdpgrind.finishing.path._arc_kernels import inverted, travelled
from sdpgrind.finishing.path._cells import cell_areas
from sdpgrind.finishing.path._coverage import edges_of
from sdpgrind.finishing.path._departure_kernels import furthest
from sdpgrind.finishing.path._eikonal_kernels import sweep
from sdpgrind.finishing.path._equal_area import equal_area
from sdpgrind.finishing.path._geodesic import distance_field, solved
from sdpgrind.finishing.path._mappings import mapping_of
from sdpgrind.finishing.path._metrics import metrics
from sdpgrind.finishing.path._nearest import Nearest
from sdpgrind.finishing.path._spacing_kernels import _value, march
from sdpgrind.finishing.path._square import Square
from sdpgrind.finishing.roughness._fit import identify_roughness, left_out
from sdpgrind.finishing.study import _general as general
from sdpgrind.finishing.study._array_tables import TABLES
from sdpgrind.finishing.study._confounding import assigned, confounding
from sdpgrind.finishing.study._observations import analysed
from sdpgrind.finishing.study._reading import law_of_a_reading
from sdpgrind.finishing.surface import _triangles as scan_triangles
from sdpgrind.finishing.surface._area import gauss
from sdpgrind.finishing.surface._bspline_kernels import _find_span
from sdpgrind.finishing.surface._control_net import clamped as knots_of
from sdpgrind.finishing.surface._creases import creases
from sdpgrind.finishing.surface._evaluation import bases
from sdpgrind.finishing.surface._folds import refuse_folded_surface
from sdpgrind.finishing.surface._least_squares import control_points as fit_control_points
from sdpgrind.finishing.surface._presets import QUARTER, QUARTER_WEIGHTS
from sdpgrind.finishing.surface._scan import ENDINGS as SCANS
from sdpgrind.finishing.surface._scan import read_scan
from sdpgrind.finishing.timing import _interior as interior
from sdpgrind.finishing.timing import _jerk_limited as jerk_limited
from sdpgrind.finishing.timing import _jerk_program as jerk_program
from sdpgrind.finishing.timing import _min_time as min_time
from sdpgrind.finishing.timing import _toppra_law as toppra_law
from sdpgrind.finishing.timing._limits import LimitedRun
from sdpgrind.finishing.timing._min_time import fastest_law
from sdpgrind.finishing.timing._narrowing import narrowed
from sdpgrind.finishing.timing._squared_feed import FROM_REST, coefficients, greville, squared_feed
from sdpgrind.finishing.timing._three_pieces import law_of
from sdpgrind.finishing.timing._trapezoid import double_s_law, trapezoid_law
from sdpgrind.finishing.timing._violations import closest
from sdpgrind.finishing.torque._load_torque import identify_load_torque

__all__ = [
    "FROM_REST",
    "QUARTER",
    "QUARTER_WEIGHTS",
    "SCANS",
    "TABLES",
    "WEIGHT",
    "CourseTask",
    "LimitedRun",
    "Nearest",
    "Square",
    "_find_span",
    "_value",
    "analysed",
    "assigned",
    "bases",
    "cell_areas",
    "check_corners",
    "closest",
    "coefficients",
    "confounding",
    "course_of",
    "creases",
    "distance_field",
    "double_s_law",
    "edges_of",
    "equal_area",
    "fastest_law",
    "fit_control_points",
    "furthest",
    "gauss",
    "general",
    "greville",
    "hilbert",
    "identify_load_torque",
    "identify_roughness",
    "interior",
    "inverted",
    "jerk_limited",
    "jerk_program",
    "joint_runs",
    "kinematics_kernels",
    "knots_of",
    "law_of",
    "law_of_a_reading",
    "left_out",
    "lifted",
    "mapping_of",
    "march",
    "metrics",
    "min_time",
    "narrowed",
    "pitch_cosine",
    "read_scan",
    "read_text",
    "refuse_folded_surface",
    "scan_triangles",
    "solved",
    "spacing",
    "spin_choice",
    "spin_kernels",
    "spin_states",
    "spin_sweep",
    "squared_feed",
    "sweep",
    "toppra_law",
    "trapezoid_law",
    "travelled",
]
