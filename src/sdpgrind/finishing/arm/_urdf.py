"""Reader of a chain of joints in a URDF file: joints, origins, axes, limits; metres become mm."""

import math
import os
from collections.abc import Sequence
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.finishing.arm._links import rotation

READ = ("revolute", "continuous", "prismatic", "fixed")
_MM = 1000.0  # source: SI, mm in a metre
_ENDLESS = 4 * math.pi  # rad, chosen: two turns either way of a continuous joint
_XACRO = "http://www.ros.org/wiki/xacro", "http://ros.org/wiki/xacro"  # source: ROS wiki, both are used


class UrdfChain(NamedTuple):
    """Joints between two links: frames (4, 4) before them, mm, axes, limits in rad, mm and s."""

    names: tuple[str, ...]
    sliding: tuple[bool, ...]
    frames: list[Floats]
    axes: list[Floats]
    flange: Floats
    position_min: tuple[float, ...]
    position_max: tuple[float, ...]
    speed_max: tuple[float, ...]


class _Limit(NamedTuple):
    low: float
    high: float
    speed: float


def read_chain(path: str | os.PathLike[str], base: str, tip: str) -> UrdfChain:
    """Read the chain from link `base` to link `tip` of a URDF file; ValueError names joint or link."""
    file = checks.path("path", path)
    told = f"{file.name!r}"
    root = _root(file.read_bytes(), told)
    joints = _joints_between(root, base, tip, told)
    frames, axes, moving, here = [], [], [], np.eye(4)
    for joint in joints:
        here = here @ _origin(joint)
        if joint.get("type") != "fixed":
            frames.append(here)
            axes.append(_axis(joint))
            moving.append(joint)
            here = np.eye(4)
    if not moving:
        raise ValueError(f"{told} must have joints that move between {base!r} and {tip!r}; got none")
    limits = [_limit(joint) for joint in moving]
    return UrdfChain(
        tuple(_name(joint) for joint in moving),
        tuple(joint.get("type") == "prismatic" for joint in moving),
        frames,
        axes,
        here,
        tuple(limit.low for limit in limits),
        tuple(limit.high for limit in limits),
        tuple(limit.speed for limit in limits),
    )


def _root(text: bytes, told: str) -> ElementTree.Element:
    """Root of a URDF file without macros."""
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        if b"xacro:" in text:
            raise ValueError(f"{told} must be a URDF without xacro: run xacro first; got {error}") from None
        raise ValueError(f"{told} must be a URDF, an XML file; got {error}") from None
    if root.tag != "robot":
        raise ValueError(f"{told} must be a URDF with the root <robot>; got <{root.tag}>")
    for element in root.iter():
        space, _, tag = str(element.tag).rpartition("}")
        if space.strip("{") in _XACRO:
            raise ValueError(f"{told} must be a URDF without xacro: run xacro first; got <xacro:{tag}>")
    return root


def _joints_between(root: ElementTree.Element, base: str, tip: str, told: str) -> list[ElementTree.Element]:
    """Joints from `base` down to `tip`."""
    links = [str(link.get("name")) for link in root.findall("link")]
    joints = root.findall("joint")
    _once("link", links, told)
    _once("joint", [_name(joint) for joint in joints], told)
    for name, link in {"base": base, "tip": tip}.items():
        if link not in links:
            raise ValueError(f"{name} must be a link of {told}: {', '.join(links)}; got {link!r}")
    above: dict[str, list[ElementTree.Element]] = {}
    for joint in joints:
        above.setdefault(_end(joint, "child"), []).append(joint)
    found: list[ElementTree.Element] = []
    at = tip
    while at != base:
        leading = above.get(at, [])
        if len(leading) > 1:
            named = ", ".join(_name(joint) for joint in leading)
            raise ValueError(f"{told} must have one chain to {tip!r}; {named} all lead to {at!r}")
        if not leading or len(found) > len(joints):
            raise ValueError(f"tip must be below base {base!r} in {told}; got {tip!r}, below {at!r}")
        found.append(_read(leading[0]))
        at = _end(leading[0], "parent")
    return found[::-1]


def _once(what: str, names: Sequence[str], told: str) -> None:
    for k, name in enumerate(names):
        if name in names[:k]:
            raise ValueError(f"{told} must have each {what} once; got {name!r} twice")


def _name(joint: ElementTree.Element) -> str:
    return str(joint.get("name"))


def _end(joint: ElementTree.Element, which: str) -> str:
    found = joint.find(which)
    if found is None or not found.get("link"):
        raise ValueError(f"joint {_name(joint)!r} must have a {which} link; got none")
    return str(found.get("link"))


def _read(joint: ElementTree.Element) -> ElementTree.Element:
    """Refuse a joint of another kind, or one that follows another."""
    kind = joint.get("type")
    if kind not in READ:
        raise ValueError(f"joint {_name(joint)!r} must be {', '.join(READ)}; got {kind!r}")
    mimic = joint.find("mimic")
    if mimic is not None:
        raise ValueError(
            f"joint {_name(joint)!r} must move by itself; got a <mimic> of {mimic.get('joint')!r}"
        )
    return joint


def _numbers(joint: ElementTree.Element, tag: str, name: str, default: str) -> list[float]:
    """Three numbers of an attribute."""
    found = joint.find(tag)
    text = default if found is None else found.get(name, default)
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        numbers = []
    if len(numbers) != 3 or not all(map(math.isfinite, numbers)):
        raise ValueError(f"{name} of <{tag}> of joint {_name(joint)!r} must be three numbers; got {text!r}")
    return numbers


def _origin(joint: ElementTree.Element) -> Floats:
    """Frame (4, 4) of a joint in its parent, mm."""
    out = np.eye(4)
    out[:3, 3] = _MM * np.array(_numbers(joint, "origin", "xyz", "0 0 0"))
    out[:3, :3] = rotation(_numbers(joint, "origin", "rpy", "0 0 0"))
    return out


def _axis(joint: ElementTree.Element) -> Floats:
    """Unit axis of a joint."""
    axis = np.array(_numbers(joint, "axis", "xyz", "1 0 0"))
    size = float(np.linalg.norm(axis))
    if size == 0.0:
        raise ValueError(f"<axis> of joint {_name(joint)!r} must have a direction; got 0 0 0")
    out: Floats = axis / size
    return out


def _limit(joint: ElementTree.Element) -> _Limit:
    """Limits of a joint that moves, rad, mm and s."""
    kind, found = joint.get("type"), joint.find("limit")
    if found is None:
        raise ValueError(f"joint {_name(joint)!r} must have a <limit> with a velocity; got none")
    scale = _MM if kind == "prismatic" else 1.0
    low, high, speed = (_bound(joint, found, name) for name in ("lower", "upper", "velocity"))
    if speed <= 0.0:
        raise ValueError(f"velocity of joint {_name(joint)!r} must be > 0 (rad/s, m/s); got {speed!r}")
    if kind == "continuous":
        return _Limit(-_ENDLESS, _ENDLESS, speed)
    if low >= high:
        raise ValueError(
            f"upper of joint {_name(joint)!r} must be > lower (rad, m); got {high!r} and {low!r}"
        )
    return _Limit(scale * low, scale * high, scale * speed)


def _bound(joint: ElementTree.Element, limit: ElementTree.Element, name: str) -> float:
    text = limit.get(name, "0")
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f"{name} of joint {_name(joint)!r} must be a number; got {text!r}")
    return value
