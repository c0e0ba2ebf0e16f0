"""A computer with more tasks than time: releases, priorities, overruns, and the schedule that results."""
