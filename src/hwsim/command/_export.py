"""``hwsim export PLAN PATH``: a saved plan as C99 or an FMU with the same bits, without solving it again."""

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hwsim.command._statuses import say
from hwsim.command._times import ON, Outlook
from sdpgrind.base.progress import Progress, Speaker, reported


def add_export(subparsers: Any) -> None:
    """Add the command to the subparsers."""
    about = "write a saved plan as C99 or as an FMU"
    more = " that gives the same bits as the library, with a self-test."
    parser = subparsers.add_parser("export", help=about, description=f"W{about[1:]}{more}")
    parser.add_argument("plan", help="file of a plan, as plan.save writes it")
    parser.add_argument("folder", help="folder of NAME.h, NAME.c and the self-test, or NAME.fmu")
    parser.add_argument(
        "--target", choices=["c99", "fmi2"], default="c99", help="C99, or an FMU of FMI 2.0 (c99)"
    )
    parser.add_argument("--name", help="prefix of files and functions; default: that of folder or FMU")
    parser.add_argument(
        "--precision",
        choices=["double", "float32", "int16"],
        default="double",
        help="digits of the tables of a policy; the manifest tells what they lose (double)",
    )
    parser.add_argument(
        "--math", default="libm", metavar="FOLDER", help="C sources of a libm that go into the export (libm)"
    )
    parser.add_argument(
        "--lost-max", type=float, metavar="$", help="value that smaller tables of a policy may lose at most"
    )
    parser.add_argument(
        "--outputs", metavar="NAME,...", help="outputs of a policy, with or without gap and value"
    )
    parser.add_argument("--overwrite", action="store_true", help="replace another export there")
    parser.set_defaults(work=work)


def work(arguments: argparse.Namespace) -> int:
    """Export a plan and return the exit status."""
    _check_folder(arguments)
    outlook = _foretold(arguments)
    with Speaker(known=(outlook.whole, outlook.compiling)) as line, reported(line) as tell:
        made = _exported(arguments, tell)
    name, unit = made.manifest["name"], made.manifest.get("fmi")
    source = f"{name}.h, {name}.c ({made.size / 1000:.0f} kB), {name}_selftest.c, vectors.bin"
    held = ", ".join(unit["binaries"] or ["no binary"]) + ", " if unit else ""
    print(f"{arguments.folder}: {held}{source}")
    if told := _tables_told(made.manifest):
        print(told)
    print(made.promise)
    return 0


def _foretold(arguments: argparse.Namespace) -> Outlook:
    """Say what will be done and how long it takes."""
    lost = arguments.lost_max is not None or arguments.precision != "double"
    outlook = Outlook.alone("export --lost-max" if lost else "export")
    kind = "an FMU" if arguments.target == "fmi2" else "C99"
    what = ", with the value that smaller tables lose" * lost
    if Path(arguments.plan).exists():  # else what is wrong is told alone
        on = f"{ON}, measured on the policy of the example"
        say(f"{arguments.plan} as {kind}{what}: {outlook.line()} ({on})")
    return outlook


def _exported(arguments: argparse.Namespace, tell: Progress) -> Any:
    """Load the plan and write its export."""
    import sdpgrind

    tell(0.0, "loading the plan")
    plan = sdpgrind.load(arguments.plan)
    if not hasattr(plan, "__export__"):
        raise ValueError(
            "plan must be the file of a sequence policy, an sdp.Policy, a locus or a strategy;"
            f" {arguments.plan} holds a {type(plan).__name__};"
            " controllers are exported from Python, as by"
            " sdpgrind.export(plunge.CycleController(plan.problem), folder)"
        )
    outputs = arguments.outputs
    try:
        return sdpgrind.export(
            plan,
            arguments.folder,
            arguments.target,
            precision=arguments.precision,
            math=arguments.math,
            lost_max=arguments.lost_max,
            outputs=outputs if outputs is None else [one.strip() for one in outputs.split(",")],
            name=arguments.name,
            overwrite=arguments.overwrite,
            progress=tell,
        )
    except FileExistsError as error:
        raise FileExistsError(
            str(error).replace("overwrite must be True", "--overwrite must be given")
        ) from None


def _tables_told(manifest: Mapping[str, Any]) -> str:
    """Return how the tables are kept, and what that loses; "": as they are."""
    if "lost" not in manifest:
        return ""
    lost, unit = manifest["lost"], manifest["lost"]["unit"]
    return (
        f"tables in {manifest['precision']}, which lose at most {lost['all_stages']:.3g} {unit};"
        f" the plan's own error is {lost['error']:.3g} {unit}"
    )


def _check_folder(arguments: argparse.Namespace) -> None:
    """Refuse paths that need another option, and name it."""
    place, unit = Path(arguments.folder), arguments.target == "fmi2"
    if unit != (place.suffix == ".fmu"):
        told = "end in .fmu with --target fmi2" if unit else "be a folder, or an FMU by --target fmi2"
        raise ValueError(f"path must {told}; got {arguments.folder!r}")
    stem = place.stem if unit else place.resolve().name
    if arguments.name is None and not (stem.isascii() and stem.isidentifier()):
        raise ValueError(
            f"--name must be given where that of folder or FMU is no identifier of C; got {stem!r}"
        )
