from ._keys import make_keys as make_keys
from ._plant import OpcuaPlant as OpcuaPlant
from ._serve import Served as Served
from ._serve import serve as serve
