"""The table of an audit on the command line."""

from __future__ import annotations

from rich.console import Group
from rich.table import Table
from rich.text import Text

from roughvisc.errors import printable
from roughvisc.study.audit.audit import Audit
from roughvisc.study.audit.limits import BROKEN, DOUBTFUL, NOT_KNOWN

#: The words tell the verdicts apart; weight and colour help to find them.
_STYLES = {BROKEN: "bold red", DOUBTFUL: "bold", NOT_KNOWN: "dim"}


def audit_table(audit: Audit) -> Group:
    """What was found, a row an assumption.

    Parameters
    ----------
    audit : Audit
        Of :func:`roughvisc.audit`.
    """
    table = Table(box=None, pad_edge=False)
    for heading in ("assumption", "verdict"):
        table.add_column(heading, no_wrap=True)
    table.add_column("number", justify="right", no_wrap=True)
    table.add_column("", overflow="fold")
    for one in audit:
        verdict = Text(one.verdict, style=_STYLES.get(one.verdict, ""))
        table.add_row(one.name, verdict, one.shown, Text(one.sentence))
    return Group(Text(printable(audit.title or "untitled"), style="bold"), table)
