"""Change of the state by a move, and its tables for the backward step."""
