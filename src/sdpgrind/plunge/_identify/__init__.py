"""Model parameters from logs of parts: contact, sharpness, time constant."""
