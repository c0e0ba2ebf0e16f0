"""The job of the force table's beads, whose coefficients differ by 15 % between passes and between beads."""

from sdpgrind import weldbead

PROCESS = weldbead.GrindingProcess(12.8, 114.0, 0.33, 88.9, 500.0, 0.0, 12.7)
NAMES = ("K1", "K2", "mu")
PASSES = weldbead.Scatter(NAMES, (0.15, 0.15, 0.15), law="lognormal", mean="coefficient")
BEADS = weldbead.CoefficientScatter(0.15, 0.15, 0.15)
ALONE = weldbead.preset("P4").replace(
    model=PROCESS, bead_length=150.0, durations=range(12, 41, 4), stage=4.0, horizon=60.0, scatter=PASSES
)
BOTH = ALONE.replace(bead_scatter=BEADS)
