"""What nobody tells the planner of a finishing cell: what axis, tool, surface, table and roughness really are."""

from dataclasses import KW_ONLY, dataclass, field

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.frozen import Frozen
from sdpgrind.finishing._plant.height import HeightField
from sdpgrind.finishing._problem.problem import FinishingProblem
from sdpgrind.finishing.timing._table_loop import TableLoop
from sdpgrind.finishing.torque._axis import TorqueAxis

_RELATIVE = ("inertia", "contact_angular_stiffness", "torque_constant", "friction_ratio")


@dataclass(frozen=True)
class CellTruth(Frozen):
    """What a finishing cell really is in one part; those who plan and control do not see it.

    Parameters
    ----------
    axis : TorqueAxis
        Inertia (kg m^2), stiffness of the contact (N m/rad) and torque constant (N m/A) count; lever arm, encoder, converter and
        sample time are the cell's own.
    friction_ratio : float
        Tangential over normal force.
    load_torque : float
        Constant torque against the motor, N m.
    tool_mass, mass_radius : float
        What is out of balance, kg, and how far from the motor's axis towards the tip, mm: its weight presses, or lifts, as the
        pose has it. It adds nothing to the inertia.
    height : HeightField
        How much higher than planned the surface is, mm.
    table : TableLoop, optional
        Of both axes of the table; None: the table is always where it shall be.
    roughness_error : float, optional
        Logarithm of the roughness over the median of the model, unit 1. None: drawn from the law of the model.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> from sdpgrind import finishing
    >>> truth = CellTruth.nominal(finishing.preset("nominal"), finishing.TorqueAxis())
    >>> truth.replace(load_torque=0.01).friction_ratio  # N m, 1
    0.3
    """

    axis: TorqueAxis
    friction_ratio: float
    _: KW_ONLY
    load_torque: float = 0.0
    tool_mass: float = 0.0
    mass_radius: float = 50.0
    height: HeightField = field(default_factory=HeightField.flat)
    table: TableLoop | None = field(default_factory=TableLoop)
    roughness_error: float | None = None

    def __post_init__(self) -> None:
        checks.kind("axis", self.axis, TorqueAxis)
        checks.kind("height", self.height, HeightField, " (see hwsim.HeightField)")
        checks.nonnegative("friction_ratio", self.friction_ratio)
        checks.number("load_torque", self.load_torque, "N m")
        checks.nonnegative("tool_mass", self.tool_mass, "kg")
        checks.nonnegative("mass_radius", self.mass_radius, "mm")
        if self.table is not None:
            checks.kind("table", self.table, TableLoop, " or None")
        if self.roughness_error is not None:
            checks.number("roughness_error", self.roughness_error)

    @classmethod
    def nominal(cls, problem: FinishingProblem, axis: TorqueAxis) -> "CellTruth":
        """Return the truth that is as believed: the surface as planned (height error 0 mm), no load torque.

        Parameters
        ----------
        problem : FinishingProblem
            Gives the friction.
        axis : TorqueAxis
            The torque axis, in kg m^2, N m/rad, N m/A.
        """
        return cls(axis, float(problem.friction_ratio))


@dataclass(frozen=True)
class CellScatter(Frozen):
    """How cells differ from part to part.

    Parameters
    ----------
    inertia, contact_angular_stiffness, torque_constant, friction_ratio : float
        Standard deviation of the logarithm of each; the median is that of the truth.
    load_torque : float
        Standard deviation, N m; about 0.02 N at the contact with the default.
    tool_mass : float
        Mean of what is out of balance, exponential, kg; at the radius of the truth.
    height_sd, shortest_wavelength : float
        Standard deviation of the height error of the surface, and shortest wavelength in it, mm.

    Raises
    ------
    ValueError
        When a value is negative.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import finishing
    >>> cell = hwsim.FinishingCell(finishing.preset("nominal"), scatter=hwsim.CellScatter(height_sd=0.02))  # mm
    >>> cell.scatter.torque_constant
    0.02
    """

    inertia: float = 0.05
    contact_angular_stiffness: float = 0.2
    torque_constant: float = 0.02
    friction_ratio: float = 0.1
    load_torque: float = 0.002
    tool_mass: float = 0.005
    height_sd: float = 0.01
    shortest_wavelength: float = 5.0

    def __post_init__(self) -> None:
        for name in _RELATIVE:
            checks.within(name, getattr(self, name), 0.0, 1.0)
        for name, unit in {"load_torque": "N m", "tool_mass": "kg", "height_sd": "mm"}.items():
            checks.nonnegative(name, getattr(self, name), unit)
        checks.positive("shortest_wavelength", self.shortest_wavelength, "mm")

    def drawn(self, truth: CellTruth, rng: np.random.Generator) -> CellTruth:
        """Return the truth of one part, in the units of `CellTruth`.

        Parameters
        ----------
        truth : CellTruth
            Medians; the height error that is drawn takes the place of that in it, unless `height_sd` is 0.
        rng : numpy.random.Generator
            Equally many numbers are drawn whatever the standard deviations are.
        """
        factor = dict(zip(_RELATIVE, np.exp([getattr(self, n) for n in _RELATIVE] * rng.standard_normal(4)), strict=True))
        load, mass = self.load_torque * float(rng.standard_normal()), self.tool_mass * float(rng.standard_exponential())
        height = HeightField.drawn(self.height_sd, self.shortest_wavelength, rng)
        axis = truth.axis.replace(**{name: getattr(truth.axis, name) * float(factor[name]) for name in _RELATIVE[:3]})
        return truth.replace(
            axis=axis,
            friction_ratio=truth.friction_ratio * float(factor["friction_ratio"]),
            load_torque=truth.load_torque + load,
            tool_mass=truth.tool_mass + mass,
            height=height if self.height_sd > 0 else truth.height,
        )
