"""Problems whose callbacks live in an importable module, so that they can go to other processes."""

import numpy as np

from sdpgrind import sdp

FORCES = sdp.Levels(0.0, 50.0, 17)


def cut(s, c):
    mean = 0.02 * c.force / (1.0 + s.dull)
    return sdp.Rayleigh(mean, (0.1 + 0.1 * s.dull) * mean)


def wear(s, c):
    return (s.dull + 0.006 * c.force,)


def dressed(s, c, e):
    return s.height, 0.5 * s.dull * e.left


def expensive_when_high(s, c):
    return 0.01 * s.height


def dulling(nodes=21):
    """Two axes, a shift and a sampled move, more than one block of each."""
    axes = [
        sdp.Axis("height", 0.0, 2.0, nodes, "mm", below="stop"),
        sdp.Axis("dull", 0.0, 1.0, 9, above="hold"),
    ]
    moves = [
        sdp.Move("grind", {"force": FORCES}, sdp.Shift("height", cut, wear), duration=2, charge=expensive_when_high),
        sdp.Move("dress", {}, sdp.Sampled(dressed, {"left": sdp.Discrete([0.0, 0.4])}), charge=0.02),
    ]  # fmt: skip
    stop = sdp.Stop("stop", sdp.Charge(under=sdp.Linear(2.0), over=sdp.Linear(10.0)))
    return sdp.Problem(axes, moves, [stop], sdp.Stages(6, 2.0))


def push(s, c, e):
    moved = c.aim * s.offset * (s.friction + e.slip)
    return np.abs(s.offset - moved), np.minimum(np.maximum(s.friction + 0.5 * e.slip, 0.6), 1.4)


def belief():
    """Two axes, without end."""
    axes = [
        sdp.Axis("offset", 0.05, 1.0, 60, scale="log", below=0.0, above="hold"),
        sdp.Axis("friction", 0.6, 1.4, 40),
    ]
    step = sdp.Sampled(push, {"slip": sdp.Discrete([-0.2, 0.2])})
    return sdp.Problem(axes, [sdp.Move("push", {"aim": [0.8, 1.0]}, step, charge=1.0)], [], sdp.Forever())


def line(nodes=41):
    """One axis, for Monte-Carlo."""
    move = sdp.Move("grind", {"mean": sdp.Levels(0.0, 0.8, 33)}, sdp.Shift("height", rayleigh))
    axis = sdp.Axis("height", 0.0, 2.0, nodes, "mm", below="stop")
    stop = sdp.Stop("stop", sdp.Charge(under=sdp.Linear(2.0), over=sdp.Linear(10.0)))
    return sdp.Problem([axis], [move], [stop], sdp.Stages(4, 1.0))


def rayleigh(s, c):
    return sdp.Rayleigh(c.mean, 0.15 * c.mean)
