"""``[material]``: the models by name, what each is built by, and the kind of each of its keys."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import reduce
from operator import or_
from typing import Annotated, Any, Literal

from pydantic import Field, WrapValidator, create_model, model_validator

from roughvisc.errors import InputError
from roughvisc.mechanics import materials
from roughvisc.study.schema.entries import listed, measured, shown
from roughvisc.study.schema.section import Section, nearest, refuse

MODULUS = measured("Pa", above=0)
VISCOSITY = measured("Pa s", above=0)
TIMES = listed(measured("s", above=0), "times [s]")
POISSON = measured("1", above=-1, most=0.5)

#: name of a model -> what builds it, and the kind of each of its keys; the constructor's defaults hold here too
MODELS: dict[str, tuple[Callable[..., materials.Material], dict[str, Any]]] = {
    "elastic": (materials.elastic, {"shear_modulus": MODULUS, "poisson": POISSON}),
    "maxwell": (materials.maxwell, {"shear_modulus": MODULUS, "viscosity": VISCOSITY, "poisson": POISSON}),
    "kelvin_voigt": (materials.kelvin_voigt, {"shear_modulus": MODULUS, "viscosity": VISCOSITY, "poisson": POISSON}),
    "zener": (
        materials.zener,
        {"shear_modulus": MODULUS, "kelvin_modulus": MODULUS, "kelvin_viscosity": VISCOSITY, "poisson": POISSON},
    ),
    "from_relaxation": (
        materials.from_relaxation,
        {
            "equilibrium": measured("Pa", least=0),
            "moduli": listed(MODULUS, "moduli [Pa]"),
            "times": TIMES,
            "poisson": POISSON,
        },
    ),
    "prony": (
        materials.Prony,
        {
            "glassy": measured("1/Pa", least=0),
            "fluidity": measured("1/(Pa s)", least=0),
            "compliances": listed(measured("1/Pa", least=0), "compliances [1/Pa]"),
            "times": TIMES,
            "poisson": POISSON,
        },
    ),
}


class MaterialSection(Section):
    """One material by the name of its model; each model has a class of its own, made from :data:`MODELS`."""

    model: str

    def build(self) -> materials.Material:
        """The material itself."""
        constructor, kinds = MODELS[self.model]
        return constructor(**{key: getattr(self, key) for key in kinds})

    @model_validator(mode="after")
    def _builds(self) -> MaterialSection:
        self.build()
        return self


def _section(name: str) -> type[MaterialSection]:
    constructor, kinds = MODELS[name]
    parameters = inspect.signature(constructor).parameters
    fields: dict[str, Any] = {
        key: (kind, ... if parameters[key].default is inspect.Parameter.empty else parameters[key].default)
        for key, kind in kinds.items()
    }
    return create_model(name, __base__=MaterialSection, model=(Literal[name], ...), **fields)


SECTIONS = {name: _section(name) for name in MODELS}


def _pick(data: Any, _: Any, info: Any) -> Any:
    """The table as the class of the model that it names."""
    if isinstance(data, MaterialSection):
        return data
    if not isinstance(data, dict):
        raise InputError(f"found {shown(data)}: expected a table with a model")
    if "model" not in data:
        raise refuse("model", f"missing: expected one of {', '.join(MODELS)}")
    if data["model"] not in SECTIONS:
        raise refuse("model", f"found {shown(data['model'])}, which is no known model{nearest(data['model'], MODELS)}")
    return SECTIONS[data["model"]].model_validate(data, context=info.context)


AnyMaterial = Annotated[
    reduce(or_, SECTIONS.values()),
    WrapValidator(_pick),
    Field(description="a [material] table with a model"),
]
