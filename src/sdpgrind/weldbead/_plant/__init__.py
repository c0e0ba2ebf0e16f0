"""Hidden physics of a bead under the grinder: drawn coefficients, motor, metal removed sample by sample."""
