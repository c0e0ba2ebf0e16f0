"""Plants wrapped in faults: readings late, lost, wrong or stuck, a link that is cut, a clock that jumps.

Examples
--------
A gauge that reads 0.02 mm too much, and one reading of twenty that comes a sample late:

>>> import hwsim
>>> from sdpgrind import weldbead
>>> stand = hwsim.WeldBeadStand(weldbead.preset("P1"))
>>> wrong = hwsim.faults.Bias(stand, of="height", by=0.02)  # mm
>>> hard = hwsim.faults.Late(wrong, of="height", share=0.05)
>>> [name for name in hard.outcomes if name.startswith("seen")]
['seen_bias_height', 'seen_late_height']
"""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
