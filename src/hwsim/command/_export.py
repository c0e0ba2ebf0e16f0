"""``hwsim export PLAN FOLDER``: a saved plan as C99 with the same bits, without solving it again."""

import argparse
from typing import Any


def add_export(subparsers: Any) -> None:
    """Add the command to the subparsers."""
    about = "write a saved plan as C99 that gives the same bits as the library, with a self-test"
    parser = subparsers.add_parser("export", help=about, description=about.capitalize() + ".")
    parser.add_argument("plan", help="file of a plan, as plan.save writes it")
    parser.add_argument("folder", help="where NAME.h, NAME.c and the self-test are written")
    parser.add_argument("--target", choices=["c99"], default="c99", help="language (c99)")
    parser.add_argument("--name", help="prefix of files and functions; default: the name of the folder")
    parser.add_argument("--overwrite", action="store_true", help="replace another export in the folder")
    parser.set_defaults(work=work)


def work(arguments: argparse.Namespace) -> int:
    """Export a plan and return the exit status."""
    import sdpgrind

    plan = sdpgrind.load(arguments.plan)
    made = sdpgrind.export(
        plan, arguments.folder, arguments.target, name=arguments.name, overwrite=arguments.overwrite
    )
    name = made.manifest["name"]
    print(
        f"{arguments.folder}: {name}.h, {name}.c ({made.size / 1000:.0f} kB), {name}_selftest.c, vectors.bin"
    )
    print(made.promise)
    return 0
