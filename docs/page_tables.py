"""Tables of pages that come from the package.

``python docs/page_tables.py`` rewrites them in place, in all pages, and prints the pages that have changed. A line
``<!-- table "variables" -->`` in a page stands above each table; a new table needs this line only.
"""

import inspect
import re
from functools import partial
from pathlib import Path

import study_keys

import roughvisc as rv
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


#: Arguments of functions of cases and results -> their meaning, the same in all functions.
ARGUMENTS = {
    ("tolerance", "boundary", "grid_error", "numerics", "fields"): "settings of the solve",
    ("times", "missing", "edge", "adhesion"): "settings of the solve under a program",
    ("case",): "a case, or its study file",
    ("cases",): "cases, or their study file",
    ("out",): "folder of the results",
    ("path",): "a file that is read or written",
    ("workers",): "number of processes; 0: this process",
    ("client",): "client of a Dask cluster",
    ("threads",): "threads of one case on a large grid",
    ("progress",): "a progress bar",
}


def functions_of_cases():
    """Return the public functions of cases and results by name."""
    functions = [rv.Case, rv.simulate, rv.friction, rv.vary, rv.read_study, rv.read_cases, rv.run]
    functions += [rv.sweep, rv.plan, rv.trade, rv.budget, rv.audit, rv.observe, rv.save_result]
    functions += [rv.open_result, rv.open_results, rv.to_table, rv.to_csv, rv.report]
    return {one.__name__: one for one in functions} | {"plot.page": rv.plot.page}


def arguments():
    """Return the table of arguments that several functions have, with the functions."""
    functions = functions_of_cases().items()
    known = {name: inspect.signature(one).parameters for name, one in functions}
    lines = ["| argument | meaning | functions |", "|---|---|---|"]
    for names, meaning in ARGUMENTS.items():
        sharing = [", ".join(f"`{one}`" for one in known if name in known[one]) for name in names]
        assert len(set(sharing)) == 1, f"{names} are not arguments of the same functions"
        also = [
            one
            for one, taken in known.items()
            if names == ("progress",) and "Progress" in str(taken.get("progress"))
        ]
        if also:
            meaning += f"; in {', '.join(f'`{one}`' for one in also)} also a function of the "
            meaning += "progress and its end"
        lines.append(f"| {', '.join(f'`{one}`' for one in names)} | {meaning} | {sharing[0]} |")
    return "\n".join(lines)


#: Name of a table -> function that returns it.
TABLES = {
    "arguments": arguments,
    "variables": variables,
    "limits": limits,
    "orientations": orientations,
    **{name: partial(study_keys.table, name) for name in study_keys.TABLES},
}
#: The line above a table, and the table.
MARK = re.compile(r'^<!-- table "(.+)" -->\n(\n\|.*(?:\n\|.*)*\n)?', re.M)


def filled(page):
    """Return the text of a page with the present tables of the package."""
    return MARK.sub(lambda mark: f'<!-- table "{mark[1]}" -->\n\n{TABLES[mark[1]]()}\n', page)


def pages():
    """Return the path of each page in Markdown."""
    root = Path(__file__).parent
    return [
        path
        for path in sorted(root.rglob("*.md"))
        if not {"_build", "generated"} & set(path.relative_to(root).parts)
    ]


if __name__ == "__main__":
    for path in pages():
        before = path.read_text(encoding="utf-8")
        after = filled(before)
        if after != before:
            path.write_text(after, encoding="utf-8")
            print(path)
