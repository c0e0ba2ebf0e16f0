"""Problem and process, and their functions as compiled tapes with derivatives."""
