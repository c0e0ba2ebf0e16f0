from ._alarm import DriftAlarm as DriftAlarm
from ._chart import ChartLimits as ChartLimits
from ._chart import ChartSignal as ChartSignal
from ._chart import ControlChart as ControlChart
from ._drift import DriftTrack as DriftTrack
