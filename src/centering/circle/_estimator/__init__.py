"""Where a ring lies, reading by reading while it turns: the running estimator, when it is valid, the source's estimator."""
