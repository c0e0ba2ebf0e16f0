from ._keys import make_keys as make_keys
from ._serve import Served as Served
