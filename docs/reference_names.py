"""Public names of each section of the reference, from the package.

The page has a line ``<!-- names "Materials" -->`` in each section; ``conf.py`` puts the names below it when Sphinx
reads the page.
"""

import inspect
import re

import roughvisc as rv

#: Section -> beginnings of the modules of its names; a name belongs to the first section that fits.
SECTIONS = {
    "Surfaces": ("roughvisc.topography",),
    "Materials": ("roughvisc.mechanics.materials", "roughvisc.study.material_file"),
    "Bodies": (
        "roughvisc.mechanics.body",
        "roughvisc.mechanics.sheet",
        "roughvisc.mechanics.layer",
    ),
    "Loading": (
        "roughvisc.mechanics",
        "roughvisc.experiment",
        "roughvisc.study.machine_history",
        "roughvisc.study.records",
    ),
    "Errors": ("roughvisc.errors",),
    "Cases and results": ("roughvisc",),
}
#: Section -> module of functions with all its names.
MODULES = {
    "Figures": "plot",
    "Observables": "observables",
    "Closed forms": "closed_forms",
}
#: The line that names follow.
MARK = re.compile(r'^<!-- names "(.+)" -->$', re.M)


def names():
    """Return section -> public names in it."""
    sections = {section: [] for section in (*SECTIONS, *MODULES)}
    for name in rv.__all__:
        value = getattr(rv, name)
        if name == "__version__" or inspect.ismodule(value):
            continue
        fitting = (one for one, begin in SECTIONS.items() if value.__module__.startswith(begin))
        sections[next(fitting)].append(name)
    for section, module in MODULES.items():
        sections[section] = [f"{module}.{name}" for name in getattr(rv, module).__all__]
    return sections


def listed(section, folder):
    """Return the directive that lists the names of a section, with their pages in a folder."""
    module = getattr(rv, MODULES[section]).__name__ if section in MODULES else "roughvisc."
    head = [f".. currentmodule:: {module.rpartition('.')[0]}", ".. autosummary::"]
    head += [f"   :toctree: {folder}", "   :nosignatures:", ""]
    return "\n".join([*head, *(f"   {name}" for name in names()[section])])


def filled(page):
    """Return the text of the reference with a list of names in the place of each mark."""
    return MARK.sub(lambda mark: f"```{{eval-rst}}\n{listed(mark[1], 'generated')}\n```", page)


def page_of_names():
    """Return a page of all names, from which autosummary makes the page of each name."""
    return "\n\n".join(listed(section, ".") for section in names()) + "\n"
