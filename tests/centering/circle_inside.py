"""Private names of circle, roundness, friction, setup and monitoring that tests must reach: kernels, twins,
bounds.
"""

from centering.circle._estimator import slots
from centering.circle._estimator.move_kernels import _has_moved
from centering.circle._fit import fit_kernels, fit_noise_kernels, limacon, robust_kernels
from centering.circle._fit.fit import formed, triples
from centering.circle._fit.fit_noise import step_noise, travel_of
from centering.friction._belief import FrictionBelief
from centering.friction._bristle_laws import LAWS
from centering.friction._law_kernels import follow_load
from centering.friction._logged import UNITS, logged_pushes
from centering.friction._prediction import predicted, roughness
from centering.friction._prediction_kernels import log_likelihood
from centering.monitoring._alarm import Innovation, likely_step
from centering.monitoring._sequential import (
    Cusum,
    cusum_detection,
    cusum_limit,
    cusum_run_length,
    ewma_run_length,
    ewma_sd,
    learned_widening,
)
from centering.monitoring._tracked import FEWEST, REFERENCE
from centering.roundness._comparison import chance_below
from centering.roundness._direction_kernels import _four_about, _ranked, gaps
from centering.roundness._distance_kernels import _crossing, _parting, _standing, extremes
from centering.roundness._ends_kernels import zone_widths
from centering.roundness._filters import Filter, gaussian
from centering.roundness._harmonic_fit import fit_harmonics, values_at
from centering.roundness._interval import DrawnNoise, _without_ripple, lifts, seen
from centering.roundness._part_frame import from_part, into_part
from centering.roundness._polar import polar_axes, polar_scale
from centering.roundness._proof_kernels import (
    _across,
    _cell_bound,
    _height,
    ball,
    empty_reach,
    steepness,
    zone_reach,
)
from centering.roundness._robust_filter import robust_gaussian
from centering.roundness._roller_rows import Basis, harmonic_rows
from centering.roundness._sampling import supported, turns_of, unwrapped_turns, widest_gap
from centering.roundness._setups import Setups, split
from centering.setup._allowance import probability_text

__all__ = [
    "FEWEST",
    "LAWS",
    "REFERENCE",
    "UNITS",
    "Basis",
    "Cusum",
    "DrawnNoise",
    "Filter",
    "FrictionBelief",
    "Innovation",
    "Setups",
    "_across",
    "_cell_bound",
    "_crossing",
    "_four_about",
    "_has_moved",
    "_height",
    "_parting",
    "_ranked",
    "_standing",
    "_without_ripple",
    "ball",
    "chance_below",
    "cusum_detection",
    "cusum_limit",
    "cusum_run_length",
    "empty_reach",
    "ewma_run_length",
    "ewma_sd",
    "extremes",
    "fit_harmonics",
    "fit_kernels",
    "fit_noise_kernels",
    "follow_load",
    "formed",
    "from_part",
    "gaps",
    "gaussian",
    "harmonic_rows",
    "into_part",
    "learned_widening",
    "lifts",
    "likely_step",
    "limacon",
    "log_likelihood",
    "logged_pushes",
    "polar_axes",
    "polar_scale",
    "predicted",
    "probability_text",
    "robust_gaussian",
    "robust_kernels",
    "roughness",
    "seen",
    "slots",
    "split",
    "steepness",
    "step_noise",
    "supported",
    "travel_of",
    "triples",
    "turns_of",
    "unwrapped_turns",
    "values_at",
    "widest_gap",
    "zone_reach",
    "zone_widths",
]
