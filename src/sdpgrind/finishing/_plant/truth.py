"""Truth of a finishing cell in one part: axis, tool, surface, table and roughness."""

from dataclasses import KW_ONLY

import numpy as np

from sdpgrind.base.quantities import Described, described, part, quantity
from sdpgrind.finishing._plant.height import HeightField
from sdpgrind.finishing._problem.problem import FinishingProblem
from sdpgrind.finishing.timing._table_loop import TableLoop
from sdpgrind.finishing.torque._axis import TorqueAxis

_RELATIVE = ("inertia", "contact_angular_stiffness", "torque_constant", "friction_ratio")


@described()
class CellTruth(Described):
    """Truth of a finishing cell in one part, hidden from planner and controller.

    Parameters
    ----------
    axis : TorqueAxis
        True inertia (kg m^2), contact stiffness (N m/rad) and torque constant (N m/A); lever arm, encoder,
        converter and sample time are the cell's own.
    friction_ratio : float
        Tangential over normal force, unit 1.
    load_torque : float
        Constant torque against the motor, N m.
    tool_mass, mass_radius : float
        Unbalanced mass, kg, and its distance from the motor's axis towards the tip, mm; its weight acts
        according to the pose. It adds no inertia.
    height : HeightField
        Height of the true surface over the planned one, mm.
    table : TableLoop, optional
        Loop of both axes of the table. None: without error.
    roughness_error : float, optional
        Logarithm of the roughness over the model's median, unit 1. None: drawn from the model.

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

    axis: TorqueAxis = part(TorqueAxis)
    friction_ratio: float = quantity("1", at_least=0)
    _: KW_ONLY
    load_torque: float = quantity("N m", default=0.0)
    tool_mass: float = quantity("kg", at_least=0, default=0.0)
    mass_radius: float = quantity("mm", at_least=0, usual=(0.0, 5000.0), typical=50, default=50.0)
    height: HeightField = part(HeightField, " (see hwsim.HeightField)", default_factory=HeightField.flat)
    table: TableLoop | None = part(TableLoop, " or None", default_factory=TableLoop)
    roughness_error: float | None = quantity("1", default=None)

    @classmethod
    def nominal(cls, problem: FinishingProblem, axis: TorqueAxis) -> "CellTruth":
        """Return the truth as believed: the surface as planned (height error 0 mm), no load torque.

        Parameters
        ----------
        problem : FinishingProblem
            Problem with the friction.
        axis : TorqueAxis
            The torque axis, in kg m^2, N m/rad, N m/A.
        """
        return cls(axis, problem.friction_ratio)


@described()
class CellScatter(Described):
    """Scatter of cells from part to part.

    Parameters
    ----------
    inertia, contact_angular_stiffness, torque_constant, friction_ratio : float
        Standard deviation of the logarithm, unit 1; the median is that of the truth.
    load_torque : float
        Standard deviation, N m; the default is about 0.02 N at the contact.
    tool_mass : float
        Mean of the exponentially distributed unbalanced mass, kg; at the radius of the truth.
    height_sd, shortest_wavelength : float
        Standard deviation and shortest wavelength of the height error, mm.

    Raises
    ------
    ValueError
        When a value is negative.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import finishing
    >>> scatter = hwsim.CellScatter(height_sd=0.02)  # mm
    >>> cell = hwsim.FinishingCell(finishing.preset("nominal"), scatter=scatter)
    >>> cell.scatter.torque_constant
    0.02
    """

    inertia: float = quantity("1", at_least=0, at_most=1, default=0.05)
    contact_angular_stiffness: float = quantity("1", at_least=0, at_most=1, default=0.2)
    torque_constant: float = quantity("1", at_least=0, at_most=1, default=0.02)
    friction_ratio: float = quantity("1", at_least=0, at_most=1, default=0.1)
    load_torque: float = quantity("N m", at_least=0, default=0.002)
    tool_mass: float = quantity("kg", at_least=0, default=0.005)
    height_sd: float = quantity("mm", at_least=0, default=0.01)
    shortest_wavelength: float = quantity("mm", above=0, usual=(0.02, 1e4), typical=5, default=5.0)

    def drawn(self, truth: CellTruth, rng: np.random.Generator) -> CellTruth:
        """Return the truth of one part, in the units of `CellTruth`.

        Parameters
        ----------
        truth : CellTruth
            Medians; the drawn height error replaces its own, unless `height_sd` is 0.
        rng : numpy.random.Generator
            Random source; the number of draws does not depend on the standard deviations.
        """
        factor = dict(
            zip(
                _RELATIVE, np.exp([getattr(self, n) for n in _RELATIVE] * rng.standard_normal(4)), strict=True
            )
        )
        load, mass = (
            self.load_torque * float(rng.standard_normal()),
            self.tool_mass * float(rng.standard_exponential()),
        )
        height = HeightField.drawn(self.height_sd, self.shortest_wavelength, rng)
        axis = truth.axis.replace(
            **{name: getattr(truth.axis, name) * float(factor[name]) for name in _RELATIVE[:3]}
        )
        return truth.replace(
            axis=axis,
            friction_ratio=truth.friction_ratio * float(factor["friction_ratio"]),
            load_torque=truth.load_torque + load,
            tool_mass=truth.tool_mass + mass,
            height=height if self.height_sd > 0 else truth.height,
        )
