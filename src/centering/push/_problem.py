"""Part, model and problem from `centering._problem`: a face names only modules of its own package."""

from centering._problem.model import Part as Part
from centering._problem.model import PushModel as PushModel
from centering._problem.problem import CenteringLimits as CenteringLimits
from centering._problem.problem import CenteringProblem as CenteringProblem
from centering._problem.problem import PushScatter as PushScatter
