"""Part, model and problem of a push from `centering._problem`: the face of a package names only modules inside it."""

from centering._problem.model import Part as Part
from centering._problem.model import PushModel as PushModel
from centering._problem.problem import CenteringLimits as CenteringLimits
from centering._problem.problem import CenteringProblem as CenteringProblem
from centering._problem.problem import PushScatter as PushScatter
