from ._arm import Arm as Arm
from ._branches import ArmChoice as ArmChoice
from ._branches import choose_branches as choose_branches
from ._heading import CornerJumps as CornerJumps
from ._heading import corner_jumps as corner_jumps
from ._lever import feed_angle as feed_angle
from ._lever import torque_per_force as torque_per_force
from ._tool import tool_poses as tool_poses
