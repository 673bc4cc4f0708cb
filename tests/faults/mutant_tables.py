"""Tables that are changed: the columns served are held against a parse in the dialect that the table was made in."""

import csv
import json
import re
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from damage import damaged_bytes
from outcome import Outcome, byte_change, compared, opened, text_change
from stated_units import UnknownUnit, unit_said

from roughvisc.study.statement.case import read_study
from roughvisc.tables import Wanted, read_table


@dataclass(frozen=True)
class Table:
    """A table as it was made.

    Attributes
    ----------
    raw : bytes
        Its content.
    columns : dict
        Name in the heading -> SI unit, of those that are read.
    separator, mark : str
        Between cells, a blank for any blanks; in numbers.
    style : str
        Where units stand: "none" (no heading), "brackets", "slash", "in", "below".
    sheet : bool
        Whether it is read as a test machine's, heading sought, or as columns, heading first.
    """

    raw: bytes
    columns: dict[str, str]
    separator: str
    mark: str
    style: str
    sheet: bool


def _rows(columns, separator, mark, digits=6):
    lines = []
    for row in zip(*columns, strict=True):
        lines.append(separator.join(f"{value:.{digits}g}".replace(".", mark) for value in row))
    return "\n".join(lines) + "\n"


_TIMES = np.round(np.geomspace(0.01, 250, 14), 4)
_MODULI = np.round(1.2 + 2.7 / (1 + _TIMES), 4)
_SECONDS, _FORCES = 0.1 * np.arange(18), 1250.5 * np.sin(0.1 * np.arange(18)) ** 2
_TRAVEL = 0.01 + 0.0215 * np.arange(18)
TABLES = {
    "commas": Table(("# from a rheometer\ntime [s], modulus [MPa]\n" + _rows([_TIMES, _MODULI], ", ", ".")).encode(),
                    {"time": "s", "modulus": "Pa"}, ",", ".", "brackets", False),
    "semicolons": Table(("time [ms];modulus [kPa]\n" + _rows([_TIMES * 1e3, _MODULI * 1e3], ";", ",")).encode(),
                        {"time": "s", "modulus": "Pa"}, ";", ",", "brackets", False),
    "tabs in UTF-16": Table(("time [s]\tload [mN]\r\n" + _rows([_SECONDS, _FORCES], "\t", ".")).encode("utf-16"),
                            {"time": "s", "load": "N"}, "\t", ".", "brackets", False),
    "no heading": Table(_rows([_SECONDS, _FORCES * 1e-3], ",", ".").encode(),
                        {"time": "s", "load": "N"}, ",", ".", "none", False),
    "third column": Table(("frequency; storage [MPa]; loss [MPa]\n"
                           + _rows([_TIMES, _MODULI, 0.3 * _MODULI], "; ", ".")).encode("utf-8-sig"),
                          {"frequency": "", "storage": "Pa", "loss": "Pa"}, ";", ".", "brackets", False),
    "machine, units below": Table(
        ('"Prüfbericht";"17"\n"Probe";"A, 3,5 mm"\n\n"Prüfzeit";"Standardkraft";"Standardweg"\n"s";"N";"mm"\n'
         + _rows([_SECONDS, _FORCES, _TRAVEL], ";", ",")).encode("cp1252"),
        {"Prüfzeit": "s", "Standardkraft": "N", "Standardweg": "m"}, ";", ",", "below", True),
    "machine, slashes": Table(("Operator: A\n\nTime/s\tForce/mN\tTravel/um\n"
                               + _rows([_SECONDS, _FORCES, _TRAVEL], "\t", ".")).encode(),
                              {"Time": "s", "Force": "N"}, "\t", ".", "slash", True),
    "machine, blanks": Table(("% made by hand\nTime[s] Force[mN] n\n"
                              + _rows([_SECONDS, _FORCES, np.arange(18)], "   ", ".")).encode(),
                             {"Time": "s", "Force": "N"}, " ", ".", "brackets", True),
    "machine, commas": Table(("Time in ms,Force in N,n\n" + _rows([_SECONDS * 1e3, _FORCES, np.arange(18)], ",", "."))
                             .encode("utf-8-sig").replace(b"\n", b"\r\n"),
                             {"Time": "s", "Force": "N"}, ",", ".", "in", True),
}  # fmt: skip


def prepare(folder):
    """The originals, and what they are read as; their own parse has to give the same."""
    originals = {}
    for name, table in TABLES.items():
        path = folder / "table.csv"
        path.write_bytes(table.raw)
        served = reader(table, path)()
        assert not unsaid(table, table.raw, served), name
        originals[name] = table, served
    return originals


#: Columns -> the part of a study that names the file, and where the case has its columns.
_STUDIES = {
    ("time", "modulus"): ('[material]\nmodel = "relaxation_table"\nfile = "{}"\n[[program]]\nload = 1\nover = 1\n',
                          lambda case: (case["material"]["times"], case["material"]["moduli"])),
    ("frequency", "storage", "loss"): (
        '[material]\nmodel = "dynamic"\nfrequency_unit = "Hz"\nfile = "{}"\n[[program]]\nload = 1\nover = 1\n',
        lambda case: [case["material"][name] for name in ("frequencies", "storage", "loss")]),
    ("time", "load"): ('[material]\nmodel = "elastic"\nshear_modulus = 1e6\n[[program]]\ntable = "{}"\n',
                       lambda case: [case["program"][0]["table"][name] for name in ("times", "values")]),
}  # fmt: skip
_SURFACE = '[surface]\ngenerate = "sphere"\nradius = 1e-3\nsize = 1e-4\nshape = 8\n'


def reader(table: Table, path, by_study=False) -> Callable:
    """What reads a table, as columns in SI by name: a function, or a study that names it."""
    if by_study:
        text, columns = _STUDIES[tuple(table.columns)]
        study = path.with_suffix(".toml")
        study.write_text(_SURFACE + text.format(path.name))
        return lambda: dict(zip(table.columns, columns(json.loads(read_study(study).to_json())), strict=True))
    wanted = {name: Wanted(name, unit) for name, unit in table.columns.items()}
    return lambda: {name: list(column) for name, column in read_table(path, wanted, exported=table.sheet)[0].items()}


def examine(originals, folder, number, rng):
    name = list(originals)[rng.integers(len(originals))]
    table, before = originals[name]
    if rng.random() < 0.4:
        raw = damaged_bytes(rng, table.raw)
        change = byte_change(table.raw, raw)
    else:
        text, encoding = _decoded(table.raw)
        slip = _SLIPS[rng.integers(len(_SLIPS))]
        slipped = slip(rng, text, table)
        if slip is _other_mark_everywhere and slipped != text:
            table = replace(table, mark=_other(table))
        raw = slipped.encode(encoding, errors="replace")
        if rng.integers(12) == 0:
            raw = slipped.encode(("utf-16", "utf-8-sig", "utf-16-le", "utf-8")[rng.integers(4)])
        change = text_change(text, slipped) or byte_change(table.raw, raw)
    path = folder / f"table{number}.csv"
    path.write_bytes(raw)
    outcome = Outcome(number, name, change)
    by_study = not table.sheet and rng.random() < 0.5
    read = reader(table, path, by_study)
    served = opened(outcome, read, path, lambda message: names_place(message, table, by_study))
    if served is not None:
        compared(outcome, differences(before, served), unsaid(table, raw, served))
    path.unlink()
    path.with_suffix(".toml").unlink(missing_ok=True)
    return outcome


def differences(before, after):
    """Column and row, value before and after."""
    found = []
    for name, one in before.items():
        other = after[name]
        if len(one) != len(other):
            found.append(f"{name}: {len(one)} rows -> {len(other)}")
        changed = [i for i, (a, b) in enumerate(zip(one, other, strict=False)) if a != b]
        if len(changed) > 3:
            found.append(
                f"{name}: {len(changed)} values, row {changed[0]}: {one[changed[0]]:g} -> {other[changed[0]]:g}"
            )
        else:
            found += [f"{name}, row {i}: {one[i]:g} -> {other[i]:g}" for i in changed]
    return found


def names_place(message, table, by_study=False):
    """Whether a refusal names a line, a column or what is missing; and the key, where a study names the file."""
    if by_study and not re.search(r"\.toml: (2 problems\n\s*)?(material\.file|program\.0\.table): ", message):
        return False
    message = message.casefold()
    names = map(str.casefold, table.columns)
    wanted = [word for name in names for word in (f"unit of {name}", f"{name} = ", f"column '{name}")]
    holds = r"lines? \d+|table row \d+|table (has|starts|ends)|holds no rows|has columns|cannot be read as"
    holds += r"|expected one decimal mark|expected a decimal point"
    return bool(re.search(holds, message)) or any(word in message for word in wanted)


# ----------------------------------------------------------------------------------------------------------------
# what the table says


def _decoded(raw):
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return raw.decode("utf-16"), "utf-16"
    for encoding in ("utf-8-sig", "cp1252"):
        try:
            return raw.decode(encoding), encoding if encoding == "cp1252" or raw[:3] == b"\xef\xbb\xbf" else "utf-8"
        except UnicodeDecodeError:
            continue
    return raw.decode("latin-1"), "latin-1"


def unsaid(table, raw, served):
    """Where what was served is not what the table says, read as it was made."""
    try:
        try:
            said = parsed(table, raw)
        except ValueError:
            if table.separator != "\t":
                raise
            said = parsed(replace(table, separator=" "), raw)  # tabs are blanks too
    except UnknownUnit as unit:
        return [f"not judged, for the unit {unit}"]
    except (ValueError, LookupError, csv.Error, StopIteration) as error:
        return [f"served although it cannot be read as it was made: {error!r}"]
    found = []
    for name, column in said.items():
        if len(column) != len(served[name]):
            found.append(f"{name}: {len(served[name])} rows served, {len(column)} said")
        elif not np.allclose(column, served[name], rtol=1e-13, atol=0):
            row = int(np.argmax(~np.isclose(column, served[name], rtol=1e-13, atol=0)))
            found.append(f"{name}, row {row}: {served[name][row]!r} served, {column[row]!r} said")
    return found


def parsed(table, raw):
    """Columns as the dialect has them in which the table was made."""
    text = _decoded(raw)[0]
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    if table.separator == " ":
        rows = [line.split() for line in lines]
    else:
        # line by line: a quotation mark that is not closed is no reason to lose the lines that follow
        rows = [next(csv.reader([line], delimiter=table.separator, skipinitialspace=True)) for line in lines]
    names = list(table.columns)
    first, places, factors = 0, list(range(len(names))), [1.0] * len(names)
    headed = table.style != "none" and (table.sheet or not re.match(r"\s*[\d.,+-]", rows[0][0]))
    if headed:  # of columns without a heading the documentation says that they are in SI, in order
        first = next(i for i, row in enumerate(rows) if all(any(_is(cell, name) for cell in row) for name in names))
        places = [[_is(cell, name) for cell in rows[first]].index(True) for name in names]
        cells = rows[first + 1] if table.style == "below" else rows[first]
        factors = [_size(cells[place], table.style) for place in places]
        first += 1 + (table.style == "below")
    return {
        name: [_number(row[place], table.mark) * factor for row in rows[first:]]
        for name, place, factor in zip(names, places, factors, strict=True)
    }


def _is(cell, name):
    return re.split(r"\s*[\[(/]|\s+in\s", cell.strip())[0].strip().casefold() == name.casefold()


def _size(cell, style):
    pattern = {"brackets": r"[\[(](.*)[\])]", "slash": r"/(.*)", "in": r"\sin\s(.*)", "below": r"(.*)"}[style]
    unit = re.search(pattern, cell)
    return unit_said(unit[1].strip("[]() "))[0] if unit else 1.0


def _number(cell, mark):
    """A number whose digits may be grouped by the other mark, a blank or an apostrophe."""
    whole, _, fraction = cell.strip().partition(mark)
    grouping = ",' \u00a0\u202f" if mark == "." else ".' \u00a0\u202f"
    return float(f"{whole.translate(str.maketrans('', '', grouping))}.{fraction}" if fraction else
                 whole.translate(str.maketrans("", "", grouping)))  # fmt: skip


# ----------------------------------------------------------------------------------------------------------------
# slips of the hand, and of programs that export


def _cell(make):
    """A slip in one cell of one line."""

    def slip(rng, text, table):
        lines = text.splitlines()
        places = [i for i, line in enumerate(lines) if len(_cells(line, table)) > 1]
        at = places[rng.integers(len(places))]
        cells = _cells(lines[at], table)
        which = int(rng.integers(len(cells)))
        cells[which] = make(rng, cells[which], table)
        lines[at] = _joined(cells, table)
        return "\n".join(lines) + "\n"

    return slip


def _cells(line, table):
    return line.split() if table.separator == " " else line.split(table.separator)


def _joined(cells, table):
    return ("   " if table.separator == " " else table.separator).join(cells)


def _line(make):
    """A slip in one line."""

    def slip(rng, text, table):
        lines = text.splitlines()
        at = int(rng.integers(len(lines)))
        lines[at : at + 1] = make(rng, lines[at], table)
        return "\n".join(lines) + "\n"

    return slip


def _pick(rng, *choices):
    return choices[rng.integers(len(choices))]


def _digit(rng, cell, table):
    found = [i for i, sign in enumerate(cell) if sign.isdigit()]
    if not found:
        return cell
    at = found[rng.integers(len(found))]
    return cell[:at] + _pick(rng, "0", "3", "7", "9", "", "55", "1.", "2,") + cell[at + 1 :]


def _unit(rng, text, table):
    found = list(re.finditer(r"(?<=[\[/\"])(s|ms|mN|N|kPa|MPa|mm|um)(?=[\]\s\"])|(?<= in )(ms|N)", text))
    at = found[rng.integers(len(found))] if found else None
    unit = _pick(rng, "ms", "s", "h", "min", "N", "kN", "MN", "mN", "Pa", "GPa", "mm", "µm", "", "inch", "%", "us")
    return text[: at.start()] + unit + text[at.end() :] if at else text


def _other(table):
    return "," if table.mark == "." else "."


def _other_mark(rng, line, table):
    return re.sub(rf"(?<=\d){re.escape(table.mark)}(?=\d)", _other(table), line)


def _other_mark_everywhere(rng, text, table):
    if table.separator == _other(table):  # which nobody could tell apart
        return text
    return _other_mark(rng, text, table)


def _cut(rng, text, table):
    return text[: rng.integers(1, len(text))]


_SLIPS = (
    *[_cell(_digit)] * 4,
    _cell(lambda rng, cell, table: _pick(rng, "", "-", "nan", "inf", "1e400", "#N/A", "n/a", "0x10", "1_000", "true")),
    _cell(lambda rng, cell, table: _pick(rng, "−", "-", "+", "'", '"', " ", "€", "\u00a0", "\x00", "=") + cell),
    _cell(
        lambda rng, cell, table: cell + _pick(rng, '"', "'", " s", "\u00a0", ".", ",", "e", "e5", "E-3", " 000", "*")
    ),
    _cell(lambda rng, cell, table: f'"{cell}"'),
    _cell(lambda rng, cell, table: cell.translate(str.maketrans(".,", ",."))),
    _cell(
        lambda rng, cell, table: _pick(rng, "1.250", "1,250", "1 250", "1'250", "1.250,5", "1,250.5", "12.50", "0,5")
    ),
    _cell(lambda rng, cell, table: cell + _pick(rng, ";", ",", "\t", " ") + cell),
    _line(lambda rng, line, table: []),
    _line(lambda rng, line, table: [line, line]),
    _line(lambda rng, line, table: [_pick(rng, "#", "# ", "%", "//", " #") + line]),
    _line(lambda rng, line, table: [line[: len(line) // 2]]),
    _line(lambda rng, line, table: [line, _pick(rng, "", " ", "#", ";;", ",,", "\t\t", "end of data", "Mean;1;2")]),
    _line(lambda rng, line, table: [line.replace(table.separator, _pick(rng, ";", ",", "\t", "|", "  "))]),
    _line(lambda rng, line, table: [_joined(_cells(line, table)[::-1], table)]),
    _line(lambda rng, line, table: [line.upper()]),
    _line(lambda rng, line, table: [f"{line}{_pick(rng, ';', ',', chr(9), ' ', chr(11), chr(0x85))}"]),
    *[_unit] * 2,
    _line(lambda rng, line, table: [_other_mark(rng, line, table)]),
    _other_mark_everywhere,
    _cut,
)
