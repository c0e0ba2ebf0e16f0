"""Descriptions of an FMU in XML: ``modelDescription.xml`` and ``buildDescription.xml``."""

import math
from collections.abc import Sequence
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from sdpgrind.codegen._fmi.base_units import base_unit
from sdpgrind.codegen._fmi.variables import UnitVariable, first_value, variables_of
from sdpgrind.codegen._recipe import Recipe
from sdpgrind.codegen._translate.runtime import FLAGS

_SAMPLES = 500  # chosen: steps of the default experiment; some masters lengthen steps beyond 1000
_DECLARED = b'<?xml version="1.0" encoding="UTF-8"?>\n'
_ABLE = (
    "canBeInstantiatedOnlyOncePerProcess", "canGetAndSetFMUstate", "canHandleVariableCommunicationStepSize",
    "canInterpolateInputs", "canNotUseMemoryManagementFunctions", "canRunAsynchronuously",
    "canSerializeFMUstate",
)  # fmt: skip


def model_description(recipe: Recipe, name: str, version: str, guid: str, sources: Sequence[str]) -> bytes:
    """Return ``modelDescription.xml`` of a recipe."""
    variables = variables_of(recipe)
    root = Element(
        "fmiModelDescription", fmiVersion="2.0", modelName=name, guid=guid, description=_told(recipe),
        version=recipe.fingerprint, generationTool=f"sdpgrind {version}", variableNamingConvention="flat",
    )  # fmt: skip
    _kind(root, recipe, name, sources)
    _units(root, variables)
    _statuses(SubElement(root, "TypeDefinitions"), recipe, name)
    SubElement(SubElement(root, "LogCategories"), "Category", name="logStatusError")
    if recipe.period is not None:
        stop = repr(_SAMPLES * recipe.period)
        SubElement(root, "DefaultExperiment", startTime="0.0", stopTime=stop, stepSize=repr(recipe.period))
    listed = SubElement(root, "ModelVariables")
    for one in variables:
        _variable(listed, one, name)
    _structure(SubElement(root, "ModelStructure"), variables)
    return written(root)


def build_description(name: str, sources: Sequence[str]) -> bytes:
    """Return ``buildDescription.xml``: that of FMI 3.0, which tools read in FMUs of 2.0, too."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    build = SubElement(root, "BuildConfiguration", modelIdentifier=name)
    files = SubElement(build, "SourceFileSet", language="C99", compilerOptions=FLAGS[1])
    for one in sources:
        SubElement(files, "SourceFile", name=one)
    SubElement(build, "Library", name="m", external="true")
    return written(root)


def written(root: Element) -> bytes:
    """Return XML in ASCII, which is UTF-8 as well."""
    ElementTree.indent(root)
    text: bytes = ElementTree.tostring(root, encoding="us-ascii", xml_declaration=False)
    return _DECLARED + text + b"\n"


def _told(recipe: Recipe) -> str:
    length = "any length" if recipe.period is None else f"{recipe.period!r} s"
    text = f"{recipe.kind}, a step of {length}. {recipe.equations}"
    # XML has no other control characters, and joins lines of attributes
    return " ".join("".join(one if one.isprintable() else " " for one in text).split())


def _kind(root: Element, recipe: Recipe, name: str, sources: Sequence[str]) -> None:
    able = {"canGetAndSetFMUstate", "canSerializeFMUstate", "canNotUseMemoryManagementFunctions"}
    able |= {"canHandleVariableCommunicationStepSize"} if recipe.period is None else set()
    about = {"modelIdentifier": name} | {one: "true" if one in able else "false" for one in _ABLE}
    files = SubElement(SubElement(root, "CoSimulation", about), "SourceFiles")
    for one in sources:
        SubElement(files, "File", name=one)


def _units(root: Element, variables: Sequence[UnitVariable]) -> None:
    units = sorted({one.unit for one in variables} - {"", "1"})
    parent = SubElement(root, "UnitDefinitions") if units else root
    for unit in units:
        base, one = base_unit(unit), SubElement(parent, "Unit", name=unit)
        if base is not None:
            SubElement(one, "BaseUnit", base)


def _statuses(parent: Element, recipe: Recipe, name: str) -> None:
    kind = SubElement(parent, "SimpleType", name=f"{name}_status")
    listed = SubElement(kind, "Enumeration")
    for k, told in enumerate(recipe.status):
        SubElement(listed, "Item", name=told, value=str(k))


def _variable(parent: Element, one: UnitVariable, name: str) -> None:
    about = {"name": one.name, "valueReference": str(one.reference), "description": one.description}
    state = {"causality": one.causality, "variability": "discrete"}
    state |= {"initial": "calculated"} if one.causality == "output" else {}
    told = SubElement(SubElement(parent, "ScalarVariable", about | state), one.type)
    if one.causality == "input":
        told.set("start", "true" if one.type == "Boolean" else repr(first_value(*one.limits)))
    if one.type == "Enumeration":
        told.set("declaredType", f"{name}_status")
    elif one.unit not in ("", "1"):
        told.set("unit", one.unit)
    for name, value in zip(("min", "max"), one.limits, strict=True):
        if one.type == "Real" and math.isfinite(value):
            told.set(name, repr(value))


def _structure(parent: Element, variables: Sequence[UnitVariable]) -> None:
    """Outputs depend on all inputs of a step; at the start on none."""
    outputs = [str(k) for k, one in enumerate(variables, 1) if one.causality == "output"]
    listed = SubElement(parent, "Outputs")
    for index in outputs:
        SubElement(listed, "Unknown", index=index)
    first = SubElement(parent, "InitialUnknowns")
    for index in outputs:
        SubElement(first, "Unknown", index=index, dependencies="")
