"""Tables of pages that come from the package: a mark on a page is replaced by its table when the pages are built."""

from roughvisc.study.audit.checks import LIMITS
from roughvisc.variables import STATUS_MEANINGS, STEP, VARIABLES


def variables():
    """Return the table of all variables of results and observables."""
    lines = ["| variable | over | unit | meaning |", "|---|---|---|---|"]
    for name, one in VARIABLES.items():
        over = [
            "steps" if dim == STEP else f"{dim}s" if dim == "row" else dim for dim in one.dims
        ]
        meaning = one.long_name + (f"; {one.comment}" if one.comment else "")
        if name == "status":
            meaning += ": " + ", ".join(f"{i} {word}" for i, word in enumerate(STATUS_MEANINGS))
        lines.append(f"| `{name}` | {', '.join(over) or '-'} | {one.units or '-'} | {meaning} |")
    return "\n".join(lines)


def limits():
    """Return the table of the limits of an audit, with their meaning and source."""
    lines = [
        "| assumption | number | doubtful, broken from | meaning and source |",
        "|---|---|---|---|",
    ]
    for name, one in LIMITS.items():
        lines.append(
            f"| `{name}` | {one.number} | {one.doubtful:g}, {one.broken:g} | {one.source} |"
        )
    return "\n".join(lines)


#: Mark on a page -> function that returns its table.
TABLES = {"VARIABLES_TABLE": variables, "LIMITS_TABLE": limits}


def filled(page):
    """Return the text of a page with its marks replaced by their tables."""
    for mark, table in TABLES.items():
        if mark in page:
            page = page.replace(mark, table())
    return page
