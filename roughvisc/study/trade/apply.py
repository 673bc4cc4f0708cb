"""Writes settings back into a study file, keeping its comments and layout."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.container import Container
from tomlkit.exceptions import TOMLKitError
from tomlkit.items import Float, Table, Trivia

from roughvisc.errors import InputError
from roughvisc.settings import Settings
from roughvisc.study.statement.case import read_cases
from roughvisc.study.storage.files import atomic_write
from roughvisc.study.trade.ladder import format_tolerance

#: What keys are that a study does not state, where they are to be as if it did not.
_USUAL = {"time_step": Settings.time_step, "method": Settings.method, "memory": Settings.memory}


def apply(path: str | Path, tables: Mapping[str, Mapping[str, Any]]) -> str:
    """Set keys of a study file, by a temporary file and a rename.

    Parameters
    ----------
    path : path
        The study file.
    tables : mapping
        Table -> key -> value; None: the key's usual value, not written where the file does not state it.

    Returns
    -------
    str
        What has changed, as ``solve.tolerance = 3e-2``; empty if nothing has.

    Raises
    ------
    InputError
        If the file cannot be read, or would be no study any more; it is then as it was.
    """
    path = Path(path).resolve()  # a link stays one
    try:
        document = tomlkit.parse(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error
    except (TOMLKitError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: is not valid TOML: {error}") from error
    done = [
        f"{name}.{key} = {value}"
        for name, keys in tables.items()
        for key, value in ((key, _set(document, name, key, value)) for key, value in keys.items())
        if value
    ]
    if done:
        with atomic_write(path) as temporary:
            temporary.write_text(tomlkit.dumps(document), encoding="utf-8")
            try:
                read_cases(temporary)
            except InputError as error:
                raise InputError(str(error).replace(str(temporary), str(path))) from error
            shutil.copymode(path, temporary)
    return ", ".join(done)


def _set(document: Any, name: str, key: str, value: Any) -> str:
    """Set one key; what it is now, if that is something else than before."""
    table = document.get(name)
    if table is None:
        if value is None:
            return ""
        text = tomlkit.dumps(document)
        for _ in range(0 if not text or text.endswith("\n\n") else 1 if text.endswith("\n") else 2):
            document.add(tomlkit.nl())
        document.add(name, tomlkit.table())
        table = document[name]
    if value is None:
        if key not in table or table[key] == _USUAL[key]:
            return ""
        value = _USUAL[key]
    if key in table:
        if table[key] == value:
            return ""
        table[key] = _item(value)
    else:
        _append(table, key, _item(value))
    return str(table[key].as_string())


def _item(value: Any) -> Any:
    if isinstance(value, float):
        return Float(
            value,
            Trivia(),
            format_tolerance(value) if value < 0.1 and float(format_tolerance(value)) == value else f"{value:.12g}",
        )
    return tomlkit.item(value)


def _append(table: Any, key: str, value: Any) -> None:
    """A further key after the last one, not after the blank lines below it."""
    body = table.value.body if isinstance(table, Table) and isinstance(table.value, Container) else []
    keys = [n for n, (name, _) in enumerate(body) if name is not None]
    # tomlkit has no public way; should this one go, the key comes below the blank lines
    if keys and keys[-1] + 1 < len(body) and hasattr(table.value, "_insert_at"):
        table.value._insert_at(keys[-1] + 1, tomlkit.key(key), value)
    else:
        table.append(key, value)
