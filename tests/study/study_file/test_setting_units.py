"""Units of the keys of a study: those of the arguments of its functions."""

import pytest

from roughvisc.arguments import units_of
from roughvisc.mechanics.materials.models import MODELS
from roughvisc.study.si_tables import unit_of
from roughvisc.topography.synthesis import RECIPES

CYCLES = {control: {"program": [{"cycle": {}, "control": control}]} for control in ("load", "approach")}
TABLES = {control: {"program": [{"table": {}, "control": control}]} for control in ("load", "approach")}


@pytest.mark.parametrize(
    ("table", "function"),
    [*(("material", one) for one in MODELS.values()), *(("surface", one) for one in RECIPES.values())],
)
def test_unit_of__is_that_of_the_argument_of_every_model_and_recipe(table, function):
    for name, unit in units_of(function).items():
        assert unit_of(f"{table}.{name}") == ("" if unit == "1" else unit)


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
    assert unit_of("surface.shortest_wave") == unit_of("surface.filter") == unit_of("surface.filter.cutoff") == "m"


def test_unit_of__what_has_two_units_needs_the_case():
    assert unit_of("program.0.cycle.mean") == unit_of("program.0.table.values") == ""
    for control, unit in (("load", "N"), ("approach", "m")):
        assert unit_of("program.0.cycle.mean", CYCLES[control]) == unit
        assert unit_of("program.0.table.values", TABLES[control]) == unit
    assert unit_of("program.0.cycle.mean", {"program": [{"cycle": {}}]}) == "N", "of load unless it says otherwise"
