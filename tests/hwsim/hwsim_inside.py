"""Private names of `hwsim` that its tests look at."""

from hwsim._link import backlog as backlogs
from hwsim._link.frames import LinkFrame, parsed
from hwsim._link.tcp import TcpLink, TcpListener, Unpacker, packed
from hwsim._log import chain
from hwsim._log.fingerprint import fingerprint, former
from hwsim._log.frames import Frames
from hwsim._log.labels import Labels
from hwsim._log.log import same
from hwsim._log.salvage import salvage
from hwsim._part.clock import Clock, common_tick, exact, simplest
from hwsim._part.motions import command_column, digest
from hwsim._part.part import column
from hwsim._processor.schedule import Kind
from hwsim._processor.tasks import DRAWN, release_time
from hwsim.command._report import CommandReport, broken_off, parts_table, summary_head, summary_line
from hwsim.command._roundness.terms import in_terms
from hwsim.command._run_folder import with_kept
from hwsim.command._toml import Table, read

__all__ = [
    "DRAWN",
    "Clock",
    "CommandReport",
    "Frames",
    "Kind",
    "Labels",
    "LinkFrame",
    "Table",
    "TcpLink",
    "TcpListener",
    "Unpacker",
    "backlogs",
    "broken_off",
    "chain",
    "column",
    "command_column",
    "common_tick",
    "digest",
    "exact",
    "fingerprint",
    "former",
    "in_terms",
    "packed",
    "parsed",
    "parts_table",
    "read",
    "release_time",
    "salvage",
    "same",
    "simplest",
    "summary_head",
    "summary_line",
    "with_kept",
]  # fmt: skip
