"""Damage to bytes, drawn from a seeded generator, and a limit of time."""

import contextlib
import signal


class Hang(BaseException):
    """Something took longer than it may."""


@contextlib.contextmanager
def within(seconds):
    """End with :class:`Hang` what takes longer."""

    def ring(*_):
        raise Hang(f"took more than {seconds} s")

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def damaged_bytes(rng, whole):
    """Bytes with bits turned over, a part lost, doubled, overwritten or foreign, or an end cut off."""
    damaged, at = bytearray(whole), int(rng.integers(len(whole)))
    length = int(rng.integers(1, min(64, len(whole)) + 1))
    kind = rng.integers(6)
    if kind == 0:
        for place in rng.integers(len(whole), size=rng.integers(1, 9)):
            damaged[place] ^= 1 << int(rng.integers(8))
    elif kind == 1:
        del damaged[at:]
    elif kind == 2:
        del damaged[at : at + length]
    elif kind == 3:
        damaged[at:at] = damaged[at : at + length]
    elif kind == 4:
        damaged[at : at + length] = bytes(len(damaged[at : at + length]))
    else:
        damaged[at : at + length] = rng.bytes(len(damaged[at : at + length]))
    return bytes(damaged)
