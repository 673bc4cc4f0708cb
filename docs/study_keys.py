"""The tables of the page on study files: keys, kinds, units, defaults and meanings as the schema has them.

``rows(name)`` gives those of one table of ``keys.toml``, ``table(name)`` the same in Markdown.
"""

import re

from roughvisc.study.statement.schema import (
    StudyFile,
    evaluation,
    experiments,
    material,
    program,
    settings,
    surface,
)
from roughvisc.study.statement.schema.keys import meaning as first_meaning
from roughvisc.study.statement.schema.keys import unit_of
from roughvisc.study.statement.schema.material import TEMPERATURE, THICKNESS

HEAD = ("key", "expected", "unit", "default", "meaning", "example")
_STEPS = surface.Prepared.model_fields
_GENERATED = {f"generate: {name}": one for name, one in surface.GENERATED.items()}
_MODELS = {f"material: {name}": one for name, one in material.SECTIONS.items()}
_CASES = {
    **{f"generate: {name}": {"surface": {"generate": name}} for name in surface.GENERATED},
    **{f"material: {name}": {"material": {"model": name}} for name in material.SECTIONS},
}


def _only(section, names):
    return {name: section.model_fields[name] for name in names}


def _own(section, other):
    return {name: field for name, field in section.model_fields.items() if name not in other}


#: table -> where its keys stand in a study, and the schema's fields
TABLES = {
    "study": ("", StudyFile.model_fields),
    "surface: a file": ("surface", surface.FromFile.model_fields),
    "surface: steps of a face": ("surface", _STEPS),
    "surface: steps of the profile": ("surface", _own(surface.SurfaceSection, _STEPS)),
    "surface.crop": ("surface.crop", surface.Crop.model_fields),
    "surface.outliers": ("surface.outliers", surface.Outliers.model_fields),
    "surface.filter": ("surface.filter", surface.Filter.model_fields),
    "surface.second": ("surface.second", _own(surface.SecondFace, _STEPS)),
    "generate: any": (
        "surface",
        _only(surface.GENERATED["sphere"], ("generate", "size", "shape")),
    ),
    **{
        name: (
            "surface",
            _own(one, {*surface.SurfaceSection.model_fields, "generate", "size", "shape"}),
        )
        for name, one in _GENERATED.items()
    },
    **{
        name: ("material", _own(one, {"model", "on", *TEMPERATURE, *THICKNESS}))
        for name, one in _MODELS.items()
    },
    "material: temperature": ("material", _only(material.SECTIONS["elastic"], TEMPERATURE)),
    "material: thickness": ("material", _only(material.SECTIONS["elastic"], (*THICKNESS, "on"))),
    **{
        f"program: {name}": ("program.0", kind["load"].model_fields)
        for name, kind in program.KINDS.items()
    },
    "program.cycle": ("program.0.cycle", program.TABLES["load"].wave.model_fields),
    "program.table": ("program.0.table", program.TABLES["load"].rows.model_fields),
    "friction": ("friction", experiments.FrictionSection.model_fields),
    "friction.speeds": (
        "friction.speeds",
        {field.alias or name: field for name, field in experiments.Decades.model_fields.items()},
    ),
    "solve": ("solve", settings.SolveSection.model_fields),
    "keep": ("keep", settings.KeepSection.model_fields),
    "observe": ("observe", evaluation.ObserveSection.model_fields),
    "observe.leakage": ("observe.leakage", evaluation.LeakageTable.model_fields),
    "observe.conductance": ("observe.conductance", evaluation.ConductanceTable.model_fields),
    "audit": ("audit", evaluation.AuditSection.model_fields),
}
#: first word of a table's name -> the table whose meanings hold where it has none of its own
_SHARED = {"generate": "generate: any", "material": "material: any"}
_WORDS = {
    "control": "'load', 'approach' or 'pressure'",
    "cycle": "a table",
    "friction": "a table",
    "note": "a text",
    "table": "a table, or the path of a CSV file",
    "crop": "a table of x and y limits",
    "speed": "a quantity above 0",
    "over": "a quantity above 0",
    "solve": "a table",
    "keep": "a table",
    "audit": "a table",
    "sweep": "a table of lists, or several",
    "precision": "a number above 0 and below 1",
    "generate": "one of " + ", ".join(surface.GENERATED),
}
#: units that depend on another key
_UNITS = {
    **dict.fromkeys(("mean", "amplitude", "values"), "N, m or Pa"),
    "frequencies": "Hz or rad/s",
    **dict.fromkeys(("from", "to"), "m/s"),
}


def meaning(name, key):
    """Meaning and example of a key."""
    return first_meaning((name, _SHARED.get(name.partition(":")[0], "")), key)


def rows(name):
    """Key, what is expected, unit, default, meaning and example of each key of a table."""
    above, fields = TABLES[name]
    found = []
    for key, field in fields.items():
        words = field.description or _WORDS[key]
        unit = unit_of(f"{above}.{key}" if above else key, _CASES.get(name))
        told = ("program.", "material: dynamic", "friction.speeds")
        unit = _UNITS.get(key, unit) if name.startswith(told) else unit
        about, example = meaning(name, key)
        found.append((key, _short(words), unit, _default(field), about, example))
    return found


def _short(words):
    """What is expected, without the units, which have a column."""
    words = re.sub(r"^a number \[[^]]+\], or text with a unit,?", "a quantity", words)
    words = re.sub(r" \[[^\[\]]+\]| in s\b", "", words)
    return re.sub(r"(\w)'(\w)", r"\1’\2", words)


def _default(field):
    if field.is_required():
        return "required"
    value = field.get_default(call_default_factory=True)
    if value is None or hasattr(type(value), "model_fields") or value == ():
        return "none"
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    shown = list(value) if isinstance(value, tuple) else value
    return (
        f"`{shown:g}`" if isinstance(shown, float) else "`" + str(shown).replace("'", '"') + "`"
    )


def _cells(row):
    key, words, unit, default, about, example = row
    cells = (
        f"`{key}`",
        re.sub(r"'([^']*)'", r"`\1`", words),
        unit,
        default,
        about,
        f"`{example}`",
    )
    return [cell.replace("|", "\\|") for cell in cells]


def table(name):
    """Markdown of a table."""
    lines = ["| " + " | ".join(HEAD) + " |", "|" + "---|" * len(HEAD)]
    return "\n".join([*lines, *("| " + " | ".join(_cells(row)) + " |" for row in rows(name))])


def filled(page):
    """A page with its marks ``STUDY_KEYS name`` replaced by the tables."""
    return re.sub(r"^STUDY_KEYS (.+)$", lambda found: table(found[1]), page, flags=re.M)
