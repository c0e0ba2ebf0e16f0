"""Hardware simulation: plants, the loop between controller and plant, durable logs, a command line.

Examples
--------
>>> import hwsim
>>> from sdpgrind import weldbead
>>> stand = hwsim.WeldBeadStand(weldbead.preset("P1"))
>>> sorted(stand.accepts)
['duration', 'feed_rate', 'normal_force', 'stop']
"""

from sdpgrind.base import faces

_INSTEAD = "between computers, OPC UA (hwsim.serve, hwsim.OpcuaPlant); in a simulation, hwsim.QueueLink"
__getattr__, __dir__, __all__ = faces.attach(
    __name__,
    __file__,
    retired=dict.fromkeys(("TcpLink", "TcpListener"), ("_link.tcp", _INSTEAD)),
)
