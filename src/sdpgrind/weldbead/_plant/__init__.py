"""Hidden physics of a bead under the grinder: drawn coefficients, motor, removed metal."""
