"""How a move changes the state: shift by a random amount, sampled step, rows given, stay; as tables for the backward step."""
