"""What tests of exports reach inside the packages."""

from sdpgrind.codegen._export import EXPORTED as EXPORTED
from sdpgrind.codegen._export import recipe_of as recipe_of
from sdpgrind.codegen._files.program import program_files as program_files
from sdpgrind.codegen._files.vectors import LibrarySteps as LibrarySteps
from sdpgrind.codegen._files.vectors import Varied as Varied
from sdpgrind.codegen._files.vectors import bounds_of as bounds_of
from sdpgrind.codegen._files.vectors import rows_of as rows_of
from sdpgrind.codegen._fmi.base_units import base_unit as base_unit
from sdpgrind.codegen._fmi.description import model_description as model_description
from sdpgrind.codegen._math.c_file import CFile as CFile
from sdpgrind.codegen._proof import compilers as compilers
from sdpgrind.codegen._translate.values import identical as identical
from sdpgrind.locus._curve.inversion import Inversion as Inversion
from sdpgrind.locus._problem import tape_kernels as tape_kernels
from sdpgrind.locus._problem.tape import tape as tape
from sdpgrind.locus._problem.tape_lines import straight_lines as straight_lines
from sdpgrind.locus._trace.table import LocusTable as LocusTable
from sdpgrind.sdp._policy.small_tables import small_of as small_of
