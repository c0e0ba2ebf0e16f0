"""
What a centred part costs
=========================

Three ways to centre a bearing ring to 2.5 µm: a skilled operator with a hammer, the source's machine, and a
strategy of few pushes. The times are printed or simulated; the money is an assumption, and stands first, so
that you can put in yours."""

import warnings
from dataclasses import dataclass, fields, replace
from typing import ClassVar

import matplotlib.pyplot as plt
import numpy as np

import centering
import hwsim

# %%
# What is assumed
# ---------------
# Mears (2006) prints 60 s and 25 $/h for the operator who centres by hand, 29.1 s for a ring of 18.9 kg on
# his machine, and less than 10 000 $ for its parts. The rest is made up: a machine (grinder or measuring
# machine) that waits while a ring is centred, loading by hand, and a share of the time in which somebody
# watches. Change them.


@dataclass(frozen=True)
class Assumptions:
    operator_rate: float = 25.0  # $/h, Mears, chapter 2
    machine_rate: float = 60.0  # $/h, of the machine that stands still meanwhile
    loading: float = 15.0  # s, with an operator, however it is centred
    watching: float = 0.1  # share of the automatic centering time that an operator is there
    device_price: float = 10_000.0  # $, Mears, chapter 7
    device_life: float = 10_000.0  # h of running
    manual_time: float = 60.0  # s, Mears, chapter 2

    UNITS: ClassVar = {"operator_rate": "$/h", "machine_rate": "$/h", "loading": "s", "watching": "", "device_price": "$",
                       "device_life": "h", "manual_time": "s"}  # fmt: skip


@dataclass(frozen=True)
class Way:
    """A way to centre: time of a part (s), share of parts that it leaves undone, and whether a machine does
    it.
    """

    name: str
    time: float
    undone: float
    automatic: bool


# %%
# Time of the strategy
# --------------------
# From the simulated machine, with all its scatter: the heavy ring, from 1 to 10 mm. A ring that is not done
# is centred by hand.
problem = centering.preset("printed").replace(
    part=centering.push.Part(mass=18.9, radius=89.5), tolerance=0.0025
)
with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # that slow pushes alone would not do: the strategy knows
    strategy = centering.plan(problem)
found = hwsim.run(
    hwsim.CenteringMachine(problem), centering.CenteringController(strategy), parts=40, rng=0
).outcome
time, pushes = float(found.time.mean()), float(found.pushes.mean())
error = float(found.time.std(ddof=1) / np.sqrt(found.sizes["part"]))
print(
    f"{time:.2f} +- {error:.2f} s and {pushes:.2f} pushes; {int(found.finished.sum())} of {found.sizes['part']} within tolerance"
)

base = Assumptions()
ways = [
    Way("by hand", base.manual_time, 0.0, False),
    Way("published", 29.1, 0.0, True),
    Way("this strategy", time, 1.0 - float(found.finished.mean()), True),
]

# %%
# Cost of a part, parts in an hour
# --------------------------------


def costs(way, money):
    """$ a part: operator, waiting machine, device."""
    by_hand = money.manual_time if not way.automatic else way.undone * money.manual_time
    automatic = way.time if way.automatic else 0.0
    attended = money.loading + by_hand + money.watching * automatic
    total = money.loading + by_hand + automatic
    device = money.device_price / money.device_life * automatic if way.automatic else 0.0
    return np.array([money.operator_rate * attended, money.machine_rate * total, device]) / 3600.0


def parts_per_hour(way, money):
    by_hand = money.manual_time if not way.automatic else way.undone * money.manual_time
    return 3600.0 / (money.loading + by_hand + (way.time if way.automatic else 0.0))


print(
    f"centering by hand alone, operator only: {base.operator_rate * base.manual_time / 3600:.2f} $ (Mears: 0.42)"
)
for way in ways:
    operator, machine, device = costs(way, base)
    total = operator + machine + device
    print(
        f"{way.name:14} {way.time:5.1f} s: {total:.3f} $ a part (operator {operator:.3f}, machine {machine:.3f}, "
        f"device {device:.4f}), {parts_per_hour(way, base):5.1f} parts an hour"
    )
saved = sum(costs(ways[0], base)) - sum(costs(ways[2], base))
print(
    f"saved against the hammer: {saved:.2f} $ a part; the device is paid after {base.device_price / saved:.0f} parts,",
    end=" ",
)
print(f"{base.device_price / saved / parts_per_hour(ways[2], base):.0f} hours of running")

# %%
# Where no machine waits, only the operator's time is saved:
idle = replace(base, machine_rate=0.0)
print(", ".join(f"{way.name} {sum(costs(way, idle)):.3f} $ a part" for way in ways))

# %%
# Once the pushes take two or three seconds, loading is what is left: a strategy that was twice as fast again
# would be worth little.
#
# What if they are wrong
# ----------------------
# Each assumption halved and doubled, the others as they are; what is saved a part, against the hammer and
# against the published cycle.


def saving(money, against):
    other = replace(against, time=money.manual_time) if not against.automatic else against
    return sum(costs(other, money)) - sum(costs(ways[2], money))


figure, axes = plt.subplots(1, 3, figsize=(11, 3.8), layout="constrained", width_ratios=(1, 1.2, 1.2))
bottom = np.zeros(3)
for k, (label, color) in enumerate(
    (("operator", "#b04a3a"), ("waiting machine", "#4878a8"), ("device", "#3f8f5f"))
):
    height = np.array([costs(way, base)[k] for way in ways])
    axes[0].bar(
        [way.name.replace(" ", "\n") for way in ways], height, bottom=bottom, color=color, label=label
    )
    bottom += height
axes[0].set(ylabel="cost of a part [\\$]")
axes[0].margins(y=0.1)
axes[0].legend(frameon=False, fontsize=8)
names = [each.name for each in fields(base)]
for axis, against in zip(axes[1:], ways[:2], strict=True):
    middle = saving(base, against)
    ends = {
        name: [saving(replace(base, **{name: f * getattr(base, name)}), against) for f in (0.5, 2.0)]
        for name in names
    }
    order = sorted(names, key=lambda name: abs(ends[name][1] - ends[name][0]))
    for row, name in enumerate(order):
        for end, color, told in zip(ends[name], ("#9ec3e0", "#4878a8"), ("halved", "doubled"), strict=True):
            axis.barh(row, end - middle, left=middle, color=color, label=None if row else told)
    axis.axvline(middle, color="0.2", lw=1)
    labels = [
        f"{name.replace('_', ' ')}, {getattr(base, name):g} {base.UNITS[name]}".strip().replace("$", r"\$")
        for name in order
    ]
    axis.set_yticks(range(len(names)), labels, fontsize=8)
    axis.set(xlabel=f"saved against {'the hammer' if not against.automatic else 'the published cycle'} [\\$]")
    axis.legend(frameon=False, fontsize=8, loc="lower right")
plt.show()
