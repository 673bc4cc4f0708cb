"""The gallery: runs every study of workflows/ and draws a figure or two of each into docs/gallery/.

    python docs/make_gallery.py [STUDY ...]

writes gallery.md, small PNG files, and with ``quickstart`` the README's picture. It draws only the studies named (default: all),
and runs the notebook ``first_contact`` if it is named or nothing is. A picture is written only if a pixel of it has changed.
"""

import io
import sys
import tempfile
import tomllib
from pathlib import Path

import xarray as xr
from PIL import Image

import roughvisc as rv
from roughvisc.study.case import Case

HERE = Path(__file__).parent
WORKFLOWS = HERE.parent / "workflows"
#: study -> its figures, drawn from the result of a case or from all cases
FIGURES = {
    "quickstart": {
        "maps": lambda ds: rv.plot.maps(ds, fields=["pressure"]),
        "history": rv.plot.history,
    },
    "ball_on_rubber": {"section": rv.plot.section, "history": rv.plot.history},
    "load_sweep": {
        "sweep": lambda results: rv.plot.sweep(results, times=[0.01, -1]),
        "histories": lambda results: rv.plot.sweep(results, along="time"),
        "area": lambda results: rv.plot.area_against_load(by_load(results)),
    },
    "two_parameters": {
        "lines": lambda results: rv.plot.sweep(results, "approach", times=[0.01, 0.05]),
    },
    "thickness_sweep": {
        "approach": lambda results: rv.plot.sweep(results, "approach", times=[0, 0.05, 1]),
        "area": lambda results: rv.plot.sweep(results, times=[0, 0.05, 1]),
    },
    "stop_and_go": {"friction": lambda ds: rv.plot.history(ds, over="sliding_distance")},
    "scan_to_area": {
        "area": lambda results: rv.plot.area_against_load(
            by_load(results), contact_modulus={"glassy": 4 * 3e6, "rubbery": 4 * 0.75e6}
        ),
    },
    "creeping_seal": {
        "history": lambda ds: rv.plot.history(leaking(ds)),
        "leakage": lambda ds: rv.plot.maps(ds, fields="flux"),
    },
    "friction": {
        "curve": lambda ds: rv.plot.friction(
            ds.merge(rv.observables.persson(ds, Case.from_json(ds.attrs["case"]).body))
        ),
        "maps": rv.plot.maps,
    },
    "tack": {
        "work": lambda results: rv.plot.sweep(results, "work", along="program.2.over"),
        "force": lambda results: rv.plot.history(
            results.isel(case=-3), ["force", "contact_area"], over="approach"
        ),
    },
    "stability_map": {},  # drawn by its script
}
SCRIPTS = {
    name: f"figures/{name}.png"
    for name in (
        "maxwell_step",
        "zener_step",
        "thin_sheet",
        "coating",
        "tyre_on_asphalt",
        "stability_map",
    )
}


NOTEBOOK = "first_contact"


def leaking(ds):
    """The result with the leak rate of water under 1 bar, as ``roughvisc run`` adds it."""
    leak = rv.observables.leakage(ds, viscosity="1 mPa s", pressure_drop="1 bar")
    return ds.assign(leak.data_vars)


def run_notebook(path):
    """Run a notebook, and keep its outputs in it."""
    import nbformat
    from nbclient import NotebookClient

    notebook = nbformat.read(path, as_version=4)
    NotebookClient(
        notebook, timeout=300, resources={"metadata": {"path": str(path.parent)}}
    ).execute()
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)  # when it ran
    nbformat.write(notebook, path)


def by_load(results):
    """One entry a case, named by its load."""
    loads = results["program_0_load"].values
    return {f"{1e3 * load:g} mN": results.isel(case=i) for i, load in enumerate(loads)}


def save_changed(figure, path, dpi):
    """Write a figure as a small picture, unless the file has the same pixels already."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=dpi)
    picture = Image.open(stream).convert("RGB")
    if path.exists():
        with Image.open(path) as before:
            if (
                before.size == picture.size
                and before.convert("RGB").tobytes() == picture.tobytes()
            ):
                return
    picture.save(path, optimize=True)


def draw(name, folder):
    """Run one study and write its figures, small."""
    study = WORKFLOWS / f"{name}.toml"
    with tempfile.TemporaryDirectory() as results:
        swept = "sweep" in tomllib.loads(study.read_text())
        if swept:
            ds = rv.sweep(study, results, workers=0, progress=False)
        else:
            ds = rv.run(study, results, progress=False)
        for kind, figure in FIGURES[name].items():
            save_changed(figure(ds), folder / f"{name}-{kind}.png", dpi=100)
            ds.close()
    xr.backends.file_manager.FILE_CACHE.clear()


def draw_readme(study="quickstart"):
    """The first picture of the README: maps of the study that it begins with."""
    path = HERE / "figures" / f"{study}.png"
    with tempfile.TemporaryDirectory() as folder:
        ds = rv.run(WORKFLOWS / f"{study}.toml", folder, progress=False)
        save_changed(rv.plot.maps(ds), path, dpi=120)
        ds.close()
    xr.backends.file_manager.FILE_CACHE.clear()


def page():
    """Text of the gallery."""
    lines = [
        "# Gallery",
        "",
        "Every study of `workflows/`, with its figures. `docs/make_gallery.py` runs the studies and draws them.",
        "",
    ]
    lines += [
        f"From a scan to real contact area at three temperatures, in Python: [a notebook]({NOTEBOOK}.ipynb).",
        "",
    ]
    for name in FIGURES:
        study = WORKFLOWS / f"{name}.toml"
        text = study.read_text()
        lines += [
            f"## {tomllib.loads(text)['title']}",
            "",
            "```sh",
            f"roughvisc run workflows/{name}.toml",
            "```",
            "",
        ]
        lines += [f"![{kind}](gallery/{name}-{kind}.png)\n" for kind in FIGURES[name]]
    for name, figure in SCRIPTS.items():
        summary = (WORKFLOWS / f"{name}.py").read_text().split('"""')[1].strip().partition("\n")
        lines += [
            f"## {summary[0].rstrip('.')}",
            "",
            "```sh",
            f"python workflows/{name}.py",
            "```",
            "",
        ]
        lines += [f"![{name}]({figure})", ""]
    return "\n".join(lines)


def main(names):
    folder = HERE / "gallery"
    folder.mkdir(exist_ok=True)
    for name in names or [*FIGURES, NOTEBOOK]:
        if name == NOTEBOOK:
            run_notebook(HERE / f"{name}.ipynb")
        elif FIGURES[name]:
            draw(name, folder)
        if name == "quickstart":
            draw_readme(name)
    (HERE / "gallery.md").write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
