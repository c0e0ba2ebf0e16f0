"""Programs of robots: a motion as URScript, RAPID, KRL or a table, and readers that follow them."""
