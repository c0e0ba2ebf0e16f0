"""Planning of repeated finishing passes from the scatter of the roughness model."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import sparse

from sdpgrind import sdp
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.finishing.roughness._model import RoughnessModel
from sdpgrind.finishing.roughness._terms import SETTINGS

NODES = 1601  # chosen: accuracy of the value, see `refinish_problem`; memory rises with the square


@dataclasses.dataclass(frozen=True)
class Fresh:
    """Transition to a draw from a law, whatever the state; exact for a value-to-go linear between nodes."""

    law: sdp.Law

    def weights(self, x: Floats) -> Floats:
        """Expected hat functions of the nodes, second differences of E max(x - R, 0); 1 beyond the ends."""
        share = np.diff(self.law.under(x)) / np.diff(x)  # mean of P(R <= x) over each cell
        return np.diff(share, prepend=0.0, append=1.0)

    def rows(
        self, menu: Any, points: tuple[Floats, ...], mode: Any, stage: Any, choice: Any, level: Floats
    ) -> sdp.Rows:
        """The weights for each point, at the nodes within the support of the law."""
        axis, count = menu.grid.axes[0], points[0].size
        x = np.linspace(axis.low, axis.high, axis.nodes)
        first, last = np.searchsorted(x, self.law.support)
        cells = np.arange(max(first - 1, 0), min(last + 1, x.size))
        weights = self.weights(x)[cells]
        charge = menu.penalty(menu.state(points, mode, stage), menu.controls(choice, level))
        return sdp.Rows(
            sparse.csr_array(
                (np.tile(weights, count), np.tile(cells, count), np.arange(count + 1) * cells.size),
                shape=(count, x.size),
            ),
            np.zeros(count, dtype=int) if mode is None else mode,
            np.broadcast_to(charge, (count,)).astype(float),
            np.zeros(count),
        )

    def sample(
        self,
        menu: Any,
        points: tuple[Floats, ...],
        mode: Any,
        stage: Any,
        choice: Any,
        level: Floats,
        rng: np.random.Generator,
    ) -> tuple[tuple[Floats, ...], npt.ArrayLike]:
        """Draw the roughness after a pass."""
        axis = menu.grid.axes[0]
        return (np.clip(self.law.sample(rng, points[0].shape), axis.low, axis.high),), 0.0


def refinish_problem(
    model: RoughnessModel,
    settings: Mapping[str, Mapping[str, Any]],
    *,
    pass_charge: float | Mapping[str, float],
    roughness_charge: sdp.OneSided,
    passes: int,
    roughness_max: float | None = None,
    extrapolate: bool = False,
) -> sdp.Problem:
    """Make the problem of repeating a finishing pass until the part is smooth enough to deliver.

    The roughness is read after each pass. Delivery is charged by the roughness; another pass has its own
    charge and leaves a roughness drawn from the model, independent of the last one. The optimal policy
    delivers below a threshold that rises as passes run out. With a node where the charge begins, the value is
    accurate to a thousandth; to some thousandths where it is a few cents, with many cheap passes. A tolerance
    of `sdp.plan` is soon met (1e-4 $ of 9 $ in a second), but each halving of the cell size takes four times
    the memory.

    Parameters
    ----------
    model : RoughnessModel
        Model of the roughness after a pass.
    settings : mapping of str to mapping
        Passes by name: pattern, tool_diameter (mm) and normal_force (N) as in `RoughnessModel.law`.
    pass_charge : float or mapping of str to float
        Charge of each pass, $; one for all, or one for each name.
    roughness_charge : sdp.OneSided
        Charge ($) as a function of the delivered roughness (mm): sdp.Linear(rate, tolerance=...).
    passes : int
        Greatest number of passes.
    roughness_max : float, optional
        Upper end of the table, mm, or a cell more. Default: twice the upper end of the roughest pass's law.
    extrapolate : bool
        As in `RoughnessModel.law`.

    Returns
    -------
    sdp.Problem
        With the coordinate ``roughness`` (mm) and the stages ``passes_left``, for `sdp.plan`.

    Raises
    ------
    ValueError
        Settings are empty or incomplete, or a charge is missing or negative.

    Examples
    --------
    >>> from sdpgrind import finishing as fin, sdp, units
    >>> model = fin.roughness.RoughnessModel.published()
    >>> settings = {"fine": {"pattern": "hilbert5", "tool_diameter": 4.0, "normal_force": model.best_force()}}
    >>> charge = sdp.Linear(10.0 / units.um(1.0), tolerance=units.um(3.0))  # 10 $ a micrometre above 3
    >>> given = {"pass_charge": 1.0, "roughness_charge": charge, "passes": 3}
    >>> policy = sdp.plan(fin.roughness.refinish_problem(model, settings, **given))
    >>> [policy.action(roughness=units.um(r), passes_left=1).name for r in (3.5, 3.8)]
    ['deliver', 'fine']
    """
    checks.kind("model", model, RoughnessModel)
    if not isinstance(roughness_charge, sdp.OneSided):
        raise TypeError(
            "roughness_charge must be such as sdp.Linear(rate, tolerance=...); got"
            f" {checks.shown(roughness_charge)}"
        )
    if not isinstance(settings, Mapping) or not settings:
        raise ValueError(
            f"settings must be passes by name, {{'fine': {{'pattern': ..., ...}}}};"
            f" got {checks.shown(settings)}"
        )
    laws = {name: _law(model, name, how, extrapolate) for name, how in settings.items()}
    coarsest = 2 * max(float(law.support[1]) for law in laws.values())
    high = coarsest if roughness_max is None else checks.positive("roughness_max", roughness_max, "mm")
    high, nodes = _cut(high, roughness_charge.tolerance)
    moves = [sdp.Move(name, {}, Fresh(law), charge=_charge(pass_charge, name)) for name, law in laws.items()]
    return sdp.Problem(
        [sdp.Axis("roughness", 0.0, high, nodes, "mm", below="hold", above="hold")],
        moves,
        [sdp.Stop("deliver", sdp.Charge(under=roughness_charge))],
        sdp.Stages(checks.count("passes", passes), 1.0, "passes_left", ""),
    )


def _cut(high: float, kink: float) -> tuple[float, int]:
    """End and nodes of an axis up to `high` or slightly more, with a node at the kink of the charge."""
    step = high / (NODES - 1)
    if step <= kink < high:
        step = kink / np.ceil(kink / step)
    cells = int(np.ceil(high / step * (1 - 1e-12)))
    return float(cells * step), cells + 1


def _law(model: RoughnessModel, name: str, how: Mapping[str, Any], extrapolate: bool) -> sdp.LogNormal:
    if not isinstance(how, Mapping) or set(how) != set(SETTINGS):
        raise ValueError(
            f"settings[{name!r}] must be a mapping with {', '.join(SETTINGS)}; got {checks.shown(how)}"
        )
    law = model.law(**how, extrapolate=extrapolate)
    if law.shape != ():
        raise ValueError(f"settings[{name!r}] must be of one pass; got arrays of shape {law.shape}")
    return law


def _charge(pass_charge: float | Mapping[str, float], name: str) -> float:
    if not isinstance(pass_charge, Mapping):
        return checks.nonnegative("pass_charge", pass_charge, "$")
    if name not in pass_charge:
        raise ValueError(f"pass_charge must have an entry for each of the settings; {name!r} has none")
    return checks.nonnegative(f"pass_charge[{name!r}]", pass_charge[name], "$")
