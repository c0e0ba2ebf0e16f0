"""FMU of an export: its files, identity and binary."""

import hashlib
import json
import uuid
from collections.abc import Mapping
from typing import Any

from sdpgrind.base.warned import warn
from sdpgrind.codegen._files.manifest import text_of
from sdpgrind.codegen._fmi.binary import FOLDER, binary_of, compiled_of
from sdpgrind.codegen._fmi.description import build_description, model_description
from sdpgrind.codegen._fmi.unit_source import unit_source
from sdpgrind.codegen._recipe import Recipe


def unit_files(recipe: Recipe, name: str, version: str, exported: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return the files of an FMU by their path, of those of an export in C."""
    apart = {f"{name}_selftest.c", "vectors.bin", "manifest.json"}
    c_files = {one: content for one, content in exported.items() if one not in apart}
    sources = compiled_of([*c_files, f"{name}_fmu.c"])
    guid = _guid(recipe, name, version, c_files, sources)
    c_files[f"{name}_fmu.c"] = unit_source(recipe, name, guid).encode("ascii")
    files = {
        "modelDescription.xml": model_description(recipe, name, version, guid, sources),
        "sources/buildDescription.xml": build_description(name, sources),
        **{f"sources/{one}": content for one, content in c_files.items()},
        **{f"resources/{one}": exported[one] for one in (f"{name}_selftest.c", "vectors.bin")},
    }
    binary, reason = binary_of(name, c_files)
    if binary is None:
        warn(f"the FMU holds sources only, no binary: {reason}")
    else:
        files[f"{FOLDER}/{name}.so"] = binary
    told = _manifest(exported["manifest.json"], guid, reason)
    return {**files, "resources/manifest.json": text_of(told, files).encode()}


def _guid(recipe: Recipe, name: str, version: str, c_files: Mapping[str, bytes], sources: list[str]) -> str:
    """Return the identity: a digest of description and sources, which hold it and are taken without it."""
    total = hashlib.sha256(model_description(recipe, name, version, "", sources))
    for content in (unit_source(recipe, name, "").encode("ascii"), *c_files.values()):
        total.update(hashlib.sha256(content).digest())
    return f"{{{uuid.UUID(total.hexdigest()[:32])}}}"


def _manifest(exported: bytes, guid: str, reason: str) -> dict[str, Any]:
    told: dict[str, Any] = json.loads(exported)
    told["fmi"] = {
        "version": "2.0",
        "guid": guid,
        "binaries": [] if reason else [FOLDER],
        "no_binary": reason,
    }
    return told
