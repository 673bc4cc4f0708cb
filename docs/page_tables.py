"""Tables of pages that come from the package, when the pages are built.

``python docs/page_tables.py variables`` prints a table. In a page a table is a line with this command.
"""

import re
import sys

from roughvisc.judge.audit import LIMITS
from roughvisc.topography.formats import STATED, TAKEN, TOP_FIRST
from roughvisc.variables import STATUS_MEANINGS, STEP, VARIABLES


def variables():
    """Return the table of all variables of results and observables."""
    lines = ["| variable | over | unit | meaning |", "|---|---|---|---|"]
    for name, one in VARIABLES.items():
        steps = "steps" if one.is_of_steps else "rows and steps"
        over = [steps if dim == STEP else f"{dim}s" if dim == "row" else dim for dim in one.dims]
        meaning = one.long_name + (f"; {one.remarks}" if one.remarks else "")
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


def orientations():
    """Return the table of the direction of y in each format of scans, with the evidence."""
    lines = ["| format | first line of the file | evidence |", "|---|---|---|"]
    for first, formats in (("top", TOP_FIRST), ("stated by the file", STATED)):
        for evidence in dict.fromkeys(formats.values()):
            names = ", ".join(f"`{name}`" for name, text in formats.items() if text == evidence)
            lines.append(f"| {names} | {first} | {evidence} |")
    return "\n".join([*lines, f"| all others | y = 0 | {TAKEN} |"])


#: Line of a page in place of a table, and the functions that return the tables.
MARK = re.compile(r"^`python docs/page_tables\.py (\w+)` prints this table\.$", re.M)
TABLES = {"variables": variables, "limits": limits, "orientations": orientations}


def filled(page):
    """Return the text of a page with its tables."""
    return MARK.sub(lambda found: TABLES[found[1]](), page)


if __name__ == "__main__":
    print(TABLES[sys.argv[1]]())
