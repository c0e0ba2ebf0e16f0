"""Robot-assisted finishing: tool paths, joints, time laws, a torque axis, experiments (Wang and Jan 2001)."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(
    __name__, __file__, ("arm", "path", "roughness", "study", "surface", "timing", "torque")
)
