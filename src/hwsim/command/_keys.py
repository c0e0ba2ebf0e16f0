"""``hwsim keys FOLDER``: keys and certificate of a machine or of its client."""

import argparse
from typing import Any


def add_keys(subparsers: Any) -> None:
    """Add the command to the subparsers."""
    about = "make a pair of keys for machines behind OPC UA, and a folder for the certificates of peers"
    parser = subparsers.add_parser("keys", help=about, description=f"{about[0].upper()}{about[1:]}.")
    parser.add_argument("folder", help="where they are made; nothing is overwritten")
    parser.set_defaults(work=work)


def work(arguments: argparse.Namespace) -> int:
    """Make the keys and say where they are."""
    import hwsim
    from sdpgrind.base.extras import need

    need("asyncua", "opcua")
    certificate, private = hwsim.opcua.make_keys(arguments.folder)
    print(f"{certificate} goes to the folder trusted of the other computer; {private} stays here")
    return 0
