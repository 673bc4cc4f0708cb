"""Materials from the exports of test machines: columns by their names, units, one step of several."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from roughvisc.arguments import a_table, located, one_of, refuse_unknown, split
from roughvisc.errors import InputError
from roughvisc.mechanics.materials import MODELS
from roughvisc.mechanics.materials.material import Material
from roughvisc.tables import FREQUENCY_UNITS, Export, Wanted, read_export

#: Columns of the file of each model: name -> argument, and its unit; a frequency is in Hz or rad/s.
COLUMNS: dict[str, dict[str, tuple[str, str]]] = {
    "creep_table": {"time": ("times", "s"), "compliance": ("compliances", "1/Pa")},
    "relaxation_table": {"time": ("times", "s"), "modulus": ("moduli", "Pa")},
    "dynamic_table": {
        "frequency": ("frequencies", ""),
        "storage": ("storage", "Pa"),
        "loss": ("loss", "Pa"),
        "tan_delta": ("tan_delta", "1"),
        "shift_factor": ("shift_factors", "1"),
    },
}
for _columns in COLUMNS.values():
    _columns["temperature"] = ("temperatures", "K")
#: Columns that are read only if their name is stated, and columns that are read if the file contains them.
_IF_STATED = ("temperature", "tan_delta")
_IF_THERE = ("shift_factor",)
#: Keys of a table that describe its file.
FILE = ("file", "columns", "part")


def read_material(
    file: str | Path,
    model: Literal["creep_table", "relaxation_table", "dynamic_table"],
    *,
    columns: Mapping[str, str] | None = None,
    part: str | None = None,
    **arguments: Any,
) -> Material:
    """Read a material from the export of a rheometer or a DMA.

    Parameters
    ----------
    file : path
        Text file as exported: UTF-8, UTF-16 or Windows-1252, any separator and decimal mark, any preamble.
    model : {"creep_table", "relaxation_table", "dynamic_table"}
        Kind of the test; see the functions of these names.
    columns : mapping of str to str, optional
        Name in the file of ``time`` and ``compliance`` or ``modulus``; of ``frequency``, ``storage`` and ``loss``, or
        ``tan_delta`` in its place; of ``temperature`` and ``shift_factor``, if any. A unit that the file lacks is part
        of the name, as ``"f [Hz]"``. Default: these words themselves; ``temperature`` and ``tan_delta`` are only read
        if they are named.
    part : str, optional
        Text of the line above the names of one step, in an export with several.
    **arguments
        Further arguments of the function of the model, such as ``kind``.

    Returns
    -------
    Material
        Its ``note`` states the rows that were left out.

    Raises
    ------
    InputError
        If the file, a column or a unit is missing or ambiguous, or the function of the model refuses the rows; the
        message names the file and the line.

    See Also
    --------
    roughvisc.creep_table, roughvisc.relaxation_table, roughvisc.dynamic_table

    Examples
    --------
    >>> import tempfile
    >>> import roughvisc as rv
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with open(f"{folder}/creep.csv", "w") as file:
    ...         _ = file.write("time [s], J [1/MPa]\\n0.1, 1\\n1, 1.5\\n10, 2\\n")
    ...     rubber = rv.read_material(f"{folder}/creep.csv", "creep_table", columns={"compliance": "J"}, kind="shear")
    >>> bool(abs(rubber.creep_compliance(1.0) - 1.5e-6) < 1e-7)
    True
    """
    one_of("model", model, COLUMNS)
    stated = {"model": model, "file": str(file), "columns": columns, "part": part, **arguments}
    stated = {key: value for key, value in stated.items() if value is not None}
    table = with_columns("", stated)
    try:
        return MODELS[model](**split(table, "model")[1])
    except InputError as error:
        raise with_line(error, stated) from error


def with_columns(where: str, stated: Any) -> dict[str, Any]:
    """Return a table of a material with the columns of its file, without the keys that describe the file."""
    table = a_table(where, stated)
    for key in ("a", "b", "on"):
        if key in table:
            table[key] = with_columns(f"{where}.{key}", table[key])
    model = str(table.get("model"))
    if model not in COLUMNS or "file" not in table:
        for key in ("columns", "part"):
            if model in COLUMNS and key in table:
                raise InputError(key=".".join(filter(None, (where, key))), found=table[key], expected="a file")
        return table
    description, table = split(table, *FILE)
    for argument, _ in COLUMNS[model].values():
        if argument in table:
            key = ".".join(filter(None, (where, "file")))
            raise InputError(key=key, found=description["file"], expected=f"either a file or {argument}")
    try:
        export = _export(description, table)
    except InputError as error:
        key = where if error.key else ".".join(filter(None, (where, "file")))
        raise located(error, key) from error
    return _arguments(model, table, export)


def with_line(error: InputError, stated: Mapping[str, Any]) -> InputError:
    """Return an error about the rows of a table with the file and the line instead of the table and its row."""
    text = str(error)
    file = str(stated["file"])
    if matched := re.search(r"table row (\d+)", text):
        description, table = split(stated, *FILE)
        line = _export(description, table).lines[int(matched[1])]
        text = text.replace(matched[0], f"{file}, line {line}")
    elif file not in text:
        text = f"{file}: {text}"
    return InputError(text, key=error.key, found=error.found, expected=error.expected)


def _export(description: Mapping[str, Any], table: Mapping[str, Any]) -> Export:
    """Return the columns of the file of a table; errors are of the keys `file`, `columns` and `part`."""
    known = COLUMNS[str(table["model"])]
    names = a_table("columns", description.get("columns", {}))
    refuse_unknown("columns", names, known)
    for key, name in names.items():
        if not isinstance(name, str) or not name.strip():
            raise InputError(key=f"columns.{key}", found=name, expected="the name of a column in the file")
    step = description.get("part")
    if step is not None and (not isinstance(step, str) or not step.strip()):
        raise InputError(key="part", found=step, expected="the text of a line above the names of a step")
    if "tan_delta" in names and "loss" in names:
        raise InputError(key="columns.tan_delta", found=names["tan_delta"], expected="either tan_delta or loss")
    wanted = {}
    for key, (_, unit) in known.items():
        if (key in _IF_STATED and key not in names) or (key == "loss" and "tan_delta" in names):
            continue
        wanted[key] = Wanted(names.get(key, key), unit, optional=key in _IF_THERE and key not in names)
    stated_unit = table.get("frequency_unit")
    if stated_unit is not None and "frequency" in wanted:
        one_of("frequency_unit", stated_unit, FREQUENCY_UNITS)
        named = wanted["frequency"]
        if "[" not in named.name and "(" not in named.name:
            wanted["frequency"] = named._replace(name=f"{named.name} [{stated_unit}]")
    return read_export(description["file"], wanted, step)


def _arguments(model: str, table: Mapping[str, Any], export: Export) -> dict[str, Any]:
    """Return a material's table in which the columns of an export replace the name of its file."""
    columns = dict(export.columns)
    if "tan_delta" in columns:
        columns["loss"] = columns["storage"] * columns.pop("tan_delta")
    arguments = {COLUMNS[model][key][0]: values.tolist() for key, values in columns.items()}
    if "frequency" in export.units:
        arguments["frequency_unit"] = export.units["frequency"]
    if export.note:
        arguments["note"] = export.note
    return {**table, **arguments}
