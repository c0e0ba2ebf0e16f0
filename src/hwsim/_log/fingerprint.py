"""Fingerprints of objects: equal for equal plants and controllers in any process."""

import dataclasses
import functools
import hashlib
import types
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

_PLAIN = (type(None), bool, int, str, bytes, complex)
_OURS = {"sdpgrind", "centering", "hwsim"}
# area: modules of version 0.1.0 with those of their classes that fingerprints in a journal may contain
_FORMER = """
centering: _cycle.belief FrictionScaleBelief; _cycle.controller CenteringController; _cycle.cycle_base
CycleBase; _cycle.following FollowingGains FollowingLimits FollowingMap Follower; _cycle.outcomes
OutcomeTable PushKind; _cycle.printed_controller PrintedController; _cycle.settings CycleSettings;
_cycle.strategy Strategy; _cycle.strategy_moves KindOfPush; _cycle.strategy_timing CycleTiming;
_geometry.measuring MeasuringController; _push.model PushModel Part; _push.problem CenteringProblem
CenteringLimits PushScatter; _push.profile TipProfile; hwsim.plants._probe_errors ProbeErrors;
hwsim.plants._probe_ring Ring.
hwsim: _links QueueLink; _recording Recording; _scheduler Scheduler; _tasks Task; _watchdog Watchdog;
plants._adaptive AdaptiveGrinder; plants._centering CenteringMachine; plants._finishing FinishingCell;
plants._force_table ForceTableStand; plants._plunge PlungeGrinder GrinderNoise; plants._probe Probe;
plants._weldbead WeldBeadStand.
sdpgrind.finishing: hwsim.plants._finishing_height HeightField; hwsim.plants._finishing_truth CellScatter
CellTruth; _arm.arm Arm; _motion Motion; _path.path Path; _problem FinishingProblem; _roughness.model
RoughnessModel; _surface.surface Surface; _timing.limits JointLimits; _timing.table_loop TableLoop;
_torque.axis TorqueAxis; _torque.controller TorqueController; _torque.gains LqgGains PidffGains
DampingGains; _torque.law Setting.
sdpgrind.locus: _koren_example KorenExample; _motor MotorAxis; _area Area; _area_controller
AreaController; _controller LocusController; _dressed_grinding DressedGrinding; _drift Drift;
_gain_schedule GainSchedule; _grinding Grinding; _learned LearnedStart; _locus Locus; _modifiers
ModifierController; _problem Problem Varying; _problem_text Expression; _robust RobustLocus; _roughness
Roughness; _turning Turning.
sdpgrind.plunge: _bounding ConstraintBounding; _chain Chain SharpnessUpdate; _controller
CycleController; _cycle CyclePlan; _margins ChanceMargin MarginBounding RoundnessMargin
_ConstantFilter=_Bias; _dressing RoughnessLaw; _model PlungeModel Wear; _problem CycleProblem; _staged
StagedController.
sdpgrind.sdp: _normal Normal LogNormal; _rayleigh Rayleigh; _empirical Empirical RectifiedNormal;
_discrete Discrete; _charges Charge; _one_sided Linear Quadratic Constant OneSided; _policy Policy;
_problem Problem Axis Stop Levels Move Stages Forever.
sdpgrind.weldbead: passes._disc TiltedDisc; hwsim.plants._force_table_truth CoefficientScatter Motor;
_burn ForceBurnLimit MalkinBurnLimit PowerBurnLimit; _controllers SequenceController; _hierarchy Hierarchy
_PassTier _SequenceTier; _policy SequencePolicy; _problem SequenceProblem FinishCharge; _process
GrindingProcess; _scatter Scatter.
"""
# class: fields younger than journals; they count only where they are not at their default
_YOUNGER = {
    "AdaptiveGrinder": {"dullness", "dressing_state", "dressing_lead", "roughness_gauge"},
    "CenteringProblem": {"friction_range"},
    "CoefficientScatter": {"correlation"},
    "CycleController": {"confidence"},
    "CycleProblem": {"uncertainty", "drive"},
    "PlungeGrinder": {"drive", "power_gain_sd", "threshold_scatter", "inspection"},
    "PlungeModel": {"grinding_ratio"},
    "Scatter": {"mean"},
    "SequenceProblem": {"bead_scatter", "lead_length", "waviness"},
}
Home = Callable[[Any], tuple[Any, str]]
"""From a class or a function to the module and the name that count in a fingerprint."""


def fingerprint(thing: Any) -> str:
    """Return a SHA-256 digest of the content of `thing`, 64 hexadecimal digits."""
    return _digest(thing, _home)


def former(thing: Any) -> str:
    """Return the fingerprint of version 0.1.0, which includes its names of modules."""
    return _digest(thing, _former_home)


def _digest(thing: Any, home: Home) -> str:
    digest = hashlib.sha256()
    _feed(digest.update, thing, (), home)
    return digest.hexdigest()


def _home(thing: Any) -> tuple[Any, str]:
    """Module and name; of ours the package alone, since modules may be moved."""
    module = getattr(thing, "__module__", "")
    package = str(module).partition(".")[0]
    return package if package in _OURS else module, thing.__qualname__


def _former_home(thing: Any) -> tuple[Any, str]:
    module = getattr(thing, "__module__", "")
    area = ".".join(str(module).split(".")[: 2 if str(module).startswith("sdpgrind.") else 1])
    return _former_modules().get((area, thing.__qualname__), (module, thing.__qualname__))


@functools.cache
def _former_modules() -> dict[tuple[str, str], tuple[str, str]]:
    """(area, class) -> its module and name in version 0.1.0; ``new=old`` in the table: renamed since."""
    found: dict[tuple[str, str], tuple[str, str]] = {}
    for text in _FORMER.split(".\n")[:-1]:
        area, _, modules = text.strip().partition(": ")
        for module, *names in map(str.split, modules.split(";")):
            home = module if module.startswith("hwsim.") else f"{area}.{module}"
            for name in names:
                new, _, old = name.partition("=")
                found[area, new] = home, old or new
    return found


def _feed(take: Any, thing: Any, above: tuple[int, ...], home: Home) -> None:
    if id(thing) in above:
        take(f"<{above.index(id(thing))}>".encode())
        return
    if isinstance(thing, _PLAIN):
        take(f"{type(thing).__name__}:{thing!r};".encode())
    elif isinstance(thing, float):
        take(f"float:{float(thing).hex()};".encode())
    elif isinstance(thing, np.ndarray) and thing.dtype != object:
        take(f"array:{thing.dtype.str}{thing.shape};".encode())
        take(np.ascontiguousarray(thing).tobytes())
    else:
        take("{}.{}(".format(*home(type(thing))).encode())
        for piece in _pieces(thing, home):
            _feed(take, piece, (*above, id(thing)), home)
        take(b")")


def _pieces(thing: Any, home: Home) -> list[Any]:
    """Pieces of an object."""
    # before Mapping: a labelled table is one
    if hasattr(thing, "data_vars") and not isinstance(thing, type):
        named = sorted((str(name), variable) for name, variable in thing.variables.items())
        return [(name, variable.dims, _values(variable)) for name, variable in named]
    if isinstance(thing, Mapping):
        return [piece for item in thing.items() for piece in item]
    if isinstance(thing, list | tuple | range):
        return list(thing)
    if isinstance(thing, set | frozenset):
        return sorted(_digest(piece, home) for piece in thing)
    if isinstance(thing, np.ndarray | np.generic):
        return [thing.dtype.str, thing.tolist()]
    if isinstance(thing, functools.partial):
        return [thing.func, thing.args, thing.keywords]
    return _code(thing, home) if callable(thing) and hasattr(thing, "__qualname__") else _object(thing, home)


def _values(variable: Any) -> Any:
    """Values of a labelled array; texts (objects in some files, arrays in others) as a list."""
    values = np.asarray(variable.values)
    return values.tolist() if values.dtype.kind in "OU" else values


def _code(thing: Any, home: Home) -> list[Any]:
    """Pieces of a function: its code and constants, not its address."""
    if isinstance(thing, types.MethodType):
        return [thing.__self__, thing.__func__]
    named = [*home(thing)]
    if not isinstance(thing, types.FunctionType):
        return named
    closure = [cell.cell_contents for cell in thing.__closure__ or ()]
    return [*named, *_constants(thing.__code__), thing.__defaults__, thing.__kwdefaults__, closure]


def _constants(code: types.CodeType) -> list[Any]:
    inner = [_constants(c) if isinstance(c, types.CodeType) else c for c in code.co_consts]
    return [code.co_code, code.co_names, inner]


def _object(thing: Any, home: Home) -> list[Any]:
    """Pieces of any other object: its ``identity``, else its fields, else what pickle would store."""
    if hasattr(thing, "identity"):
        return [thing.identity]
    if isinstance(thing, np.random.Generator):
        return [thing.bit_generator.seed_seq]
    if isinstance(thing, np.random.SeedSequence):
        return [thing.entropy, thing.spawn_key, thing.n_children_spawned]
    if home is _former_home and hasattr(thing, "_former_fields"):
        return list(thing._former_fields)
    if dataclasses.is_dataclass(thing):
        younger = {*_YOUNGER.get(type(thing).__qualname__, ()), *getattr(thing, "_younger", ())}
        return [
            (f.name, getattr(thing, f.name))
            for f in dataclasses.fields(thing)
            if f.init and not (f.name in younger and getattr(thing, f.name) == f.default)
        ]
    if hasattr(thing, "dataset"):  # a plan
        return [getattr(thing, "problem", None), thing.dataset]
    return [piece for piece in thing.__reduce_ex__(4)[:3] if piece is not None]
