"""Faces of a STEP file with their placements: representations, assemblies and mapped items."""

import re
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.surface._step.entities import StepFile, StepRow
from sdpgrind.finishing.surface._step.measures import StepUnits, units_of
from sdpgrind.finishing.surface._step.placements import placement

_SURFACE = re.compile(r"_SURFACE$|^SURFACE_OF_")
DEEPEST = 40  # chosen: parts within parts
MOST = 200_000  # chosen: faces of a file with all its instances
FACES = ("ADVANCED_FACE", "FACE_SURFACE")
# where the members of an item stand: place of a list, or of one reference
_LISTS = {
    "SHELL_BASED_SURFACE_MODEL": 1, "FACE_BASED_SURFACE_MODEL": 1, "OPEN_SHELL": 1, "CLOSED_SHELL": 1,
    "CONNECTED_FACE_SET": 1, "GEOMETRIC_SET": 1, "GEOMETRIC_CURVE_SET": 1,
}  # fmt: skip
_SINGLE = {"MANIFOLD_SOLID_BREP": 1, "ORIENTED_CLOSED_SHELL": 2, "ORIENTED_OPEN_SHELL": 2, "ORIENTED_FACE": 2}
# items without area
_BARE = (
    "AXIS2_PLACEMENT_3D", "AXIS2_PLACEMENT_2D", "CARTESIAN_POINT", "DIRECTION", "LINE", "CIRCLE", "ELLIPSE",
    "TRIMMED_CURVE", "COMPOSITE_CURVE", "POLYLINE", "B_SPLINE_CURVE_WITH_KNOTS", "BOUNDED_CURVE",
    "VERTEX_POINT", "EDGE_CURVE", "PLANE_PLACEMENT", "DESCRIPTIVE_REPRESENTATION_ITEM",
)  # fmt: skip


class PlacedFace(NamedTuple):
    """A face: its number, its motion (4, 4) in mm, and the units of its geometry."""

    number: int
    motion: Floats
    units: StepUnits


class PartLink(NamedTuple):
    """A representation within another one, moved."""

    child: int
    parent: int
    motion: Floats


class Assembly:
    """Representations of a file and how they stand in one another."""

    def __init__(self, file: StepFile) -> None:
        self._file = file
        self._shapes = {row.number: row for row in _representations(file)}
        self._same = {number: number for number in self._shapes}
        self._units: dict[int, StepUnits] = {}
        for row in file.rows("SHAPE_REPRESENTATION_RELATIONSHIP"):
            if row.values and not file.find(row.number, "REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION"):
                self._unite(row.reference(2), row.reference(3))
        self._links = list(self._transformations())

    def faces(self) -> list[PlacedFace]:
        """Return all faces, those of a part that is there twice two times."""
        inner = {link.child for link in self._links} | set(self._mapped())
        tops = dict.fromkeys(self._root(number) for number in self._shapes)
        found: list[PlacedFace] = []
        for top in tops:
            if top not in inner:
                self._collect(top, np.eye(4), 0, found)
        return found

    def _collect(self, top: int, motion: Floats, depth: int, found: list[PlacedFace]) -> None:
        """Add the faces of one representation, and of all in it."""
        if depth > DEEPEST or len(found) > MOST:
            raise ValueError(f"{self._file.name(top)} must not be a part of itself")
        for number, row in self._shapes.items():
            if self._root(number) == top:
                for item in row.references(1):
                    self._add(item, row, motion, depth, found)
        for link in self._links:
            if link.parent == top:
                self._collect(link.child, motion @ link.motion, depth + 1, found)

    def _add(self, item: int, shape: StepRow, motion: Floats, depth: int, found: list[PlacedFace]) -> None:
        mapped = self._file.find(item, "MAPPED_ITEM")
        if mapped is None:
            found += [PlacedFace(face, motion, self._units_of(shape)) for face in _faces(self._file, item)]
            return
        source = self._file.row(mapped.reference(1), "REPRESENTATION_MAP")
        scale = self._units_of(shape).length
        inner = self._units_of(self._shape(source.reference(1))).length
        there = placement(self._file, mapped.reference(2), scale)
        here = placement(self._file, source.reference(0), inner)
        self._collect(self._root(source.reference(1)), motion @ there @ np.linalg.inv(here), depth + 1, found)

    def _transformations(self) -> Iterator[PartLink]:
        for row in self._file.rows("REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION"):
            relation = self._file.row(
                row.number, "REPRESENTATION_RELATIONSHIP", "SHAPE_REPRESENTATION_RELATIONSHIP"
            )
            pair = relation.reference(2), relation.reference(3)
            told = self._file.row(row.reference(-1), "ITEM_DEFINED_TRANSFORMATION")
            first, second = (
                placement(self._file, told.reference(place), self._units_of(self._shape(each)).length)
                for place, each in zip((2, 3), pair, strict=True)
            )
            if self._turned(row.number, pair):
                yield PartLink(self._root(pair[1]), self._root(pair[0]), first @ np.linalg.inv(second))
            else:
                yield PartLink(self._root(pair[0]), self._root(pair[1]), second @ np.linalg.inv(first))

    def _turned(self, relation: int, pair: tuple[int, int]) -> bool:
        """Whether the second representation is the part, by the products of a usage."""
        for row in self._file.rows("CONTEXT_DEPENDENT_SHAPE_REPRESENTATION"):
            if row.reference(0) == relation:
                shape = self._file.row(row.reference(1), "PRODUCT_DEFINITION_SHAPE")
                usage = self._file.find(shape.reference(2), "NEXT_ASSEMBLY_USAGE_OCCURRENCE")
                parts = () if usage is None else self._of_product(usage.reference(4))
                return self._root(pair[1]) in parts and self._root(pair[0]) not in parts
        return False

    def _of_product(self, product: int) -> tuple[int, ...]:
        """Representations of a product."""
        found = []
        for row in self._file.rows("SHAPE_DEFINITION_REPRESENTATION"):
            shape = self._file.find(row.reference(0), "PRODUCT_DEFINITION_SHAPE")
            if shape is not None and shape.reference(2) == product:
                found.append(self._root(row.reference(1)))
        return tuple(found)

    def _mapped(self) -> Iterator[int]:
        for row in self._file.rows("REPRESENTATION_MAP"):
            yield self._root(row.reference(1))

    def _shape(self, number: int) -> StepRow:
        if number not in self._shapes:
            raise ValueError(f"{self._file.name(number)} must be a SHAPE_REPRESENTATION")
        return self._shapes[number]

    def _units_of(self, shape: StepRow) -> StepUnits:
        context = shape.reference(2)
        if context not in self._units:
            self._units[context] = units_of(self._file, context)
        return self._units[context]

    def _root(self, number: int) -> int:
        """Representation that stands for all that are the same."""
        self._shape(number)
        while self._same[number] != number:
            number = self._same[number]
        return number

    def _unite(self, one: int, other: int) -> None:
        self._same[self._root(other)] = self._root(one)


def _representations(file: StepFile) -> Iterator[StepRow]:
    for entity in file.entities.values():
        for record in entity.records:
            if record.type.endswith("SHAPE_REPRESENTATION") and len(record.values) == 3:
                yield StepRow(entity, record)


def _faces(file: StepFile, item: int, depth: int = 0) -> Iterator[int]:
    """Numbers of the faces of an item, and of surfaces without loops."""
    types = [record.type for record in file.entity(item).records]
    members = next((each for each in types if each in _LISTS or each in _SINGLE), None)
    if depth > DEEPEST:
        raise ValueError(f"{file.name(item)} must not be a part of itself")
    if any(each in FACES or each == "PLANE" or _SURFACE.search(each) for each in types):
        yield item
    elif "BREP_WITH_VOIDS" in types:
        row = file.row(item, "BREP_WITH_VOIDS")
        for shell in (row.reference(1), *row.references(2)):
            yield from _faces(file, shell, depth + 1)
    elif members in _SINGLE:
        yield from _faces(file, file.row(item, members).reference(_SINGLE[members]), depth + 1)
    elif members is not None:
        for each in file.row(item, members).references(_LISTS[members]):
            yield from _faces(file, each, depth + 1)
    elif not any(each in _BARE for each in types):
        raise ValueError(f"{file.name(item)} is not read; export faces with B-spline or elementary surfaces")
