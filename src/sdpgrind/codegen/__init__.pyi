from ._export import export as export
from ._exported import Exported as Exported
from ._proof.check import Checked as Checked
from ._proof.check import Difference as Difference
from ._proof.controller import CompiledController as CompiledController
from ._recipe import Recipe as Recipe
from ._translate.refusals import RefusedKernelError as RefusedKernelError
