"""``hwsim export PLAN PATH``: a saved plan as C99 or an FMU with the same bits, without solving it again."""

import argparse
from typing import Any


def add_export(subparsers: Any) -> None:
    """Add the command to the subparsers."""
    about = "write a saved plan as C99, or an FMU, that gives the same bits as the library, with a self-test"
    parser = subparsers.add_parser("export", help=about, description=about.capitalize() + ".")
    parser.add_argument("plan", help="file of a plan, as plan.save writes it")
    parser.add_argument("folder", help="folder of NAME.h, NAME.c and the self-test, or NAME.fmu")
    parser.add_argument(
        "--target", choices=["c99", "fmi2"], default="c99", help="C99, or an FMU of FMI 2.0 (c99)"
    )
    parser.add_argument("--name", help="prefix of files and functions; default: that of folder or FMU")
    parser.add_argument("--overwrite", action="store_true", help="replace another export there")
    parser.set_defaults(work=work)


def work(arguments: argparse.Namespace) -> int:
    """Export a plan and return the exit status."""
    import sdpgrind

    plan = sdpgrind.load(arguments.plan)
    if not hasattr(plan, "__export__"):
        raise ValueError(
            f"plan must be the file of a sequence policy or of a locus; {arguments.plan} holds a"
            f" {type(plan).__name__}; controllers are exported from Python, by sdpgrind.export"
        )
    made = sdpgrind.export(
        plan, arguments.folder, arguments.target, name=arguments.name, overwrite=arguments.overwrite
    )
    name, unit = made.manifest["name"], made.manifest.get("fmi")
    source = f"{name}.h, {name}.c ({made.size / 1000:.0f} kB), {name}_selftest.c, vectors.bin"
    held = ", ".join(unit["binaries"] or ["no binary"]) + ", " if unit else ""
    print(f"{arguments.folder}: {held}{source}")
    print(made.promise)
    return 0
