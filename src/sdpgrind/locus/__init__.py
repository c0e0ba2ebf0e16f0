"""The best point of a process whose limit drifts with a state that nobody can measure (Koren 1989)."""

from sdpgrind.locus._problem import Problem, Process, Varying

__all__ = ["Problem", "Process", "Varying"]
