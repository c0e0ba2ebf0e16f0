"""Backward step, and its repetition until a problem is solved.

The value-to-go ($) of mode i and coordinates x, n stages before the deadline, over stops j and moves k::

    V[n](i, x) = min( min_j stop[j](i, x) + late(n),
                      min_k min_u charge[k](x, u) + E V[n - duration[k]](i', x') )

``stop[j]``, ``late`` (n < 0)     `_problem.stops`, `_problem.countdown`
``E V`` of a shift, x' = x - D    `shift_backup`: tables; `shift_sums`: all nodes; one: `kernels._expect`
``E V`` of any other move         `point_backup`: every row and node by itself
``min_u``, also between levels    `kernels.push` for shifts, `kernels.least` for other moves
``min_j``, ``min_k``, ties        `sweep_kernels.choose`; small problems: all n in `sweep_kernels.sweep`
all moves, in blocks of nodes     `bundles`, here or on an executor
n = first, ..., last              `stages`; without a deadline `forever` repeats the step until V settles
V inside a cell                   `kinks`, where the best action changes; `steps`: single moves from any point
"""
