"""Small tables of HTML, by which objects show themselves in a notebook."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

_LEFT = ' style="text-align: left"'


def table(title: str, rows: Sequence[Sequence[str]]) -> str:
    """A table with a title; the first entry of each row says what the others are.

    Parameters
    ----------
    title : str
        What is shown.
    rows : sequence of sequence of str
        Texts; what they hold of HTML is shown and not obeyed.

    Examples
    --------
    >>> table("zener", [("shear_modulus", "3 MPa")]).count("<tr>")
    1
    """
    lines = [
        f"<tr><th{_LEFT}>{escape(first)}</th>{''.join(f'<td{_LEFT}>{escape(one)}</td>' for one in others)}</tr>"
        for first, *others in rows
    ]
    return f"<table><caption{_LEFT}><b>{escape(title)}</b></caption>{''.join(lines)}</table>"
