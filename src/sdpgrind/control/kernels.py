"""Compiled steps for compiled code of other packages: plain arrays, in place, serial, without allocation."""

from sdpgrind.control._kernels import LawCore, law_output, law_update, quantised

__all__ = ["LawCore", "law_output", "law_update", "quantised"]
