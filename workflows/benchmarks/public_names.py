"""What users see, in two checkouts: public names with their signatures, study keys, variables, figures, commands.

    python workflows/benchmarks/public_names.py OTHER_CHECKOUT

Prints how many there are, what is new here, what is gone, and what has changed. Each checkout runs in a process of its
own. A kind that one of them lacks counts as empty.
"""

import importlib
import inspect
import json
import os
import subprocess
import sys
import warnings
from pathlib import Path


def public_names():
    import roughvisc as rv

    found = {}
    for prefix, module in (
        ("rv", rv),
        *((f"rv.{one}", getattr(rv, one)) for one in ("plot", "observables", "closed_forms")),
    ):
        for name in set(module.__all__) - {"__version__"}:
            one = getattr(module, name)
            plain = callable(one) and not inspect.isclass(one)
            found[f"{prefix}.{name}"] = str(inspect.signature(one)) if plain else type(one).__name__
    return found


def study_keys():
    import roughvisc as rv

    sys.path.insert(0, str(Path(rv.__file__).parents[1] / "docs"))
    from study_keys import TABLES, rows

    return {f"{name}.{row[0]}": "" for name in TABLES for row in rows(name)}


def variables():
    tables = (
        declared("roughvisc.variables", "VARIABLES"),
        declared("roughvisc.variables.sliding", "SLIDING"),  # of the first edition
        declared("roughvisc.judge.trade.trade", "VARIABLES"),  # of the first edition
    )
    return {
        name: f"{one.dims} {one.units} {getattr(one, 'group', '')}".strip()
        for table in tables
        for name, one in table.items()
    }


def commands():
    from roughvisc.cli.group import main

    return {
        f"{name} {option}": "" for name, one in main.commands.items() for part in one.params for option in part.opts
    }


def errors():
    from roughvisc import errors

    return {name: "" for name in dir(errors) if name.endswith("Error")}


def declared(module, table):
    """A table of a module; empty if this checkout lacks one of them."""
    try:
        return getattr(importlib.import_module(module), table)
    except (ImportError, AttributeError):
        return {}


KINDS = {
    "public names": public_names,
    "study keys": study_keys,
    "variables": variables,
    "commands and options": commands,
    "commands": lambda: {name.split()[0]: "" for name in commands()},
    "figures of a result": lambda: dict.fromkeys(declared("roughvisc.plot.save", "FIGURES"), ""),
    "errors": errors,
    **{
        f"columns of a {name}": lambda name=name: {
            column: str(one) for column, one in declared(f"roughvisc.study.{name}", "COLUMNS").items()
        }
        for name in ("plan", "trade")
    },
}


def seen():
    """Kind -> name -> signature, default or unit."""
    warnings.simplefilter("ignore")
    found = {}
    for kind, collect in KINDS.items():
        try:
            found[kind] = collect()
        except (ImportError, AttributeError) as error:
            print(f"{kind}: {error}", file=sys.stderr)
            found[kind] = {}
    return found


def asked(checkout):
    command = [sys.executable, __file__, "--of-this"]
    environment = os.environ | {"PYTHONPATH": str(checkout)}
    return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, env=environment).stdout)


if __name__ == "__main__":
    if sys.argv[1:] == ["--of-this"]:
        print(json.dumps(seen()))
        sys.exit()
    before, now = asked(Path(sys.argv[1]).absolute()), asked(Path(__file__).parents[2])
    for kind in now:
        there, here = before[kind], now[kind]
        print(f"{kind}: {len(there)} -> {len(here)}")
        for name in sorted({*there, *here}):
            if name not in there:
                print(f"    new: {name}")
            elif name not in here:
                print(f"    gone: {name}")
            elif there[name] != here[name]:
                print(f"    changed: {name}\n        {there[name]}\n        {here[name]}")
