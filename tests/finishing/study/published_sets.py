"""Published data sets with the sums of squares that go with them; a wrong digit would not give these."""

from typing import NamedTuple

import numpy as np


class Published(NamedTuple):
    source: str
    settings: dict
    response: list
    interactions: tuple
    squares: dict  # to the digits printed
    tolerance: float


def _repeated(counts, names):
    return [name for name, count in zip(names, counts, strict=True) for _ in range(count)]


WARP_BREAKS = Published(
    "Tippett (1950), breaks of yarn by wool and tension; `warpbreaks` of R, whose help prints its analysis",
    {"wool": ["A"] * 27 + ["B"] * 27, "tension": (["L"] * 9 + ["M"] * 9 + ["H"] * 9) * 2},
    [26, 30, 54, 25, 70, 52, 51, 26, 67, 18, 21, 29, 17, 12, 18, 35, 30, 36, 36, 21, 24, 18, 10, 43, 28, 15, 26,
     27, 14, 29, 19, 29, 31, 41, 20, 44, 42, 26, 19, 16, 39, 28, 21, 39, 29, 20, 21, 24, 17, 13, 15, 15, 16, 28],
    (("wool", "tension"),),
    {"wool": 450.7, "tension": 2034.3, "wool x tension": 1002.8, "error": 5745.1},
    0.05,
)  # fmt: skip

PEAS = Published(
    "Yates' experiment on peas in 6 blocks, Venables and Ripley (2002), section 6.7; `npk` of R",
    {
        "block": [str(k) for k in range(1, 7) for _ in range(4)],
        "N": [0, 1, 0, 1, 1, 1, 0, 0, 0, 1, 1, 0, 1, 1, 0, 0, 1, 0, 1, 0, 1, 1, 0, 0],
        "P": [1, 1, 0, 0, 0, 1, 0, 1, 1, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 1, 0, 1, 1, 0],
        "K": [1, 0, 0, 1, 0, 1, 1, 0, 0, 1, 0, 1, 0, 1, 1, 0, 0, 0, 1, 1, 1, 0, 1, 0],
    },
    [49.5, 62.8, 46.8, 57.0, 59.8, 58.5, 55.5, 56.0, 62.8, 55.8, 69.5, 55.0,
     62.0, 48.8, 45.5, 44.2, 52.0, 51.5, 49.8, 48.8, 57.2, 59.0, 53.2, 56.0],
    (("N", "P"), ("N", "K"), ("P", "K")),
    {"block": 343.3, "N": 189.3, "P": 8.4, "K": 95.2, "N x P": 21.3, "N x K": 33.1, "P x K": 0.5, "error": 185.3},
    0.05,
)  # fmt: skip

CHICKS = Published(
    "McNeil (1977), weights of chicks by feed; `chickwts` of R; groups of 10 to 14",
    {"feed": _repeated((10, 12, 14, 12, 11, 12), ("horsebean", "linseed", "soybean", "sunflower", "meatmeal", "casein"))},
    [179, 160, 136, 227, 217, 168, 108, 124, 143, 140, 309, 229, 181, 141, 260, 203, 148, 169, 213, 257, 244, 271,
     243, 230, 248, 327, 329, 250, 193, 271, 316, 267, 199, 171, 158, 248,
     423, 340, 392, 339, 341, 226, 320, 295, 334, 322, 297, 318, 325, 257, 303, 315, 380, 153, 263, 242, 206, 344, 258,
     368, 390, 379, 260, 404, 318, 352, 359, 216, 222, 283, 332],
    (),
    {"feed": 231129, "error": 195556},
    0.5,
)  # fmt: skip

CARS = Published(
    "Henderson and Velleman (1981), miles per gallon of 32 cars; `mtcars` of R; cells of 2 to 12",
    {
        "cylinders": [6, 6, 4, 6, 8, 6, 8, 4, 4, 6, 6, 8, 8, 8, 8, 8, 8, 4, 4, 4, 4, 8, 8, 8, 8, 4, 4, 4, 8, 6, 8, 4],
        "C": ["manual" if k in (0, 1, 2, 17, 18, 19, 25, 26, 27, 28, 29, 30, 31) else "automatic" for k in range(32)],
    },
    [21, 21, 22.8, 21.4, 18.7, 18.1, 14.3, 24.4, 22.8, 19.2, 17.8, 16.4, 17.3, 15.2, 10.4, 10.4,
     14.7, 32.4, 30.4, 33.9, 21.5, 15.5, 15.2, 13.3, 19.2, 27.3, 26, 30.4, 15.8, 19.7, 15, 21.4],
    (("cylinders", "C"),),
    {"total": 1126.05},
    0.005,
)  # fmt: skip

SETS = {"warp breaks": WARP_BREAKS, "peas": PEAS, "chicks": CHICKS, "cars": CARS}

# Phadke (1989), Quality Engineering Using Robust Design, tables 3.2 to 3.4: surface defects of a CVD process,
# S/N in dB.
PHADKE_RATIO = np.array([-20.0, -10, -30, -25, -45, -65, -45, -65, -70])
PHADKE_FACTORS = dict.fromkeys(("temperature", "pressure", "settling", "cleaning"), (1, 2, 3))
PHADKE_SQUARES = {"temperature": 2450, "pressure": 950, "settling": 350, "cleaning": 50}
