"""Scans in text on the same numbers: encodings, separators, decimal marks. Right, or refused by name."""

import numpy as np
import pytest
from support import ENCODINGS

import roughvisc as rv
from roughvisc.errors import InputError

#: Numbers that show a lost mark, sign or row; as they are written with a decimal point.
HEIGHTS = [[f"{-0.25 + 1.5 * i + 0.125 * j * j:.3f}" for i in range(5)] for j in range(4)]  # line j, column i
WRITTEN = ENCODINGS | {
    "CRLF": lambda text: text.replace("\n", "\r\n").encode(),
    "empty last line": lambda text: f"{text}\n\n".encode(),
    "no last line break": lambda text: text.rstrip("\n").encode(),
}
#: separator, decimal mark
STYLES = [(",", "."), (";", "."), ("\t", "."), (" ", "."), (";", ","), ("\t", ","), (" ", ","), ('","', ",")]


def written(rows, separator, mark):
    """Rows as text; with a separator that holds quotation marks, each cell between them."""
    quote = '"' if '"' in separator else ""
    return "".join(f"{quote}{separator.join(row).replace('.', mark)}{quote}\n" for row in rows)


def points(_):
    return [(f"{0.5 * i:.2f}", f"{1.5 * j:.2f}", z) for j, line in enumerate(HEIGHTS) for i, z in enumerate(line)]


SCAN = 1e-6 * np.array(HEIGHTS, float).T  # [m]
#: name -> suffix, rows, what reads them, and the numbers that come out
READERS = {
    **{
        f"matrix in {suffix}": (
            suffix,
            lambda _: HEIGHTS,
            lambda path: rv.open_scan(path, unit="um", spacing=1e-6).values,
            SCAN,
        )
        for suffix in ("csv", "txt", "asc", "dat")
    },
    **{
        f"points in {suffix}": (
            suffix,
            points,
            lambda path: rv.open_scan(path, unit="mm", height_unit="um").values,
            SCAN,
        )
        for suffix in ("csv", "txt", "xyz")
    },
}


@pytest.mark.parametrize("reader", READERS)
def test_text__is_read_right_in_every_encoding_or_refused_by_name(reader, tmp_path):
    suffix, rows, read, expected = READERS[reader]
    path = tmp_path / f"numbers.{suffix}"
    for separator, mark in STYLES:
        text = written(rows(separator), separator, mark)
        for name, encode in WRITTEN.items():
            path.write_bytes(encode(text))
            np.testing.assert_allclose(read(path), expected, rtol=1e-12, err_msg=f"{separator!r} {mark} {name}")
        path.write_bytes(text.encode("utf-16-le"))  # without its mark
        with pytest.raises(InputError, match=r"numbers\.\w+: .*zero bytes"):
            read(path)
