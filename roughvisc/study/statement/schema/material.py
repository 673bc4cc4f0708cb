"""``[material]``: the models by name, what each is built by, and the kind of each of its keys."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal, get_args

from pydantic import (
    ValidationError,
    ValidationInfo,
    WithJsonSchema,
    create_model,
    model_validator,
)

from roughvisc.errors import InputError
from roughvisc.mechanics.body import Body
from roughvisc.mechanics.layer import layer
from roughvisc.mechanics.materials.checks import tensile_to_shear
from roughvisc.mechanics.materials.creep import Material, power_law
from roughvisc.mechanics.materials.derived import LARGEST_SHIFT, pair, shift, stiffened
from roughvisc.mechanics.materials.models import elastic, kelvin_voigt, maxwell, zener
from roughvisc.mechanics.materials.prony import Prony
from roughvisc.mechanics.materials.relaxation import from_relaxation
from roughvisc.mechanics.materials.tables import creep_table, dynamic_table, relaxation_table
from roughvisc.mechanics.materials.temperature import arrhenius, wlf
from roughvisc.mechanics.sheet import BASE, Base, sheet
from roughvisc.study.statement.schema.section import (
    FilePath,
    Section,
    Text,
    Unit,
    choice,
    kind,
    listed,
    located,
    measured,
    nearest,
    nullable,
    of_file,
    one_of,
    refuse,
    shown,
    validate,
)
from roughvisc.tables import FREQUENCY_UNITS, Wanted, read_table

#: key -> its kind; every model takes them, and none of them is needed
TEMPERATURE: dict[str, Any] = {
    "temperature": measured("K", above=0),
    "reference_temperature": measured("K", above=0),
    "wlf_c1": measured("1", above=0),
    "wlf_c2": measured("K", above=0, difference=True),
    "activation_energy": measured("J/mol", above=0),
    "shift_factor": measured("1", least=1 / LARGEST_SHIFT, most=LARGEST_SHIFT),
}
_LAWS = (("wlf_c1", "wlf_c2"), ("activation_energy",))
_WANTED = "wlf_c1 and wlf_c2, or activation_energy"


def shift_factor(stated: Mapping[str, Any]) -> float:
    """What all times of a material are multiplied by; one if nothing is stated.

    Parameters
    ----------
    stated : mapping
        Values of :data:`TEMPERATURE`, None where there is none.

    Raises
    ------
    ValidationError
        Naming the key, if one is missing or too many, or the temperature is out of the law's range.
    """
    given = {key: stated[key] for key in TEMPERATURE if stated.get(key) is not None}
    if "shift_factor" in given:
        if len(given) > 1:
            beside = next(key for key in given if key != "shift_factor")
            raise refuse("shift_factor", f"found beside {beside}: expected one of them")
        return float(given["shift_factor"])
    if not given:
        return 1.0
    for key in ("temperature", "reference_temperature"):
        if key not in given:
            raise refuse(key, f"missing: expected a temperature in K, or with its unit, beside {next(iter(given))}")
    laws = [law for law in _LAWS if any(key in given for key in law)]
    if len(laws) != 1:
        found = f"found {' and '.join(laws[0] + laws[1])}" if laws else "missing"
        raise refuse(laws[1][0] if laws else "wlf_c1", f"{found}: expected {_WANTED}")
    for key in laws[0]:
        if key not in given:
            raise refuse(key, f"missing: expected {_WANTED}")
    at = given["temperature"], given["reference_temperature"]
    try:
        factor = (
            wlf(*at, given["wlf_c1"], given["wlf_c2"])
            if "wlf_c1" in given
            else arrhenius(*at, given["activation_energy"])
        )
    except InputError as error:
        raise refuse("temperature", str(error).replace("temperature is", "found", 1)) from error
    if not 1 / LARGEST_SHIFT <= factor <= LARGEST_SHIFT:
        raise refuse(
            "temperature",
            f"found {at[0]:g} K and a reference of {at[1]:g} K, a shift by {factor:.1g}: expected one from 1e-30 to "
            "1e30; a number is in kelvin, and '25 degC' is a text",
        )
    return factor


_THICKNESS = measured("m", above=0)


def _thickness(value: Any) -> float:
    """A length, or an infinite one: a half-space among the sheets of a sweep."""
    endless = isinstance(value, float) and value == math.inf
    return math.inf if endless else float(validate(_THICKNESS, value))


#: key -> its kind; every model takes them, and a half-space has none of them
THICKNESS: dict[str, Any] = {
    "thickness": kind(
        float,
        _thickness,
        "a number [m], or text with a unit, above 0; inf: a half-space",
        {"type": ["number", "string"]},
        Unit("m"),
    ),
    "base": choice(*get_args(Base)),
}


MODULUS = measured("Pa", above=0)
COMPLIANCE = measured("1/Pa", least=0)
VISCOSITY = measured("Pa s", above=0)
TIMES = listed(measured("s", above=0), "times [s]")
INSTANTS = listed(measured("s", least=0), "times [s]")
POISSON = measured("1", above=-1, most=0.5)

#: a behaviour in volume: one or the other
_VOLUME = {"poisson": POISSON, "bulk_modulus": MODULUS}
#: shear modulus of a spring -> Young's modulus, which stands in its place
SPRINGS = {"shear_modulus": "young_modulus", "kelvin_modulus": "kelvin_young_modulus"}
_SPRING = {"shear_modulus": MODULUS, "young_modulus": MODULUS}
_KELVIN = {"kelvin_modulus": MODULUS, "kelvin_young_modulus": MODULUS}
#: keys that a study may leave out although their model's constructor names no value for them
_OPTIONAL = {*_VOLUME, *_SPRING, *_KELVIN}
#: model and key -> usual value of a key that came later: it does not count then, so that the keys of former cases stay
_LATER = {("from_relaxation", "kind"): "shear"}
_KIND = choice("shear", "tensile")

#: name of a model -> what builds it, and the kind of each of its keys; the constructor's defaults hold here too
MODELS: dict[str, tuple[Callable[..., Material], dict[str, Any]]] = {
    "elastic": (elastic, {**_SPRING, **_VOLUME}),
    "maxwell": (maxwell, {**_SPRING, "viscosity": VISCOSITY, **_VOLUME}),
    "kelvin_voigt": (kelvin_voigt, {**_SPRING, "viscosity": VISCOSITY, **_VOLUME}),
    "zener": (zener, {**_SPRING, **_KELVIN, "kelvin_viscosity": VISCOSITY, **_VOLUME}),
    "from_relaxation": (
        from_relaxation,
        {
            "equilibrium": measured("Pa", least=0),
            "moduli": listed(MODULUS, "moduli [Pa]"),
            "times": TIMES,
            "kind": _KIND,
            **_VOLUME,
        },
    ),
    "prony": (
        Prony,
        {
            "glassy": COMPLIANCE,
            "fluidity": measured("1/(Pa s)", least=0),
            "compliances": listed(COMPLIANCE, "compliances [1/Pa]"),
            "times": TIMES,
            "poisson": POISSON,
        },
    ),
    "power_law": (
        power_law,
        {
            "glassy": COMPLIANCE,
            "coefficient": measured("1/Pa", above=0),
            "exponent": measured("1", above=0, below=1),
            "time_scale": measured("s", above=0),
            "poisson": POISSON,
        },
    ),
    "creep_table": (
        creep_table,
        {
            "times": INSTANTS,
            "compliances": listed(COMPLIANCE, "compliances [1/Pa]"),
            "kind": _KIND,
            "noise": measured("1", least=0, below=1),
            "poisson": POISSON,
        },
    ),
    "relaxation_table": (
        relaxation_table,
        {"times": INSTANTS, "moduli": listed(MODULUS, "moduli [Pa]"), "kind": _KIND, "poisson": POISSON},
    ),
    "dynamic_table": (
        dynamic_table,
        {
            "frequencies": listed(measured("1", above=0), "frequencies [frequency_unit]"),
            "storage": listed(measured("Pa", least=0), "storage moduli [Pa]"),
            "loss": listed(measured("Pa", least=0), "loss moduli [Pa]"),
            "frequency_unit": choice(*FREQUENCY_UNITS),
            "shift_factors": listed(measured("1", above=0), "shift factors"),
            "kind": _KIND,
            "poisson": POISSON,
        },
    ),
}


@dataclass(frozen=True)
class Column:
    """A column of a CSV file that a model may be read from.

    Attributes
    ----------
    name, unit : str
        As in the heading, and in SI.
    unit_key : str
        Key that says the column's unit where the heading does not.
    optional : bool
        Whether the file need not have it.
    """

    name: str
    unit: str
    unit_key: str
    optional: bool = False


#: model -> its keys that the columns of ``file`` may stand for
COLUMNS: dict[str, dict[str, Column]] = {
    "creep_table": {
        "times": Column("time", "s", "time_unit"),
        "compliances": Column("compliance", "1/Pa", "compliance_unit"),
    },
    "relaxation_table": {
        "times": Column("time", "s", "time_unit"),
        "moduli": Column("modulus", "Pa", "modulus_unit"),
    },
    "dynamic_table": {
        "frequencies": Column("frequency", "", "frequency_unit"),
        "storage": Column("storage", "Pa", "modulus_unit"),
        "loss": Column("loss", "Pa", "modulus_unit"),
        "shift_factors": Column("shift_factor", "1", "", optional=True),
    },
}


class MaterialSection(Section):
    """One material by the name of its model; each model has a class of its own, made from :data:`MODELS`."""

    model: str
    modulus_factor: measured("1", above=0) = 1.0

    @property
    def shift(self) -> float:
        """What all its times are multiplied by at its temperature."""
        return shift_factor({key: getattr(self, key) for key in TEMPERATURE})

    def build(self) -> Material:
        """The material itself, at its temperature."""
        constructor, kinds = MODELS[self.model]
        stated = {key: getattr(self, key) for key in kinds}
        material = constructor(
            **{
                key: value.build() if isinstance(value, MaterialSection) else value
                for key, value in stated.items()
                if value is not None
            }
        )
        material = material if self.shift == 1 else shift(material, self.shift)
        return material if self.modulus_factor == 1 else stiffened(material, self.modulus_factor)

    def body(self) -> Body:
        """What is made of it: a half-space, a sheet, or a layer on what its table ``on`` says."""
        return self._body_of(self.build())

    def _body_of(self, material: Material) -> Body:
        """The body of the material, which may have taken a fit."""
        thickness, base = self.sheet["thickness"], self.sheet["base"]
        below: MaterialSection | None = getattr(self, "on", None)
        if base is not None and below is not None:
            raise InputError(f"base is {base!r} beside a table on: expected one of them")
        if thickness is not None and below is not None:
            return layer(material, thickness, on=below.body())
        if thickness is not None:
            return sheet(material, thickness, base or BASE)
        if base is not None:
            raise InputError(f"base is {base!r} without a thickness: expected both, or neither for a half-space")
        if below is not None:
            raise InputError("on is there without a thickness: expected both, or neither for a half-space")
        return Body(material)

    @property
    def sheet(self) -> dict[str, Any]:
        """Thickness [m] and base as stated, None where they are not."""
        return {key: getattr(self, key) for key in THICKNESS}

    def content(self) -> dict[str, Any]:
        """All that determines the material, the same however it was stated."""
        kinds = MODELS[self.model][1]
        stated: dict[str, Any] = {"model": self.model}
        for key in kinds:
            value = getattr(self, key)
            if value is not None and value != _LATER.get((self.model, key)):
                stated[key] = value.content() if isinstance(value, MaterialSection) else value
        for of_shear, of_young in SPRINGS.items():
            if of_young in stated:
                stated[of_shear] = stated.pop(of_young) / tensile_to_shear("tensile", stated.get("poisson", 0.5))
        if "bulk_modulus" in kinds and "bulk_modulus" not in stated:
            stated.setdefault("poisson", 0.5)
        if self.shift != 1:  # however it was stated
            stated["shift_factor"] = self.shift
        if self.modulus_factor != 1:
            stated["modulus_factor"] = self.modulus_factor
        if self.sheet["thickness"] not in (None, math.inf):
            below: MaterialSection | None = getattr(self, "on", None)
            base = {"base": self.sheet["base"] or BASE} if below is None else {"on": below.content()}
            stated |= {"thickness": self.sheet["thickness"]} | base
        return stated

    @model_validator(mode="after")
    def _builds(self) -> MaterialSection:
        for of_shear, of_young in SPRINGS.items():
            given = [key for key in (of_shear, of_young) if getattr(self, key, None) is not None]
            if len(given) == 2:
                raise refuse(of_young, f"found beside {of_shear}: expected one of them")
            if not given and of_shear in MODELS[self.model][1]:
                raise refuse(of_shear, f"missing: expected it, or {of_young}")
        material = self.build()
        try:
            self._body_of(material)
        except InputError as error:
            stated = [key for key in ("thickness", "base", "on") if getattr(self, key, None) is not None]
            at_fault = next((key for key in stated if str(error).startswith(f"{key} ")), stated[0])
            raise refuse(at_fault, str(error)) from error
        for name in MODELS[self.model][1]:
            part = getattr(self, name)
            if isinstance(part, MaterialSection) and part.sheet["thickness"] is not None:
                raise refuse(name, "found a thickness: expected none, as the bodies of a pair are half-spaces")
        return self


def _section(name: str) -> type[MaterialSection]:
    constructor, kinds = MODELS[name]
    parameters, columns = inspect.signature(constructor).parameters, COLUMNS.get(name, {})
    fields: dict[str, Any] = {}
    for key, own in kinds.items():
        default = parameters[key].default
        if key in columns:
            default = None  # missing with a file, and asked for by _with_columns without one
        elif default is inspect.Parameter.empty or (default is None and key not in _OPTIONAL):
            default = ...
        fields[key] = (nullable(own) if default is None else own, default)
    if columns:
        fields["file"] = (nullable(FilePath), None)
        keys = {column.unit_key for column in columns.values()} - {"", *kinds}
        fields |= {key: (nullable(Text), None) for key in sorted(keys)}
    fields |= {key: (nullable(one), None) for key, one in {**TEMPERATURE, **THICKNESS, "on": _BELOW}.items()}
    return create_model(name, __base__=MaterialSection, model=(Literal[name], ...), **fields)


def _with_columns(data: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
    """The table with the columns of its ``file`` in the file's place, so that a case is whole in itself."""
    columns = COLUMNS.get(str(data["model"]), {})
    needed = [key for key, column in columns.items() if not column.optional]
    units = sorted({column.unit_key for column in columns.values()} - {"", *MODELS[data["model"]][1]})
    if "file" not in data or not columns:
        for key in (key for key in needed if key not in data):
            raise refuse(key, f"missing: expected file, or {' and '.join(needed)}")
        for key in (key for key in units if key in data):
            raise refuse(key, "found without a file: expected units where the values are")
        return data
    for key in (key for key in columns if key in data):
        raise refuse("file", f"found beside {key}: expected one of them")
    for key in (key for key in units if not isinstance(data.get(key, ""), str)):
        raise refuse(key, f"found {shown(data[key])}: expected a unit")
    if data["model"] == "dynamic_table" and data.get("frequency_unit") not in FREQUENCY_UNITS:
        found = f"found {shown(data['frequency_unit'])}" if "frequency_unit" in data else "missing"
        raise refuse("frequency_unit", f"{found}: expected {' or '.join(map(repr, FREQUENCY_UNITS))}")
    try:
        wanted = {
            one.name: Wanted(one.name, one.unit or data["frequency_unit"], data.get(one.unit_key), one.optional)
            for one in columns.values()
        }
        read, _ = read_table(located(data["file"], info), wanted)
    except InputError as error:
        raise refuse("file", str(error)) from error
    kept = {key: value for key, value in data.items() if key not in (*units, "file")}
    return kept | {key: read[one.name].tolist() for key, one in columns.items() if one.name in read}


def _by_model(sections: dict[str, type[MaterialSection]]) -> Callable[[dict[str, Any], ValidationInfo], Any]:
    """What makes a table the class of the model that it names."""

    def make(data: dict[str, Any], info: ValidationInfo) -> MaterialSection:
        if "model" not in data:
            raise refuse("model", f"missing: expected one of {', '.join(sections)}")
        name = data["model"]
        if not isinstance(name, str) or name not in sections:
            raise refuse("model", f"found {shown(name)}, which is no known model{nearest(name, sections)}")
        stated = _with_columns(data, info)
        try:
            return sections[name].model_validate(stated, context=info.context)
        except ValidationError as error:
            if stated is data:
                raise
            columns = {key: column.name for key, column in COLUMNS[name].items()}
            raise of_file(located(data["file"], info), columns, error, "file") from None

    return make


_TABLE = "a table with a model"
#: what a layer may lie on, and one of two bodies: any model but a pair
_SINGLE: dict[str, type[MaterialSection]] = {}
_BELOW = Annotated[
    one_of(MaterialSection, [MaterialSection], _by_model(_SINGLE), _TABLE, f"{_TABLE}, as [material] itself"),
    WithJsonSchema({"type": "object"}),
]
_SINGLE.update({name: _section(name) for name in MODELS})
_BODY = one_of(MaterialSection, _SINGLE.values(), _by_model(_SINGLE), _TABLE, _TABLE)
MODELS["pair"] = (pair, {"a": _BODY, "b": _BODY})
SECTIONS = {**_SINGLE, "pair": _section("pair")}
AnyMaterial = one_of(MaterialSection, SECTIONS.values(), _by_model(SECTIONS), _TABLE, "a [material] table with a model")
