"""What users see, in two checkouts: public names with their signatures, study keys, variables, figures, commands.

    python workflows/benchmarks/public_names.py OTHER_CHECKOUT

Prints what is new here, what is gone, and what has changed. Each checkout is asked in a process of its own.
"""

import inspect
import json
import os
import subprocess
import sys
import warnings
from pathlib import Path


def seen():
    """Kind -> name -> what is said of it."""
    warnings.simplefilter("ignore")
    import roughvisc as rv
    from roughvisc import errors
    from roughvisc.cli.group import main
    from roughvisc.study.cost.plan import COLUMNS
    from roughvisc.variables import VARIABLES
    from roughvisc.variables.sliding import SLIDING
    from roughvisc.views.plot import FIGURES

    def said(one):
        plain = callable(one) and not inspect.isclass(one)
        return str(inspect.signature(one)) if plain else type(one).__name__

    public = {name: said(getattr(rv, name)) for name in rv.__all__ if name != "__version__"}
    for room in (rv.plot, rv.observables, rv.closed_forms):
        public |= {f"{room.__name__}.{name}": said(getattr(room, name)) for name in room.__all__}
    schema = rv.study_schema()
    tables = {"study": schema, **schema["$defs"]}
    keys = {
        f"{table}.{key}": str(one.get("default")) for table, t in tables.items() for key, one in t["properties"].items()
    }
    commands = {
        f"{name} {option}": "" for name, one in main.commands.items() for part in one.params for option in part.opts
    }
    return {
        "public names": public,
        "study keys": keys,
        "variables": {name: f"{one.dims} {one.units} {one.group}" for name, one in VARIABLES.items()},
        "variables over speed": {name: f"{one.dims} {one.units} {one.group}" for name, one in SLIDING.items()},
        "figures of a result": dict.fromkeys(FIGURES, ""),
        "commands and options": commands,
        "errors": {name: "" for name in dir(errors) if name.endswith("Error")},
        "columns of a plan": {name: str(said) for name, said in COLUMNS.items()},
    }


def asked(checkout):
    command = [sys.executable, __file__, "--of-this"]
    environment = os.environ | {"PYTHONPATH": str(checkout)}
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True, env=environment).stdout)


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
