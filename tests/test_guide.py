"""What a contributor adds is in every place that the guide names: docs/development.md."""

import inspect
import re

import numpy as np
from click.testing import CliRunner
from samples import OF_EACH_KIND
from test_docs import DOCS, PAGES
from topography.test_misreadings import WRITERS

import roughvisc as rv
from roughvisc.cli import main
from roughvisc.mechanics.materials import MODELS
from roughvisc.plot.save import DEFAULT, FIGURES
from roughvisc.topography.formats import READERS

#: Formats of this package for which tests have real files only.
FROM_FILES = {"tmd", "sur"}
#: Meshes, which have a test of their own.
MESHES = {"stl", "ply"}


def test_model__has_a_sample_and_its_own_section():
    page = (DOCS / "study-files.md").read_text(encoding="utf-8")
    lacking = {name: "tests/samples.py" for name in MODELS if name not in OF_EACH_KIND}
    lacking |= {name: "study-files.md" for name in MODELS if f"### `{name}`" not in page}
    assert lacking == {}


def test_format__is_damaged_by_a_test():
    written = {kind.split()[0] for kind in WRITERS}
    unwritten = {name for name, (suffixes, _) in READERS.items() if suffixes and not written & set(suffixes)}
    assert unwritten <= FROM_FILES | MESHES, "WRITERS of test_misreadings.py"


def test_figure__is_in_the_gallery_or_on_a_page_and_has_what_the_command_needs(docs_script):
    texts = [path.read_text(encoding="utf-8") for path in PAGES if path.stem != "reference"]
    texts += [inspect.getsource(docs_script("make_gallery")), (DOCS / "first_contact.ipynb").read_text()]
    shown = "".join(texts)
    assert {name for name in rv.plot.__all__ if not re.search(rf"plot[._]{name}\b", shown)} == set()
    assert set(DEFAULT) <= set(FIGURES)
    shown = CliRunner().invoke(main, ["plot", "--help"]).output
    assert {name for name in FIGURES if name not in DEFAULT and name not in shown} == set()
    for draw, needed, caption in FIGURES.values():
        assert callable(draw)
        assert needed
        assert caption.endswith(".")


def test_picture__is_written_only_if_it_changed(docs_script, tmp_path):
    save_changed = docs_script("make_gallery").save_changed
    figure, (ax,) = rv.plot.style.new_panels(1, 1, (1.0, 1.0), projection="polar")
    assert ax.name == "polar"
    path = tmp_path / "a.png"
    save_changed(figure, path, 50)
    content = path.read_bytes()
    path.touch()
    stamp = path.stat().st_mtime_ns
    save_changed(figure, path, 50)
    assert path.stat().st_mtime_ns == stamp
    ax.plot(np.linspace(0, 6, 9), np.ones(9))
    save_changed(figure, path, 50)
    assert path.read_bytes() != content
