"""State of the filter of a part: estimates with covariance, axis, commands under way."""

from sdpgrind.base.states import record

Q, LOAD, STIFFNESS, SHARPNESS, WEAR, GAIN, SHOWN = range(7)
STATES = SHOWN + 1
QUEUE = 128  # chosen: commands under way; a dead time has at most so many samples

FILTER = record(
    f"mean[{STATES}] mixed, cov[{STATES**2}] mixed, by_x[{STATES}] mixed, by_v[{STATES}] mixed,"
    f" row[{STATES}] mixed, cross[{STATES}] mixed, rate mm/s, axis mm, trail mm, sent 1, queue[{QUEUE}] mm/s"
)
