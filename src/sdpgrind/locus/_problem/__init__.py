"""Problem and process; their functions as compiled tapes with exact derivatives."""
