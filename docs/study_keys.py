"""Tables of the keys of study files, from signatures and docstrings.

``python docs/page_tables.py`` writes them into the page ``study-files.md``.
"""

import inspect
import re

import roughvisc as rv
from roughvisc.arguments import arguments, units_of
from roughvisc.experiment.sliding import SteadySliding
from roughvisc.mechanics.materials import MODELS
from roughvisc.mechanics.materials.material import stiffened
from roughvisc.mechanics.program import UNITS, Program
from roughvisc.settings import Numerics, Settings
from roughvisc.study.machine_history import read_history
from roughvisc.study.material_file import COLUMNS
from roughvisc.study.properties import properties
from roughvisc.study.study_file import PROGRAMS, SEGMENTS, SPECTRUM, TABLE_OF, unit_of
from roughvisc.topography.conditioning import FACE_STEPS, STEPS
from roughvisc.topography.recipes import RECIPES, surrogate

HEAD = ("key", "unit", "default", "meaning")
#: Functions whose docstrings describe the arguments of others.
_DESCRIBED_BY = {Settings: rv.simulate, SteadySliding: rv.friction, Numerics: Numerics}
#: Keys that are not arguments of a function: unit, default, meaning.
_FILE = {
    "file": ("", "none", "an exported table, instead of the lists, relative to the study"),
    "columns": ("", "none", "names of the columns in the file, with a unit that it lacks"),
    "part": (
        "",
        "none",
        "text of the line above the names of one step, in an export with several",
    ),
}
_RECIPE = ("", "required", "the recipe: " + ", ".join(f"`{name}`" for name in RECIPES))
_MODEL = ("", "required", "the model: " + ", ".join(f"`{name}`" for name in MODELS))
_CONTROL = ("", "`load`", "quantity of the values: `load`, `approach` or `pressure`")
_EXTRA = {
    "study": {
        "title": ("", "`untitled`", "title of the study and its figures"),
        "surface": ("", "required", "the surface"),
        "material": ("", "required", "the body"),
        "adhesion": ("", "none", "attraction of the surfaces"),
        "program": ("", "none", "list of segments; this or `friction` is required"),
        "friction": ("", "none", "steady sliding"),
        "solve": ("", "none", "how it is computed"),
        "keep": ("", "none", "quantities in the result"),
        "observe": ("", "none", "quantities derived from the result"),
        "audit": ("", "none", "properties for the audit"),
        "sweep": ("", "none", "values that are varied"),
    },
    "surface: a file": {
        "file": (
            "",
            "required",
            "an instrument file, a grid file or a surface card, relative to the study",
        )
    },
    "generate: any": {"generate": _RECIPE},
    "surface.second": {
        "flip": (
            "",
            "`x`",
            "axis along which the second face is reversed when it is turned over: `x`, `y` or `none`",
        )
    },
    "material: any": {"model": _MODEL},
    "friction.speeds": {
        "from": ("m/s", "required", "lowest speed"),
        "to": ("m/s", "required", "highest speed"),
        "count": ("", "required", "number of speeds, evenly spaced on a logarithmic axis"),
    },
    "program: cycle": {"cycle": ("", "required", "a table, see below"), "control": _CONTROL},
    "program: table": {
        "table": (
            "",
            "required",
            "a table, see below",
        ),
        "control": _CONTROL,
    },
    "program.table: a file": {
        "file": ("", "required", "the path of a table of a test machine, relative to the study")
    },
    "observe": {
        "leakage": ("", "none", "leak rate of a fluid through the gap"),
        "conductance": ("", "none", "conductance of the contact spots"),
    },
    **{f"material: {model}": _FILE for model in COLUMNS},
    "generate: spectrum": {
        "file": (
            "",
            "none",
            "a CSV file with the columns `wavevector` and `density`, relative to the study",
        )
    },
}


def _of(function, *names, **renamed):
    """Rows of the arguments of a function: key -> (function, argument)."""
    return {key: (function, key) for key in names} | {
        key: (function, name) for key, name in renamed.items()
    }


def _all(function, *without, skipped=0):
    return _of(function, *(name for name in arguments(function, skipped) if name not in without))


_SETTINGS = [name for name in arguments(Settings) if TABLE_OF.get(name) == "solve"]
_KEPT = [name for name in arguments(Settings) if TABLE_OF.get(name) == "keep"]
#: Table of the page -> place of its keys in a study, and the argument of each key.
TABLES = {
    "study": ("", {}),
    "surface: a file": ("surface", _all(rv.open_scan, skipped=1)),
    "surface: steps of a face": (
        "surface",
        {name: (STEPS[name].function, STEPS[name].argument) for name in FACE_STEPS},
    ),
    "surface: steps of the profile": (
        "surface",
        {
            name: (step.function, step.argument)
            for name, step in STEPS.items()
            if name not in FACE_STEPS
        }
        | _of(Settings, "missing"),
    ),
    "surface.crop": ("surface.crop", _all(rv.crop, skipped=1)),
    "surface.outliers": ("surface.outliers", _all(rv.mask_outliers, skipped=1)),
    "surface.filter": ("surface.filter", _all(rv.gaussian_filter, skipped=1)),
    "surface.second": ("surface.second", _of(rv.combine, "offset")),
    "generate: any": ("surface", _of(rv.sphere, "size", "shape")),
    **{
        f"generate: {name}": ("surface", _all(one, "size", "shape"))
        for name, one in RECIPES.items()
    },
    "material: any": ("material", _of(stiffened, modulus_factor="factor")),
    **{f"material: {name}": ("material", _all(one, "note")) for name, one in MODELS.items()},
    "material: temperature": (
        "material",
        _of(rv.wlf, "temperature", "reference_temperature", "wlf_c1", "wlf_c2")
        | _of(rv.arrhenius, "activation_energy")
        | _of(rv.shift, shift_factor="factor"),
    ),
    "material: thickness": ("material", _of(rv.sheet, "thickness", "base") | _of(rv.layer, "on")),
    "adhesion": ("adhesion", _all(rv.adhesion)),
    **{
        f"program: {kind}": (
            "program.0",
            {kind: (one, next(iter(arguments(one, 1))))} | _of(one, *list(arguments(one, 1))[1:]),
        )
        for kind, one in SEGMENTS.items()
    },
    **{f"program: {kind}": ("program.0", {}) for kind in PROGRAMS},
    "program.cycle": ("program.0.cycle", _all(Program.cycle, "control")),
    "program.table": ("program.0.table", _all(Program.table, "control", "note")),
    "program.table: a file": ("program.0.table", _all(read_history, skipped=1)),
    "friction": ("friction", _all(SteadySliding)),
    "friction.speeds": ("friction.speeds", {}),
    "solve": ("solve", _of(Settings, *_SETTINGS)),
    "keep": ("keep", _of(Settings, *_KEPT)),
    "observe": ("observe", {}),
    "observe.leakage": ("observe.leakage", _all(rv.observables.leakage, skipped=1)),
    "observe.conductance": ("observe.conductance", _all(rv.observables.conductance, skipped=1)),
    "audit": ("audit", _of(rv.audit, *arguments(properties))),
}
#: Units that depend on another key.
_UNITS = {
    **dict.fromkeys(("mean", "amplitude", "values", "zero", "thin"), "N, m or Pa"),
    "frequencies": "Hz or rad/s",
}


def described(function):
    """Meaning of each argument, from the docstring of a function."""
    about = function if function is surrogate else _DESCRIBED_BY.get(function, function)
    section = re.split(r"\n(?=Raises|Returns|Notes|Attributes|Examples)", inspect.getdoc(about))
    found = {}
    for part in section:
        if "Parameters\n---" not in part:
            continue
        body = part.partition("Parameters\n")[2].partition("\n")[2]
        for names, text in re.findall(
            r"^(\S[^\n]*?)(?: : [^\n]*)?\n((?:    [^\n]*\n?|\n)+)", body, re.M
        ):
            for name in names.split(", "):
                found[name.strip("*")] = " ".join(text.split())
    return found


def meaning(function, argument):
    """Return the meaning of an argument in Markdown: its first sentence, and the sentences on its values and default.

    The meaning of a step without an argument is the summary of its function. The reference has the whole docstrings.
    """
    if argument == "time_step":
        function = Numerics
    text = described(function).get(argument, "") if argument else ""
    if not text:
        text = inspect.getdoc(function).partition("\n")[0]
    first, *others = re.split(r"(?<=[.])\s+(?=[A-Z\"`])", text)
    text = " ".join([first, *(one for one in others if re.match(r'"|`|True|False|Default', one))])
    text = re.sub(r":math:`([^`]*)`", r"$\1$", text)
    text = re.sub(r":\w+:`~?([^`]*)`", lambda one: f"`{one[1].rpartition('.')[2]}`", text)
    text = text.replace("``", "`")
    text = re.sub(r"\s*\[[^\[\]]*\](?=[.,;:]?(?:\s|$))", "", text)  # the unit has a column
    return text.removesuffix(".")


def _default(name, function, argument):
    default = arguments(function)[argument][1] if argument else inspect.Parameter.empty
    if name.startswith("surface: steps") and argument != "missing":
        return (
            "not done" if default is inspect.Parameter.empty else f"not done; `true`: `{default}`"
        )
    if name in ("material: any", "material: temperature", "material: thickness"):
        return "none" if default is inspect.Parameter.empty else f"`{default}`"
    if default is inspect.Parameter.empty:
        return "required"
    if default in (None, (), ""):
        return "none"
    if isinstance(default, bool):
        return f"`{str(default).lower()}`"
    shown = list(default) if isinstance(default, tuple) else default
    return (
        f"`{shown:g}`" if isinstance(shown, float) else "`" + str(shown).replace("'", '"') + "`"
    )


def rows(name):
    """Key, unit, default and meaning of each key of a table."""
    above, keys = TABLES[name]
    found = [(key, *row) for key, row in _EXTRA.get(name, {}).items()]
    for key, (function, argument) in keys.items():
        unit = _UNITS.get(key) if name.startswith(("program.", "material: dynamic")) else None
        if name == "program.table: a file" and key in UNITS:
            unit = "-"  # the name of a column
        stated = (unit, unit_of(f"{above}.{key}"), units_of(function).get(argument, ""))
        unit = next((one for one in stated if one not in (None, "", "1")), "")
        columns = COLUMNS.get(name.removeprefix("material: "), {}).values()
        needed = {"frequency_unit", *(argument for argument, _ in columns)}
        if above == "surface":
            needed = set(SPECTRUM)
        default = _default(name, function, argument)
        if default == "required" and key in needed:
            default = "required, or `file`"
        found.append((key, unit, default, meaning(function, argument)))
    return [(*row, text[:1].upper() + text[1:]) for *row, text in found]


def table(name):
    """Markdown of a table."""
    lines = ["| " + " | ".join(HEAD) + " |", "|" + "---|" * len(HEAD)]
    cells = [[f"`{key}`", *rest] for key, *rest in rows(name)]
    return "\n".join(
        [
            *lines,
            *("| " + " | ".join(one.replace("|", "\\|") for one in row) + " |" for row in cells),
        ]
    )
