"""Scans in text on the same numbers: encodings, separators, decimal marks. Right, or refused by name."""

import numpy as np
import pytest
from support import ENCODINGS

import roughvisc as rv
from roughvisc.errors import InputError
from roughvisc.topography.grid import spacing

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


POINTS = [(f"{0.5 * i:.2f}", f"{1.5 * j:.2f}", z) for j, line in enumerate(HEIGHTS) for i, z in enumerate(line)]
SCAN = 1e-6 * np.array(HEIGHTS, float).T  # [m]
#: suffix, rows, and what the file does not state
READERS = [(suffix, HEIGHTS, {"unit": "um", "spacing": 1e-6}) for suffix in ("csv", "txt", "asc", "dat")]
READERS += [(suffix, POINTS, {"unit": "mm", "height_scale": 1e-3}) for suffix in ("csv", "txt", "xyz")]


@pytest.mark.parametrize(("suffix", "rows", "options"), READERS)
def test_text__is_read_right_in_every_encoding_or_refused_by_name(suffix, rows, options, tmp_path):
    path = tmp_path / f"numbers.{suffix}"
    for separator, mark in STYLES:
        text = written(rows, separator, mark)
        for name, encode in WRITTEN.items():
            path.write_bytes(encode(text))
            found = rv.open_scan(path, **options)
            np.testing.assert_allclose(spacing(found), options.get("spacing", (5e-4, 1.5e-3)), rtol=1e-12)
            np.testing.assert_allclose(found, SCAN, rtol=1e-12, err_msg=f"{separator!r} {mark} {name}")
        path.write_bytes(text.encode("utf-16-le"))  # without its mark
        with pytest.raises(InputError, match=r"numbers\.\w+: .*zero bytes"):
            rv.open_scan(path, **options)
