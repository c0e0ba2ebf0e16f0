"""Commands, measurements and seeds of a lockstep part as numbers and texts of OPC UA, bit for bit.

A packed mapping begins with one number a name, NaN where it is absent or an array; each array follows as the
index of its name, its number of dimensions, its shape and its entries.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from math import nan, prod
from typing import Any

import numpy as np

from hwsim._part.motions import as_table
from sdpgrind.base import checks


def packed(names: Sequence[str], values: Mapping[str, Any]) -> list[float]:
    """Return a mapping as a flat list of numbers."""
    flat, arrays = [nan] * len(names), dict[str, Any]()
    for k, name in enumerate(names):
        if name not in values:
            continue
        value = values[name]
        array = value if isinstance(value, float | int) else np.asarray(as_table(value), dtype=float)
        if np.ndim(array):
            arrays[name] = array
        else:
            flat[k] = float(array)
    return flat + blocks(names, arrays)


def blocks(names: Sequence[str], values: Mapping[str, Any]) -> list[float]:
    """Return a mapping as numbers: for each value its name's index, its dimensions, shape and entries."""
    flat = list[float]()
    for name, value in values.items():
        array = np.asarray(as_table(value), dtype=float)
        flat += [names.index(name), array.ndim, *array.shape, *array.ravel().tolist()]
    return flat


def unpacked(names: Sequence[str], flat: Sequence[float]) -> dict[str, Any]:
    """Return the mapping of `packed`; absent numbers are NaN."""
    return dict(zip(names, flat, strict=False)) | unblocked(names, flat[len(names) :])


def given(names: Sequence[str], flat: Sequence[float]) -> dict[str, Any]:
    """Return the mapping of `packed` without absent numbers: NaN is no command."""
    numbers = {name: value for name, value in zip(names, flat, strict=False) if value == value}
    return numbers | unblocked(names, flat[len(names) :])


def unblocked(names: Sequence[str], flat: Sequence[float]) -> dict[str, Any]:
    """Return the mapping of `blocks`."""
    return dict(_unblocked(names, flat))


def _unblocked(names: Sequence[str], flat: Sequence[float]) -> Iterator[tuple[str, Any]]:
    at = 0
    while at < len(flat):
        name, dimensions = names[int(flat[at])], int(flat[at + 1])
        shape = tuple(int(length) for length in flat[at + 2 : at + 2 + dimensions])
        begin = at + 2 + dimensions
        at = begin + prod(shape)
        if min(shape, default=0) < 0 or at > len(flat):
            raise ValueError(f"{name} must have the entries of its shape; got shape {shape}")
        entries = np.array(flat[begin:at], dtype=float).reshape(shape)
        yield name, entries if shape else float(entries)


def seed_text(rng: np.random.Generator, past: Sequence[Mapping[str, float]] = ()) -> str:
    """Return the seed sequence of an unused generator as a text; whole numbers as texts, of any size.

    `past`: outcomes of the parts before, where they change the plant.
    """
    source, seed = rng.bit_generator, rng.bit_generator.seed_seq
    if not isinstance(seed, np.random.SeedSequence) or not _unused(rng, seed):
        raise ValueError(f"rng must be an unused generator of numpy.random.default_rng; got {source!r}")
    entropy = seed.entropy
    words = [entropy] if isinstance(entropy, int | np.integer) else list(entropy or ())
    return json.dumps(
        {
            "entropy": [str(word) for word in words],
            "single": isinstance(entropy, int | np.integer),
            "spawn_key": [str(word) for word in seed.spawn_key],
            "spawned": seed.n_children_spawned,
            "past": list(past),
        }
    )


def _unused(rng: np.random.Generator, seed: np.random.SeedSequence) -> bool:
    source = rng.bit_generator
    return isinstance(source, np.random.PCG64) and np.random.PCG64(seed).state == source.state


def seeded(text: str) -> tuple[np.random.Generator, list[dict[str, float]]]:
    """Return the generator of `seed_text`, or of a whole number, and the outcomes of the parts before."""
    try:
        told = json.loads(text)
        if isinstance(told, int) and told >= 0:
            return np.random.default_rng(told), []
        words = [int(word) for word in told["entropy"]]
        entropy = words[0] if told["single"] else words
        key = tuple(int(word) for word in told["spawn_key"])
        seed = np.random.SeedSequence(entropy, spawn_key=key, n_children_spawned=int(told["spawned"]))
        past = [{str(name): float(value) for name, value in each.items()} for each in told["past"]]
    except (ValueError, TypeError, KeyError, IndexError, OverflowError, AttributeError):
        raise checks.refuse(
            "seed", 'a whole number >= 0 or {"entropy": [...], "spawn_key": [...]}', text
        ) from None
    return np.random.default_rng(seed), past


def scalars(outcome: Mapping[str, Any]) -> dict[str, float]:
    """Return the numbers of an outcome, without arrays and texts."""
    numbers = {name: np.asarray(value) for name, value in outcome.items()}
    return {
        name: float(each) for name, each in numbers.items() if not each.ndim and each.dtype.kind in "fiub"
    }


def outcome_text(outcome: Mapping[str, Any]) -> str:
    """Return an outcome as JSON: numbers with all their digits, null for NaN, infinity as a text."""
    return json.dumps({name: _plain(value) for name, value in outcome.items()}, allow_nan=False)


def _plain(value: Any) -> Any:
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        return str(value)
    return _entry(float(array)) if not array.ndim else _entries(array.tolist())


def _entries(entries: list[Any]) -> list[Any]:
    return [_entries(each) if isinstance(each, list) else _entry(each) for each in entries]


def _entry(number: float) -> float | str | None:
    if number != number:
        return None
    return number if abs(number) < float("inf") else str(number)


def outcome_of(told: Mapping[str, Any]) -> dict[str, Any]:
    """Return the outcome of decoded JSON."""
    return {name: _restored(value) for name, value in told.items()}


def _restored(value: Any) -> Any:
    if isinstance(value, list):
        return [_restored(each) for each in value]
    return nan if value is None else value
