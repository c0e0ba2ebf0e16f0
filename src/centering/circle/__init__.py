"""Where a turning ring lies, and how sure that is."""
