"""
Ski trails: a problem of modes alone
====================================

Brown (1988), Appendix A, explains dynamic programming with a skier who wants to be at the parking lot soon.
Where the skier stands is one of a few intersections: there is no continuous coordinate, no chance and no
deadline. In :mod:`sdpgrind.sdp` that is a problem without axes whose *modes* are the intersections.

The figure with the map did not survive, its numbers partly did: from A the lot is 2 minutes away and from B 1
minute; D is 4 minutes above A and 6 above B; I is 2 minutes above D, and less than that above E, from where
the best way leads through C and takes 9 minutes. All other trails here are ours."""

import matplotlib.pyplot as plt
import numpy as np

from sdpgrind import sdp

# %%
# The trails: from, to, minutes. The entrances of the lot are called west, middle and east.
trails = [
    ("A", "west", 2), ("A", "middle", 3), ("B", "middle", 1), ("B", "east", 4), ("C", "east", 3), ("C", "middle", 5),
    ("D", "A", 4), ("D", "B", 6), ("E", "B", 9), ("E", "C", 6), ("F", "B", 3), ("F", "C", 2), ("G", "C", 3),
    ("H", "D", 3), ("I", "D", 2), ("I", "E", 1), ("J", "E", 2), ("J", "F", 5), ("K", "F", 2), ("K", "G", 1),
]  # fmt: skip
entrances = ("west", "middle", "east")
places = (*"ABCDEFGHIJK", *entrances)

# %%
# One move, "ski", has one entry for each trail. It keeps the coordinates (there are none), is allowed where
# the trail begins, charges the minutes, and leads into the mode where the trail ends. One stops at an
# entrance, for nothing.
start = np.array([places.index(a) for a, _, _ in trails])
minutes = np.array([float(t) for _, _, t in trails])


def time_taken(s, c):
    return minutes[c.trail]


def begins_here(s, c):
    return start[c.trail] == s.mode


def at_the_lot(s):
    return s.mode >= places.index("west")


problem = sdp.Problem(
    axes=[],
    moves=[
        sdp.Move(
            "ski",
            {"trail": np.arange(len(trails))},
            sdp.Stay(),
            charge=time_taken,
            allowed=begins_here,
            into=[b for _, b, _ in trails],
        )
    ],
    stops=[sdp.Stop("parked", lambda s: 0.0 * s.mode, allowed=at_the_lot)],
    stages=sdp.Forever(),
    modes=places,
)
policy = sdp.plan(problem)

# %%
# The table tells the way from anywhere, also from where one did not mean to go: the wrong turn from I to E
# costs 2 minutes.
for place in "ABDEI":
    trail = trails[int(policy.action(mode=place).trail)]
    print(f"from {place}: {policy.value(mode=place):g} minutes, by the trail to {trail[1]}")
wrong_turn = 1 + policy.value(mode="E")
print(f"from I by way of E: {wrong_turn:g} minutes")

# %%
# The map, with the best trail from every intersection drawn thick.
height = (
    dict.fromkeys(entrances, 0)
    | dict.fromkeys("ABC", 1)
    | dict.fromkeys("DEFG", 2)
    | dict.fromkeys("HIJK", 3)
)
level = {h: [p for p in places if height[p] == h] for h in range(4)}
spot = {p: ((k + 0.5) / len(level[h]), h) for h, names in level.items() for k, p in enumerate(names)}
figure, ax = plt.subplots(figsize=(6, 4), layout="constrained")
for k, (a, b, t) in enumerate(trails):
    best = int(policy.action(mode=a).trail) == k
    ax.plot(
        *zip(spot[a], spot[b], strict=True),
        color="#1f4e79" if best else "0.8",
        lw=3 if best else 1,
        zorder=2 if best else 1,
    )
    ax.text(*(0.6 * np.array(spot[a]) + 0.4 * np.array(spot[b])), t, fontsize=8, ha="center", zorder=4)
for p, (x, y) in spot.items():
    ax.text(
        x,
        y,
        f"{p}\n{policy.value(mode=p):g}",
        ha="center",
        va="center",
        bbox={"boxstyle": "round", "fc": "white"},
        zorder=3,
    )
ax.set_axis_off()
ax.set_title("minutes to the parking lot")
plt.show()
