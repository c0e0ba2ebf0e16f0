"""What tests of pushes and cycles use of the inside: kernels, searches, constants."""

from centering._problem.model import GRAVITY
from centering.cycle._control import controller as cycle_controller
from centering.cycle._control import next_push as cycle_next
from centering.cycle._control.following import braking_speed
from centering.cycle._control.launch import Approach, SentPush, felt_model, followed, launch, preview
from centering.cycle._control.learning import LearnedBias, RingTravel
from centering.cycle._control.next_push import NextPush
from centering.cycle._control.part_view import PartView
from centering.cycle._control.push_evidence import FeltPush
from centering.cycle._control.table_motion import TableMotion
from centering.cycle._measuring.form import RingFilter
from centering.cycle._measuring.form_kernels import LAST, SIZE, _write_row
from centering.cycle._measuring.rotations import places
from centering.cycle._source.planner import PrintedPlanner
from centering.cycle._strategy.as_sdp import FRACTIONS, KindOfPush, Size, draws
from centering.cycle._strategy.belief import FrictionScaleBelief
from centering.cycle._strategy.belief_kernels import learned, push_cells
from centering.cycle._strategy.cycle_times import WORTH, cycle_timing, table_speeds
from centering.cycle._strategy.density import lower_end, moments, prior, widened
from centering.cycle._strategy.draw_kernels import push_once
from centering.cycle._strategy.lookup_kernels import choose
from centering.cycle._strategy.outcome_kernels import FINE
from centering.cycle._strategy.outcomes import FRICTION_SCALES
from centering.cycle._strategy.plan import GIVEN_UP, SETTLED, prepared, solved
from centering.cycle._strategy.tip_ways import run_up
from centering.cycle._strategy.turning_kernels import RESTING, push_to_push, speed_after, turn_time
from centering.push._contact.reaction import COLUMN_NAMES, pushed
from centering.push._contact.reaction_kernels import FORCE, TRAVEL, WORK
from centering.push._minimum_time import search as optimal
from centering.push._minimum_time.program import STARTS, PushProgram, PushTask, Swing, TipState
from centering.push._plan.touch import profile_of
from centering.push._profile.rows import after, forward, remaining
from centering.push.turning import _plane_kernels as at
from centering.push.turning import _quasi_static_kernels as back
from centering.push.turning import _slide_kernels as slide
from centering.push.turning._lead import TooFastError
from centering.push.turning._plane_kernels import _push_on_table
from centering.push.turning._quasi_static_kernels import touch_back
from centering.push.turning._shooting import landing, ring_state
from hwsim._log.fingerprint import fingerprint

__all__ = [
    "COLUMN_NAMES",
    "FINE",
    "FORCE",
    "FRACTIONS",
    "FRICTION_SCALES",
    "GIVEN_UP",
    "GRAVITY",
    "LAST",
    "RESTING",
    "SETTLED",
    "SIZE",
    "STARTS",
    "TRAVEL",
    "WORK",
    "WORTH",
    "Approach",
    "FeltPush",
    "FrictionScaleBelief",
    "KindOfPush",
    "LearnedBias",
    "NextPush",
    "PartView",
    "PrintedPlanner",
    "PushProgram",
    "PushTask",
    "RingFilter",
    "RingTravel",
    "SentPush",
    "Size",
    "Swing",
    "TableMotion",
    "TipState",
    "TooFastError",
    "_push_on_table",
    "_write_row",
    "after",
    "at",
    "back",
    "braking_speed",
    "choose",
    "cycle_controller",
    "cycle_next",
    "cycle_timing",
    "draws",
    "felt_model",
    "fingerprint",
    "followed",
    "forward",
    "landing",
    "launch",
    "learned",
    "lower_end",
    "moments",
    "optimal",
    "places",
    "prepared",
    "preview",
    "prior",
    "profile_of",
    "push_cells",
    "push_once",
    "push_to_push",
    "pushed",
    "remaining",
    "ring_state",
    "run_up",
    "slide",
    "solved",
    "speed_after",
    "table_speeds",
    "touch_back",
    "turn_time",
    "widened",
]
