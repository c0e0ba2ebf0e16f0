"""Digests of a journal: each part's is that of the one before and its own row, so that none can be exchanged.

H(p1, p2, ...) is BLAKE2b-256 over the pieces, each preceded by its length; digests are texts of 64
hexadecimal digits. The head has the number of parts and the last digest: it tells a lost end, which a chain
alone cannot.
"""

from collections.abc import Mapping
from hashlib import blake2b

BEGUN, HEAD, ACTS = "begun", "head", "acts"
"""Keys of the table ``run``: the digest of its other rows, the head, that of the operator's acts."""
OWN = (BEGUN, HEAD, ACTS)
_LENGTH = 8  # bytes of a length, big-endian; chosen: no piece is longer


def begun(run: Mapping[str, str]) -> str:
    """Digest of the rows of ``run`` but those of the chain itself: the beginning of the chain."""
    told = sorted(key for key in run if key not in OWN)
    return _digest(*(f"{key}={run[key]}".encode() for key in told))


def following(before: str, number: int, outcome: str, names: str, arrays: bytes) -> str:
    """Digest of a part, from that of the part before."""
    texts = (before, str(number), outcome, names)
    return _digest(*(text.encode() for text in texts), arrays)


def following_act(before: str, number: int, told: str) -> str:
    """Digest of an act of the operator, from that of the act before."""
    return _digest(before.encode(), str(number).encode(), told.encode())


def head(count: int, last: str) -> str:
    """Head of `count` parts, from the digest of the last one (of none: the beginning)."""
    return f"{count}:{last}"


def _digest(*pieces: bytes) -> str:
    state = blake2b(digest_size=32)
    for piece in pieces:
        state.update(len(piece).to_bytes(_LENGTH, "big"))
        state.update(piece)
    return state.hexdigest()
