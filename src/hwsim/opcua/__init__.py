"""Machines behind OPC UA: a simulated plant as a server with a watchdog, a machine as a plant, gate, keys.

Needs ``pip install 'sdpgrind[opcua]'``.
"""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
