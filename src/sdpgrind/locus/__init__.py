"""The best point of a process whose limit drifts with a state that nobody can measure (Koren 1989)."""

from sdpgrind.locus._area import Area
from sdpgrind.locus._dressed_grinding import DressedGrinding
from sdpgrind.locus._grinding import Grinding
from sdpgrind.locus._koren_example import KorenExample
from sdpgrind.locus._locus import Event, Locus
from sdpgrind.locus._motor import MotorAxis
from sdpgrind.locus._pieces import Columns, Piece
from sdpgrind.locus._plan import plan
from sdpgrind.locus._point import Point
from sdpgrind.locus._presets import preset, presets
from sdpgrind.locus._problem import Problem, Process, Varying
from sdpgrind.locus._roughness import Roughness
from sdpgrind.locus._turning import Turning

__all__ = [
    "Area",
    "Columns",
    "DressedGrinding",
    "Event",
    "Grinding",
    "KorenExample",
    "Locus",
    "MotorAxis",
    "Piece",
    "Point",
    "Problem",
    "Process",
    "Roughness",
    "Turning",
    "Varying",
    "plan",
    "preset",
    "presets",
]
