"""Damage, drawn from a seeded generator: to bytes, to the text of a study, to the cells of a table."""

import contextlib
import re
import signal
import warnings

from roughvisc.errors import RoughviscError

#: What stands where something else should: beyond doubles, of the wrong kind, of the wrong unit, of TOML itself.
TOKENS = (
    *("1e400", "-1e308", "1e-320", "nan", "-inf", "0", "-1", "1_0", "99999999999999999999", "true", '""', '"\\u0000"'),
    *('"1 parsec"', '"-3 mm"', '"5 %"', '"1 MPa^-2 s"', '"..."', "[]", "[[]]", "{}", "[1, 2, 3]", '["a"]', "{a = 1}"),
    *("1979-05-27T07:32:00Z", "0x7fffffffffffffff", "'/dev/zero'", "'/'", "'.'", '"$$"', '"\\u001b[2J"', "2", "1e-9"),
)


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


def attempt(read, seconds, what):
    """What is read, None if it is refused, and the message; any other end is a fault of the program."""
    try:
        with within(seconds), warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            return read(), ""
    except RoughviscError as error:
        return None, str(error)
    except BaseException as error:
        raise AssertionError(f"{what}: {type(error).__name__}: {error}") from error


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


def damaged_study(rng, text):
    """A study with values, keys or lines exchanged, lost or doubled."""
    lines = text.splitlines()
    for _ in range(rng.integers(1, 3)):
        at = int(rng.integers(len(lines)))
        kind = rng.integers(9)
        if kind >= 6:  # another size of something
            factor = 10.0 ** rng.integers(-6, 7) * rng.choice([1, 1, 1, -1])
            if number := re.search(r"(?<![\w.])\d+(\.\d+)?", lines[at]):
                scaled = f"{float(number[0]) * factor:.6g}"
                lines[at] = lines[at][: number.start()] + scaled + lines[at][number.end() :]
        elif kind <= 1 and "=" in lines[at]:
            lines[at] = f"{lines[at].split('=')[0]}= {TOKENS[rng.integers(len(TOKENS))]}"
        elif kind == 3:
            lines.insert(at, lines[int(rng.integers(len(lines)))])
        elif kind == 4 and len(lines) > 1:
            del lines[at]
        else:
            raw = lines[at].encode() or b" "
            lines[at] = damaged_bytes(rng, raw).decode("latin-1")
    return "\n".join(lines)
