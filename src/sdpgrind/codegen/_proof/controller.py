"""An export as a controller: `step` runs the C."""

import tempfile
from collections.abc import Mapping
from copy import copy
from pathlib import Path
from typing import Any, Self

import numpy as np

from sdpgrind.codegen._proof.compilers import needed
from sdpgrind.codegen._proof.library import Library, sizes_of
from sdpgrind.codegen._recipe import Recipe, shown, units_of


class CompiledController:
    """C of an export, compiled on this computer, with the face of a controller.

    A copy has a state of its own.

    Parameters
    ----------
    recipe : Recipe
        What was exported.
    folder : Path
        Folder of the export.
    name : str
        Prefix of its functions.
    compiler : str
        Command of the C compiler.

    Attributes
    ----------
    period : float or None
        Time between two steps, s.
    status : int
        Status of the last step.
    """

    def __init__(self, recipe: Recipe, folder: Path, name: str, compiler: str) -> None:
        self._recipe, self._name, self._compiler = recipe, name, compiler
        sizes = sizes_of(recipe)
        with tempfile.TemporaryDirectory() as kept:  # the library stays loaded without its file
            self._library = Library(folder, Path(kept), name, sizes, needed(compiler), "-O2")
        self.period, self.status = recipe.period, 0
        self._inputs, self._outputs = np.zeros(len(recipe.inputs)), np.zeros(len(recipe.outputs))
        self.state = np.zeros(recipe.state.size)
        self._taken: tuple[dict[str, float], dict[str, float]] = {}, {}
        self.reset()

    def __repr__(self) -> str:
        inputs, outputs = (", ".join(names) for names in (self._recipe.inputs, self._recipe.outputs))
        return f"CompiledController({self._name!r} by {self._compiler}: {inputs} -> {outputs})"

    def __deepcopy__(self, memo: object) -> Self:
        twin = copy(self)
        twin.state, twin._inputs, twin._outputs = self.state.copy(), self._inputs.copy(), self._outputs.copy()
        return twin

    @property
    def reads(self) -> Mapping[str, str]:
        """Name of each measurement that a plant must have to its unit."""
        given = self._recipe.role.reads
        return units_of(self._recipe.inputs) if given is None else given

    @property
    def commands(self) -> Mapping[str, str]:
        """Name of each command to its unit."""
        given = self._recipe.role.commands
        return units_of(self._recipe.outputs) if given is None else given

    @property
    def reports(self) -> Mapping[str, str]:
        """Name of each report to its unit."""
        return self._recipe.role.reports

    @property
    def job(self) -> Mapping[str, object]:
        """Part and machine (mm, s, N) of the thing that was exported."""
        return self._recipe.role.job

    @property
    def description(self) -> Mapping[str, float | str]:
        """What the thing that was exported tells the log, in its units (mm, s, N)."""
        return self._recipe.role.description

    @property
    def stands_for(self) -> str:
        """Class of the controller that steps so, for the log; text, no unit."""
        return self._recipe.role.stands_for or self._recipe.kind

    @property
    def tier(self) -> str:
        """Name of its table in the log; text, no unit."""
        return self._recipe.role.tier

    def reset(self) -> None:
        """Start the next part."""
        self.status = 0
        self._library.reset(self.state)

    def step(self, **measurement: Any) -> dict[str, Any]:
        """Return the outputs by name, in their units (mm, s, N ...).

        Parameters
        ----------
        **measurement
            Inputs by name; one that is not given is its default, or NaN. Others are not used.

        Raises
        ------
        ValueError
            When the C returns a status below 0.
        """
        for k, (name, one) in enumerate(self._recipe.inputs.items()):
            self._inputs[k] = float(measurement.get(name, one.default))
        self.status = self._library.step(self.state, self._inputs, self._outputs)
        if self.status < 0:
            raise ValueError(self._refusal())
        found = dict(zip(self._recipe.outputs, self._outputs.tolist(), strict=True))
        self._taken = dict(zip(self._recipe.inputs, self._inputs.tolist(), strict=True)), dict(found)
        told = self._recipe.role.answer
        return found if told is None else told(self.status, found)

    def report(self) -> dict[str, float]:
        """Return what the plan expects of the last step (mm, $ ...): from the library, not from the C."""
        told = self._recipe.role.report
        return {} if told is None or self.status < 0 else told(self.status, *self._taken)

    def _refusal(self) -> str:
        """Say what was handed over, and the range of each input."""
        told = []
        for (name, one), value in zip(self._recipe.inputs.items(), self._inputs, strict=True):
            missing = " or NaN" if one.missing else ""
            taken = f"{shown(one.low)} to {shown(one.high)} {one.unit or '1'}{missing}"
            told.append(f"{name}={value:g} ({taken})")
        rule = "inputs must be as their meanings in the header say, and within their range"
        return f"{rule} (status {self.status}); got {', '.join(told)}"
