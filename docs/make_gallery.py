"""The pictures of the pages and of the notebook, and the page of the gallery.

    python docs/make_gallery.py [--as-they-are] [NAME ...]

draws all pictures in docs/gallery/ and docs/figures/, runs the notebook and writes gallery.md. With names it draws only
the pictures of these studies, scripts or other figures. A picture is written only if a pixel has changed.

docs/drawn.json records the code that drew each picture, and a test names the pictures that are older than their code.
After a change of the code that changes no picture, ``--as-they-are`` records the code without drawing.
"""

import argparse
import ast
import io
import json
import os
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

import picture_age
import xarray as xr
from PIL import Image

import roughvisc as rv
from roughvisc.study.case import Case
from roughvisc.study.case_text import study_text

HERE = Path(__file__).parent
ROOT = HERE.parent
WORKFLOWS = ROOT / "workflows"
#: study -> its figures, drawn from the result of a case or from all cases
FIGURES = {
    "quickstart": {
        "maps": lambda ds: rv.plot.maps(ds, fields=["pressure"]),
        "history": lambda ds: rv.plot.history(ds),
    },
    "ball_on_rubber": {
        "section": lambda ds: rv.plot.section(ds),
        "history": lambda ds: rv.plot.history(ds),
    },
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
        "maps": lambda ds: rv.plot.maps(ds),
    },
    "tack": {
        "work": lambda results: rv.plot.sweep(results, "work", along="program.2.over"),
        "force": lambda results: rv.plot.history(
            results.isel(case=-3), ["force", "contact_area"], over="approach"
        ),
    },
    "stability_map": {},  # drawn by its script
}
#: Figure in figures/ -> the script that draws it, with its arguments.
SCRIPTS = {
    "maxwell_step": ["maxwell_step.py", "128"],
    "zener_step": ["zener_step.py", "128"],
    "thin_sheet": ["thin_sheet.py", "128"],
    "coating": ["coating.py", "80"],
    "moving_line": ["moving_line.py"],
    "tyre_on_asphalt": ["tyre_on_asphalt.py"],
    "stability_map": ["stability_map.py"],
    "measured_rolling": ["measured_and_computed.py", "rolling"],
    "measured_cell": ["measured_and_computed.py", "cell"],
    "measured_brain": ["measured_and_computed.py", "brain"],
    "measured_brain_retraction": ["measured_and_computed.py", "brain_retraction"],
    "measured_bead": ["measured_and_computed.py", "bead", "fmt-chiaro-txt_AEBP1_Indentation_002.txt"],
}  # fmt: skip
IN_THE_GALLERY = (
    "maxwell_step", "zener_step", "thin_sheet", "coating", "moving_line", "tyre_on_asphalt", "stability_map",
)  # fmt: skip
NOTEBOOK = "first_contact"
#: Picture of the gallery -> its text for readers who do not see it, and what to look for.
SEEN = {
    "quickstart-maps": (
        "Four maps of the contact pressure: spots of contact on an empty ground, more and larger from 50 ms to 500 ms",
        "The load is constant from 50 ms on. New spots appear and old ones spread, while the pressure in the first "
        "ones falls: creep turns a few highly loaded peaks into many. This holds for a dusty, wet or lubricated rubber; "
        "a clean, dry one would stick ([audit](howto/audit.md#example-the-quick-start)).",
    ),
    "quickstart-history": (
        "Five curves over time: force, approach, contact area, mean gap and work",
        "The force (a) stays constant after the ramp. The contact area (c) more than doubles afterwards and levels "
        "off within some retardation times of 0.1 s. Dots are kept times, lines all time steps.",
    ),
    "ball_on_rubber-section": (
        "Above, the pressure along a line through the centre, a rounded arch; below, the ball in the rubber surface",
        "The ball, below, touches the rubber over the orange arc. The pressure falls steeply at the edge of the contact, "
        "as Hertz predicts. Heights are enlarged.",
    ),
    "ball_on_rubber-history": (
        "Five curves over time: a constant force, and approach, contact area and work that rise and level off",
        "The load comes as a jump, so approach and contact area begin at their elastic values and then creep.",
    ),
    "load_sweep-sweep": (
        "Contact area against load at 10 ms and 510 ms, two rising lines that curve slightly downwards",
        "At the end of the ramp and after half a second of creep: the same curve, shifted up by about 40 %.",
    ),
    "load_sweep-histories": (
        "Contact area over time on a logarithmic axis, for loads of 10, 20 and 40 mN",
        "The area grows with the load until 10 ms. Then only creep increases it; a Maxwell material never stops.",
    ),
    "load_sweep-area": (
        "Contact area against force: three curves that coincide and then rise vertically at 10, 20 and 40 mN",
        "All loads follow one curve during the ramp, for which the material is nearly elastic. Each "
        "vertical part is creep under constant load.",
    ),
    "two_parameters-lines": (
        "Approach against load for six viscosities, at 10 ms and at 50 ms",
        "At 10 ms every viscosity has its own line. At 50 ms those up to 10 kPa s coincide: their creep is over. "
        "At 300 kPa s it has hardly begun.",
    ),
    "thickness_sweep-approach": (
        "Approach against thickness at three times: it rises with the thickness, most at the latest time",
        "Even a sheet of 1.6 mm, wider than the scan, is stiffer than a half-space. The thinner the sheet, "
        "the less it creeps.",
    ),
    "thickness_sweep-area": (
        "Contact area against thickness at three times: nearly horizontal rows of points",
        "The same cases: the contact area hardly depends on the thickness, because the waves that decide it are "
        "shorter than 0.1 mm.",
    ),
    "tack-work": (
        "Work against the time of retraction for three times of hold: three rising lines, the longest hold on top",
        "A longer hold lets the gel creep into contact and makes the separation more costly. So does a slower "
        "retraction, up to 3 s: the contact still grows while it is pulled.",
    ),
    "tack-force": (
        "Force and contact area against approach for one case: tension grows in the hold, and falls on retraction",
        "The approach is held at 60 nm, where the area grows more than threefold and the tension with it. On retraction "
        "the tension passes its largest value, the pull-off, and contact ends at 100 nm above first touch.",
    ),
    "stop_and_go-friction": (
        "Friction coefficient and contact area against distance, with jumps at 0.6 mm, the rest, and at 1.2 mm, "
        "the reversal",
        "During the rest at 0.6 mm the area grows and the friction decays. The second stroke begins with a peak of "
        "friction. At 1.2 mm the motion reverses; the stroke back settles at another value, because the surface is "
        "not symmetric.",
    ),
    "scan_to_area-area": (
        "Contact area against force: points above 5, 10 and 20 mN that rise with time, and four straight lines of "
        "two theories",
        "Each column is the creep under one load, from glassy to rubbery. The lines are theories for Gaussian "
        "roughness, for both moduli. The contact is larger, because this face has plateaus (skewness −0.7).",
    ),
    "creeping_seal-history": (
        "Six curves over a logarithmic time axis; the leak rate falls over five decades and becomes zero",
        "Approach (b) and mean gap (d) change by as much in each decade of time. The leak rate (f) hardly changes at "
        "first and then collapses: the seal closes when the last path does.",
    ),
    "creeping_seal-leakage": (
        "Four maps of the flow around the contact spots at 1 ms, 200 ms, 30 s and 40 s; at 40 s there is none",
        "Dark bands carry the flow from left to right. At 30 s one constriction, near the middle, carries the whole flow. "
        "At 40 s it is closed, although more than half of the area is not in contact.",
    ),
    "friction-curve": (
        "Friction coefficient and contact fraction against speed over six decades, computed and by Persson's theory",
        "Friction is small at both ends: in slow sliding the rubber has time to relax, in fast sliding it has no time "
        "to deform. The contact shrinks with speed as the rubber becomes stiffer.",
    ),
    "friction-maps": (
        "Four maps of the contact pressure at 0.1 mm/s, 10 mm/s, 1 m/s and 100 m/s, with fewer spots at each speed",
        "From slow to fast the contact shrinks to a few peaks, and the pressure rises 40 times: each map has its own "
        "scale.",
    ),
    "maxwell_step": (
        "Pressure against radius at four times, computed points on the lines of the closed form",
        "The pressure at the centre falls and the contact spreads. Late, the pressure is highest near the "
        "edge, where the material is loaded last.",
    ),
    "zener_step": (
        "Pressure against radius at four times for two Zener materials, computed points on the lines of the closed form",
        "Left, equal moduli: the pressure becomes the pressure of Hertz for the rubbery modulus. Right, a softer Kelvin "
        "element: a shoulder near the edge appears and fades.",
    ),
    "thin_sheet": (
        "Left, force over the force on a half-space against depth, up to 20; right, the deviation of a formula, "
        "down to -16 %",
        "A half-space model is wrong by a factor of two at a depth $x = 0.5$. The formula of AFM programs is good for "
        "shallow depths and up to 16 % too small for deep ones.",
    ),
    "coating": (
        "Left, a map of the compliance over wavelength and frequency; right, friction and contact fraction against "
        "speed for five thicknesses",
        "Left: waves up to twice as long as the thickness (dashed line) deform the coating alone. Right: a coating of "
        "20 µm acts nearly as a half-space; one of 2 µm has a quarter of its contact at low speed.",
    ),
    "moving_line": (
        "Left, work of a moving contact line against its speed: points near a rising and a falling line; right, "
        "pull-off against the time of hold for two speeds",
        "Left: a line that recedes fast needs more than the work of adhesion, one that advances gains less; nothing is "
        "fitted. Right: a fast pull-off remembers how long the contact was held, a slow one does not.",
    ),
    "tyre_on_asphalt": (
        "Friction against speed at five temperatures, temperature of the contact, and contribution of each decade of "
        "waves to friction",
        "Left: heat of sliding (solid against dashed) decides the friction above about 0.1 m/s. Right: "
        "waves below 10 µm contribute more than half of the friction at its peak.",
    ),
    "stability_map": (
        "A map of 81 squares over 24 decades of time and 16 of the ratio of moduli; all errors are below 1e-3",
        "Each square is a case. The error stays below the tolerance of 1e-3 everywhere; no case is refused.",
    ),
}  # fmt: skip


def draw_quickstart(path):
    """Maps of the study with which README begins."""
    with tempfile.TemporaryDirectory() as folder:
        ds = rv.run(WORKFLOWS / "quickstart.toml", folder, progress=False)
        save_changed(rv.plot.maps(ds), path, dpi=120)
        ds.close()


def draw_budget(path):
    """Sources of error of the contact area of the quick start, with the options of accuracy.md."""
    known = {"modulus_error": "10 %", "time_scale_error": "20 %", "cutoff": "0.25 um"}
    study = WORKFLOWS / "quickstart.toml"
    budget = rv.budget(study, **known, population="ensemble", workers=0, progress=False)
    print(budget)
    save_changed(rv.plot.budget(budget), path, dpi=100)


def draw_realisations(path):
    """Contact area of the quick start: the scan, and the mean and the band of 24 surrogates."""
    study = tomllib.loads((WORKFLOWS / "quickstart.toml").read_text(encoding="utf-8"))
    study["surface"]["file"] = str(ROOT / "surfaces" / "focus_variation.toml")
    study["sweep"] = {"realisations": 24}
    study["keep"]["fields"] = []
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "study.toml"
        file.write_text(study_text(study), encoding="utf-8")
        results = rv.sweep(file, folder, workers=0, progress=False)
        save_changed(rv.plot.sweep(results, along="time"), path, dpi=130)
        results.close()


def draw_trade(path):
    """Wall time against error of a ball on rubber, with the options of accuracy.md."""
    with tempfile.TemporaryDirectory() as folder:
        study = WORKFLOWS / "ball_on_rubber.toml"
        trade = rv.trade(study, out=folder, progress=False)
        save_changed(rv.plot.trade(trade, "approach"), path, dpi=100)


def draw_master(path):
    """Master curve of a made polymer, as in machine.md."""
    names = {"frequency": "Frequency", "storage": "E'", "loss": "E''", "temperature": "T [degC]"}
    polymer = rv.read_material(
        ROOT / "tests/study/study_file/exports/temperatures.csv", "dynamic_table", columns=names,
        kind="tensile", vertical="none", temperature="24.98 degC",  # one of those measured
    )  # fmt: skip
    save_changed(rv.plot.master_curve(polymer), path, dpi=140)


#: Figure in figures/ -> the function that draws it.
OTHERS = {
    "quickstart": draw_quickstart,
    "budget": draw_budget,
    "realisations": draw_realisations,
    "trade_ball": draw_trade,
    "master_curve": draw_master,
}


def leaking(ds):
    """The result with the leak rate of water under 1 bar, as ``roughvisc run`` adds it."""
    leak = rv.observables.leakage(ds, viscosity="1 mPa s", pressure_drop="1 bar")
    return ds.assign(leak.data_vars)


def by_load(results):
    """One entry a case, named by its load."""
    loads = results["program_0_load"].values
    return {f"{1e3 * load:g} mN": results.isel(case=i) for i, load in enumerate(loads)}


def save_changed(figure, path, dpi):
    """Write a figure as a small picture, unless the file has the same pixels already."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=dpi)
    replace_changed(Image.open(stream), path)


def replace_changed(drawn, path):
    """Write a picture, unless the file has the same pixels already."""
    picture = drawn.convert("RGB")
    if path.exists():
        with Image.open(path) as before:
            if (
                before.size == picture.size
                and before.convert("RGB").tobytes() == picture.tobytes()
            ):
                return
    picture.save(path, optimize=True)


def draw_study(name):
    """Run one study and write its figures, small."""
    study = WORKFLOWS / f"{name}.toml"
    with tempfile.TemporaryDirectory() as results:
        swept = "sweep" in tomllib.loads(study.read_text(encoding="utf-8"))
        if swept:
            ds = rv.sweep(study, results, workers=0, progress=False)
        else:
            ds = rv.run(study, results, progress=False)
        for kind, figure in FIGURES[name].items():
            save_changed(figure(ds), HERE / "gallery" / f"{name}-{kind}.png", dpi=100)
            ds.close()
    xr.backends.file_manager.FILE_CACHE.clear()


def draw_by_script(name):
    """Run the script of one figure."""
    script, *arguments = SCRIPTS[name]
    if missing := [one for one in arguments if "." in one and not Path(one).exists()]:
        print(
            f"{name} is left as it is: {missing[0]} is not in this folder (see docs/measured.md)"
        )
        return False
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{name}.png"
        subprocess.run([sys.executable, WORKFLOWS / script, *arguments, path], check=True)
        with Image.open(path) as drawn:
            replace_changed(drawn, HERE / "figures" / path.name)
    return True


def run_notebook():
    """Run the notebook, and keep its outputs in it."""
    import nbformat
    from nbclient import NotebookClient

    path = HERE / f"{NOTEBOOK}.ipynb"
    notebook = nbformat.read(path, as_version=4)
    NotebookClient(
        notebook, timeout=300, resources={"metadata": {"path": str(path.parent)}}
    ).execute()
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)  # when it ran
    nbformat.write(notebook, path)


def drawing_code():
    """Return what draws each picture: its path -> its name, the syntax tree of the code, the study or None."""
    here = ast.parse(Path(__file__).read_text(encoding="utf-8"))
    functions = {node.name: node for node in here.body if isinstance(node, ast.FunctionDef)}
    assigned = {
        node.targets[0].id: node.value for node in here.body if isinstance(node, ast.Assign)
    }
    studies = dict(zip(FIGURES, assigned["FIGURES"].values, strict=True))
    code = {}
    for name, figures in FIGURES.items():
        for kind, figure in zip(figures, studies[name].values, strict=True):
            code[f"gallery/{name}-{kind}.png"] = (name, figure, WORKFLOWS / f"{name}.toml")
    for name, draw in OTHERS.items():
        code[f"figures/{name}.png"] = (name, functions[draw.__name__], None)
    for name, (script, *_) in SCRIPTS.items():
        tree = ast.parse((WORKFLOWS / script).read_text(encoding="utf-8"))
        code[f"figures/{name}.png"] = (name, tree, None)
    cells = json.loads((HERE / f"{NOTEBOOK}.ipynb").read_text(encoding="utf-8"))["cells"]
    lines = [
        line for cell in cells if cell["cell_type"] == "code" for line in [*cell["source"], "\n"]
    ]
    tree = ast.parse("".join(line for line in lines if not line.startswith("%")))
    return code | {f"{NOTEBOOK}.ipynb": (NOTEBOOK, tree, None)}


def digests(names=None):
    """Return the digest of the code of each picture, or of the pictures of some names."""
    return {
        path: picture_age.digest_of(code, study)
        for path, (name, code, study) in drawing_code().items()
        if names is None or name in names
    }


def page():
    """Text of the gallery."""
    lines = [
        "# Gallery",
        "",
        "Every study of `workflows/`, with its figures. `python docs/make_gallery.py` runs the studies and draws them.",
        "",
        f"From a scan to real contact area at three temperatures, in Python: [a notebook]({NOTEBOOK}.ipynb).",
        "",
    ]
    for name, figures in FIGURES.items():
        text = (WORKFLOWS / f"{name}.toml").read_text(encoding="utf-8")
        lines += section(tomllib.loads(text)["title"], f"roughvisc run workflows/{name}.toml")
        for kind in figures:
            lines += shown(f"{name}-{kind}", f"gallery/{name}-{kind}.png")
    for name in IN_THE_GALLERY:
        code = (WORKFLOWS / f"{name}.py").read_text(encoding="utf-8")
        summary = ast.get_docstring(ast.parse(code)).partition("\n")[0]
        lines += section(summary.rstrip("."), f"python workflows/{name}.py")
        lines += shown(name, f"figures/{name}.png")
    return "\n".join(lines)


def section(title, command):
    """Return the heading and the command of a section of the gallery, as lines."""
    return [f"## {title}", "", "```sh", command, "```", ""]


def shown(name, path):
    """Return a picture with its caption, as lines."""
    alternative, caption = SEEN[name]
    return [f"![{alternative}]({path})", "", f"*{caption}*", ""]


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    every = [*dict.fromkeys([*FIGURES, *SCRIPTS, *OTHERS, NOTEBOOK])]
    parser.add_argument("names", nargs="*", metavar="NAME", help="one of " + ", ".join(every))
    parser.add_argument(
        "--as-they-are", action="store_true", help="record the code without drawing"
    )
    options = parser.parse_args()
    if unknown := set(options.names) - set(every):
        parser.error(f"unknown: {', '.join(sorted(unknown))}")
    os.environ.setdefault("MPLBACKEND", "agg")
    (HERE / "gallery").mkdir(exist_ok=True)
    names = options.names or every
    if options.as_they_are:
        picture_age.record(digests(names))
        names = []
    for name in names:
        is_drawn = True
        if FIGURES.get(name):
            draw_study(name)
        if name in OTHERS:
            OTHERS[name](HERE / "figures" / f"{name}.png")
        if name in SCRIPTS:
            is_drawn = draw_by_script(name)
        if name == NOTEBOOK:
            run_notebook()
        if is_drawn:
            picture_age.record(digests({name}))
    (HERE / "gallery.md").write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
