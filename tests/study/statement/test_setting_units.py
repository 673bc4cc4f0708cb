"""Units of the values of a study: told by the kinds of its keys, and by nothing else."""

import pytest

from roughvisc.study.statement.schema import program, settings, surface
from roughvisc.study.statement.schema.keys import unit_of
from roughvisc.study.statement.schema.material import SECTIONS
from roughvisc.study.statement.schema.surface import Filter, Outliers

CYCLES = {control: {"program": [{"cycle": {}, "control": control}]} for control in ("load", "approach")}
TABLES = {control: {"program": [{"table": {}, "control": control}]} for control in ("load", "approach")}
#: where a table stands, the class that it is, and a case that has it there
PLACES = [
    *((f"material.{model}", "material", one, {"material": {"model": model}}) for model, one in SECTIONS.items()),
    *((name, "surface", one, {"surface": {"generate": name}}) for name, one in surface.GENERATED.items()),
    ("file", "surface", surface.FileSurface, {"surface": {"file": "scan.x3p"}}),
    ("filter", "surface.filter", Filter, None),
    ("outliers", "surface.outliers", Outliers, None),
    *((one.__name__, "program.0", one, None) for one in program.SECTIONS),
    ("load cycle", "program.0.cycle", program.TABLES["load"].wave, CYCLES["load"]),
    ("approach cycle", "program.0.cycle", program.TABLES["approach"].wave, CYCLES["approach"]),
    ("solve", "solve", settings.SolveSection, None),
    ("keep", "keep", settings.KeepSection, None),
]


@pytest.mark.parametrize(("above", "section", "case"), [one[1:] for one in PLACES], ids=[one[0] for one in PLACES])
def test_unit_of__is_what_the_key_expects(above, section, case):
    for name, field in section.model_fields.items():
        words = field.description or ""
        if words.startswith("a number"):  # "a number [Pa], or text with a unit, above 0"
            stated = words.partition(",")[0].removeprefix("a number").strip()
            unit = stated.removeprefix("[").removesuffix("]") if stated.startswith("[") else ""
            assert unit_of(f"{above}.{name}", case) == unit, name


def test_unit_of__words_counts_and_unknown_keys_have_none():
    for key in ("surface.seed", "surface.level", "solve.boundary", "solve.tolerance", "keep.times", "keep.fields"):
        assert unit_of(key) == ""
    for key in ("", "program", "program.0", "program.first.load", "material.colour", "nothing.load", "title"):
        assert unit_of(key) == ""


def test_unit_of__a_number_or_a_word_a_list_and_what_is_inside():
    assert unit_of("solve.time_step") == "s"
    assert [unit_of(f"surface.{key}") for key in ("size", "spacing", "crop.x", "crop.x.0")] == ["m"] * 4
    assert [unit_of(f"material.{key}") for key in ("moduli", "times", "times.0", "fluidity")] == [
        "Pa",
        "s",
        "s",
        "1/(Pa s)",
    ]
    assert unit_of("material.b.viscosity") == "Pa s"


def test_unit_of__what_has_two_units_needs_the_case():
    assert unit_of("program.0.cycle.mean") == unit_of("program.0.table.values") == ""
    for control, unit in (("load", "N"), ("approach", "m")):
        assert unit_of("program.0.cycle.mean", CYCLES[control]) == unit
        assert unit_of("program.0.table.values", TABLES[control]) == unit
    assert unit_of("program.0.cycle.mean", {"program": [{"cycle": {}}]}) == "N", "of load unless it says otherwise"


def test_unit_of__a_case_of_another_model_tells_nothing_against_it():
    assert unit_of("material.viscosity", {"material": {"model": "elastic"}}) == "Pa s"
