from ._exported import Exported as Exported
from ._program import StepProgram as StepProgram
from ._proof.check import Difference as Difference
from ._proof.check import ExportCheck as ExportCheck
from ._proof.controller import CompiledController as CompiledController
from ._recipe import Recipe as Recipe
from ._tables import TablesAsked as TablesAsked
from ._translate.refusals import RefusedKernelError as RefusedKernelError
