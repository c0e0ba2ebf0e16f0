from . import codegen as codegen
from . import control as control
from . import finishing as finishing
from . import identify as identify
from . import locus as locus
from . import physics as physics
from . import plunge as plunge
from . import sdp as sdp
from . import weldbead as weldbead
from .base import units as units
from .base.budget import BudgetError as BudgetError
from .base.compiling.warm import warm as warm
from .base.damaged import DamagedFileError as DamagedFileError
from .base.damaged import OldFileWarning as OldFileWarning
from .base.records import load as load
from .codegen._export import export as export

__version__: str
