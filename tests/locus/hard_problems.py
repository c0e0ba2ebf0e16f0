"""Problems on which a tracer can go wrong, each of one kind of trouble."""

import numpy as np

from sdpgrind.locus import Problem, Varying

EXAMPLE = {
    "controls": {"u": (0.0, 5.0), "v": (0.0, 10.0)},
    "cost": lambda s, c: (c.u - 1) ** 2 + (c.v - 4) ** 2,
    "constraints": [
        Varying(response=lambda s, c: s.x * c.v + 16 - 4 * c.v, limit=lambda s, c: 17 + c.u - 4 * c.v)
    ],
}


def one(response, limit=lambda s, c: 0.0 * s.x, name="response"):
    return Varying(response=response, limit=limit, name=name)


def problem(cost, *constraints, x=(0.0, 1.0), **controls):
    return Problem(controls=controls, hidden={"x": x}, cost=cost, constraints=constraints)


PROBLEMS = {
    "koren": Problem(hidden={"x": (0.2, 20.0)}, **EXAMPLE),
    # two valleys, of which the deeper is closed first
    "jump": problem(
        lambda s, c: (c.u**2 - 1) ** 2 + 0.3 * c.u + (c.v - 0.2) ** 2,
        one(lambda s, c: s.x - c.u - 0.1 * c.v),
        x=(-2.0, 1.0), u=(-2.0, 2.0), v=(-1.0, 1.0),
    ),
    # the floor of one valley rises until it is none
    "fold": problem(
        lambda s, c: c.u**4 / 4 - c.u**2 / 2 + s.x * c.u + (c.v - c.u) ** 2,
        one(lambda s, c: s.x + 0.1 * c.v, lambda s, c: 9.0),
        x=(-0.8, 0.8), u=(-2.0, 2.0), v=(-3.0, 3.0),
    ),
    # both controls meet bounds, and leave them
    "bounds": problem(
        lambda s, c: (c.u - 2 * s.x**2) ** 2 + (c.v - 1 + s.x) ** 2 + 0.1 * c.u * c.v,
        one(lambda s, c: 0.3 * s.x + c.u * 0.2 + c.v, lambda s, c: 1.1 + 0.5 * c.u),
        x=(-1.2, 1.5), u=(0.2, 1.5), v=(0.1, 1.2),
    ),
    # symmetric valleys that part from one
    "pitchfork": problem(
        lambda s, c: (c.v**2) ** 2 - s.x * c.v**2 + c.u**2,
        one(lambda s, c: c.u + s.x, lambda s, c: 5.0),
        x=(-1.0, 1.0), u=(-2.0, 2.0), v=(-2.0, 2.0),
    ),
    # a constraint is in the way only for a while
    "for-a-while": problem(
        lambda s, c: (c.u - 1 + s.x) ** 2 + (c.v - 3 * (s.x - 0.5) ** 2) ** 2,
        one(lambda s, c: 0.5 * s.x - c.v, lambda s, c: 0.0 * c.u),
        u=(-1.0, 2.0), v=(-1.0, 2.0),
    ),
    # one of two constraints takes over from the other, by way of their corner
    "swap": problem(
        lambda s, c: (c.u - 2) ** 2 + (c.v - 2) ** 2,
        one(lambda s, c: (0.5 + s.x) * c.u + c.v, lambda s, c: 2.0, "first"),
        one(lambda s, c: c.u + (0.4 + 3 * s.x) * c.v, lambda s, c: 2.2, "second"),
        u=(0.0, 3.0), v=(0.0, 3.0),
    ),
    # of linear cost: always in a corner
    "corners": problem(
        lambda s, c: -c.u - 0.7 * c.v,
        one(lambda s, c: (1 + s.x) * c.u + c.v, lambda s, c: 2.5),
        x=(0.0, 4.0), u=(0.1, 1.0), v=(0.2, 2.0),
    ),
    "one-control": problem(lambda s, c: -c.u, one(lambda s, c: s.x * c.u**1.5, lambda s, c: 1 + c.u), x=(0.5, 9.0), u=(0.1, 4.0)),
    "one-control-linear-scale": problem(
        lambda s, c: (c.u - 1) ** 2 * (1 + s.x), one(lambda s, c: s.x + c.u, lambda s, c: 1.5), x=(-0.5, 3.0), u=(-2.0, 4.0)
    ),
    "three-controls": problem(
        lambda s, c: (c.u - 1) ** 2 + 2 * (c.v - 2) ** 2 + (c.w - 0.5) ** 2 + 0.3 * c.u * c.w,
        one(lambda s, c: s.x * c.v + c.u * c.w, lambda s, c: 2 + 0.5 * c.u),
        x=(0.5, 5.0), u=(0.0, 3.0), v=(0.0, 3.0), w=(0.1, 3.0),
    ),
    "four-controls": problem(
        lambda s, c: (c.a - 1) ** 2 + (c.b - 2) ** 2 + 2 * (c.d - 1.5) ** 2 + (c.e - 0.3) ** 2 + 0.2 * c.a * c.b * c.e,
        one(lambda s, c: s.x * (c.a + c.b) + c.d**2, lambda s, c: 4 + c.e, "first"),
        one(lambda s, c: c.d + s.x, lambda s, c: 3 + c.a, "second"),
        x=(0.5, 4.0), a=(0.0, 3.0), b=(0.0, 3.0), d=(0.0, 3.0), e=(0.0, 1.0),
    ),
    # cost depends on the hidden state, also where nothing is active
    "cost-of-state": problem(
        lambda s, c: (c.u - s.x) ** 2 + (c.v - s.x**2) ** 2 + c.u * c.v / 4,
        one(lambda s, c: s.x + c.u * c.v, lambda s, c: 1.5),
        x=(0.1, 2.0), u=(0.0, 3.0), v=(-1.0, 4.0),
    ),
    # feasible over a range of controls that closes
    "end": problem(
        lambda s, c: (c.u - 3) ** 2 + 0.1 * c.v**2,
        one(lambda s, c: s.x + (c.u - 1) ** 2 + (c.v - 0.5) ** 2, lambda s, c: 1.0),
        x=(-2.0, 2.0), u=(-1.0, 4.0), v=(-2.0, 2.0),
    ),
    "sliver": problem(
        lambda s, c: (c.u - 0.7) ** 2 + (c.v - 0.1) ** 2,
        one(lambda s, c: s.x + 4e4 * (c.u - c.v) ** 2 + c.u, lambda s, c: 1.4),
        x=(0.0, 1.2), u=(0.0, 1.0), v=(0.0, 1.0),
    ),
    "tiny-state": Problem(
        controls={"u": (1.0, 2.0), "v": (1e-5, 1e-2)}, hidden={"x": (2e-9, 3e-7)},
        cost=lambda s, c: -c.u * c.v,
        constraints=[one(lambda s, c: s.x * 1e7 + 300 * c.v + c.u**2 * 0.2, lambda s, c: 2 + 0.3 * c.u)],
    ),
    "huge-state": problem(
        lambda s, c: (c.u - 1) ** 2 + (c.v - 2) ** 2,
        one(lambda s, c: 1e-9 * s.x * c.v - c.u, lambda s, c: 0.5),
        x=(-1e9, 4e9), u=(0.0, 3.0), v=(0.5, 3.0),
    ),
    "trig": problem(
        lambda s, c: -np.cos(2 * c.u) * np.cos(2 * c.v - 0.3) + 0.1 * (c.u - 0.4) ** 2 + 0.05 * c.v,
        one(lambda s, c: s.x + c.u + c.v**2 * 0.3, lambda s, c: 2.0),
        x=(0.0, 5.0), u=(-3.0, 3.0), v=(-3.0, 3.0),
    ),
}  # fmt: skip
