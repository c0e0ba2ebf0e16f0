from ._placement import Placement as Placement
from ._proof import Proof as Proof
