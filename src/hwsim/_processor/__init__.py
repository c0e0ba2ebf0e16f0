"""Real-time tasks on one processor: releases, priorities, overruns, and the resulting schedule."""
