"""Contact of measured rough surfaces with linear viscoelastic materials.

``import roughvisc as rv`` gives the public names below; each is imported from its module when first used, so that
the package itself is imported in no time. ``h.roughvisc`` has the conditioning as methods of a DataArray, as soon as
a function that gives or takes heights has been used; for DataArrays made otherwise, ``import roughvisc.topography``.
"""

from __future__ import annotations

from importlib import import_module, metadata
from typing import Any

#: public name -> module that defines it
_PUBLIC = {
    name: module
    for module, names in {
        "roughvisc.topography.scans": "open_scan",
        "roughvisc.topography.readers": "from_array supported_formats list_channels",
        "roughvisc.topography.conditioning": (
            "level mask_outliers fill gaussian_filter resample crop rotate90 invert combine taper mirror"
        ),
        "roughvisc.topography.parameters": "parameters",
        "roughvisc.topography.spectrum": "psd",
        "roughvisc.topography.fitting": "fit_self_affine",
        "roughvisc.topography.writers": "save_scan",
        "roughvisc.topography.synthesis": "sphere cone flat_punch wavy self_affine",
        "roughvisc.mechanics.materials.models": (
            "Prony PowerLaw Tabulated elastic maxwell kelvin_voigt zener from_relaxation pair "
            "from_creep_table from_relaxation_table from_dynamic"
        ),
        "roughvisc.mechanics.materials.temperature": "shifted wlf_shift arrhenius_shift",
        "roughvisc.mechanics.stepping.program": "Program",
        "roughvisc.study.simulation.simulate": "simulate",
        "roughvisc.study.statement.histories": "read_program",
        "roughvisc.study.statement.case": "read_study read_cases vary study_schema",
        "roughvisc.study.storage.store": "open_result",
        "roughvisc.study.execution.single": "run",
        "roughvisc.study.execution.sweep": "sweep",
        "roughvisc.study.storage.results": "open_results",
        "roughvisc.study.cost.plan": "plan",
        "roughvisc.study.trade.trade": "trade",
        "roughvisc.study.validation.validate": "validate",
        "roughvisc.views.report.page": "report",
        "roughvisc.views.export": "to_csv deformed",
        "roughvisc.errors": "RoughviscError InputError EdgeContactError ConvergenceError",
    }.items()
    for name in names.split()
}
_MODULES = {
    "plot": "roughvisc.views.plot",
    "observables": "roughvisc.views.observables",
    "closed_forms": "roughvisc.mechanics.closed_forms",
}

__all__ = ["__version__", *sorted(_PUBLIC), *sorted(_MODULES)]


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return import_module(_MODULES[name])
    if name in _PUBLIC:
        value = getattr(import_module(_PUBLIC[name]), name)
        globals()[name] = value
        return value
    if name == "__version__":
        return metadata.version("roughvisc")
    raise AttributeError(f"module 'roughvisc' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
