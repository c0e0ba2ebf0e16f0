from ._fit import LeaveOneOut as LeaveOneOut
from ._fit import leave_one_out as leave_one_out
from ._model import RoughnessModel as RoughnessModel
from ._refinish import refinish_problem as refinish_problem
