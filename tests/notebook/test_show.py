"""What notebooks show of runs, sweeps and fragments, and what stands there without a notebook."""

import base64
import io
import re
import shutil

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from PIL import Image

import snowrepro as api
from snowrepro.errors import ConfigError, DataError, StoreError
from snowrepro.notebook.arguments import name_arguments
from snowrepro.settings.config import Config
from snowrepro.store.run import Run
from snowrepro.sweep import record
from snowrepro.sweep.plan import make_plan
from tests.configs import changed
from tests.conftest import SMALL
from tests.report import small_runs

VARIED = ["sintering=paper,none", "pressure=500,3000,9000"]  # the last of them is not run
EVIL = "<script>alert(1)</script>"


@pytest.fixture(scope="module")
def store(small_run: xr.Dataset, tmp_path_factory):
    """A store with a sweep called mine: four finished runs, and two that were never run."""
    folder = tmp_path_factory.mktemp("store")
    small_runs.saved(small_run, folder, vanish=False)
    recorded = record.write_record(make_plan([*SMALL, *VARIED, f"store={folder}"], multirun=True))
    shutil.copytree(recorded, recorded.with_name("mine"))  # under a shorter name
    return folder


def pictures(html: str) -> list[Image.Image]:
    """The pictures that are part of a page."""
    found = re.findall(r'<img src="data:image/\w+;base64,([^"]+)" alt="[^"]+"', html)
    return [Image.open(io.BytesIO(base64.b64decode(text))) for text in found]


def test_a_run_in_memory(small_run, small_config):
    """Its scene, a sentence with the numbers of its row, the last frame, and units."""
    view, row = api.show(small_run), api.summarise(small_run)
    text = str(view)
    assert "ball on L, pressure 3000 kg cell⁻¹ s⁻², sintering" in text
    assert f"{row['lump_fraction']:.0%} of the mass is in {row['lumps']} lump".replace("%", " %") in text
    assert f"part of the mass in lumps: {row['lump_fraction']:.4g}" in text
    assert re.search(r"largest speed of a particle while falling: [\d.]+ cells/s", text)
    assert Run(small_config).id in text
    html = view._repr_html_()
    assert all(line.strip().partition(":")[0] in html for line in text.splitlines()[:2])
    (picture,) = pictures(html)
    assert picture.width > 300


def test_a_hardness_test(indented_run):
    """It has no lumps to speak of; its hardness is there."""
    text, row = str(api.show(indented_run)), api.summarise(indented_run)
    assert f"The snow has a hardness of {row['hardness']:,.0f} kg cell⁻¹ s⁻²" in text
    assert "lumps" not in text and "nan" not in text


def test_a_stored_run_by_its_id_and_path(store):
    """All of its names show the same."""
    run_id = next(path.name for path in store.iterdir() if path.name.startswith("ball-L-3000-paper"))
    views = [
        api.show(run_id, store=store),
        api.show(store / run_id),
        api.show(str(store / run_id / "run.nc")),
        api.show(api.open_run(run_id, store)),
    ]
    assert len({view.html for view in views}) == 1 and run_id in views[0].text


def test_numbers_of_a_stored_run_by_its_id(store, monkeypatch):
    """Whole, its end, and its path give what the opened run gives; a name of none, or of several, is refused."""
    run_id = next(path.name for path in store.iterdir() if path.name.startswith("ball-L-3000-paper"))
    opened = api.open_run(run_id, store)
    monkeypatch.chdir(store.parent)
    for name in (run_id, run_id[-10:]):
        assert api.summarise(name, store=store) == api.summarise(opened)
        assert api.classify(name, store=store).measures() == api.classify(opened).measures()
    assert api.summarise(store / run_id)["run_id"] == run_id
    with pytest.raises(StoreError, match="there is no run 'nothing'"):
        api.summarise("nothing", store=store)
    with pytest.raises(ConfigError, match="should name one run"):
        api.classify("ball", store=store)


def test_errors_name_the_arguments_of_python(small_run):
    """Not the options of the command line."""
    with pytest.raises(ConfigError, match=r"^speed= should be above 0 and at most"):
        api.animate(small_run, speed=-1)
    with pytest.raises(ConfigError, match=r"^start= should be a frame from 0 to 60 \(got 61\)"):
        api.animate(small_run, start=61)
    with pytest.raises(ConfigError, match=r"^speed= of 0.0001 makes a picture last [\d,]+ s, and 600 s is the most$"):
        api.animate(small_run, speed=0.0001)
    with pytest.raises(DataError, match=r"give the frame .* with release=, or as the attribute"):
        api.classify(np.zeros((3, 5, 2)))
    with pytest.raises(DataError, match=r"no variable 'q' that can be read \(position=\)"):
        api.classify(small_run, position="q")
    assert name_arguments("or none, --id none") == 'or none, particle_id="none"'
    assert name_arguments("more than 9: lower --fps or raise --speed") == "more than 9: raise speed="


def test_a_sweep_by_its_table(store):
    """The picture is that of the sweep, with its units; some of its rows and own columns are drawn too."""
    table = api.sweep_table("mine", store)
    figures = [api.plot(data, x="pressure", store=store).figure for data in ("mine", table)]
    assert len({figure.get_suptitle() for figure in figures}) == 1
    assert len({figure._supxlabel.get_text() for figure in figures}) == 1
    assert "kg cell⁻¹ s⁻²" in figures[1]._supxlabel.get_text()
    assert api.plot(table).to_png() == api.plot("mine", store=store).to_png()
    part = table[table["sintering"] == "paper"].assign(rest=1 - table["lump_fraction"])
    assert "rest" in api.plot(part, y="rest").figure._supylabel.get_text()
    grid = api.open_sweep("mine", store).to_dataframe()
    assert "mass in lumps" in api.plot(grid).figure._supylabel.get_text()
    with pytest.raises(ConfigError, match=r"this table is not of a sweep.*it has no run_id"):
        api.plot(pd.DataFrame({"a": [1]}))
    with pytest.raises(ConfigError, match="by and frame are for runs"):
        api.plot(table, by="snow")


def test_a_sweep_by_its_name_its_grid_and_its_table(store):
    """A row for each run with what varies, its state, and numbers as the table has them."""
    table = api.sweep_table("mine", store)
    for view in (
        api.show("mine", store=store),
        api.show(api.open_sweep("mine", store)),
        api.show(table),
    ):
        assert "6 runs: " in view.text and "4 done" in view.text and "2 pending" in view.text
        assert "What varies: pressure, sintering." in view.text
        html = view._repr_html_()
        assert html.count("<tr>") == 7
        for fraction in table["lump_fraction"].dropna():
            assert f">{fraction:.4g}</td>" in html
        assert "nan" not in html


def test_fragments(small_run):
    """The heaviest come first; the sentence is that of the run."""
    found = api.classify(small_run)
    html = found._repr_html_()
    masses = [float(text) for text in re.findall(r">(?:lump|crushed|loose)</td><td[^>]*>([\d.]+)</td>", html)]
    assert masses == sorted(masses, reverse=True)
    table = found.table().sort_values("mass", ascending=False, kind="stable")
    assert masses[0] == pytest.approx(100 * table["mass"].iloc[0] / table["mass"].sum(), abs=0.051)
    assert f"frame {found.last.frame}" in html and f"{found.lump_fraction:.0%}".replace("%", " %") in html
    assert api.show(found).html == html
    assert "array" not in repr(found) and len(repr(found)) < 200


def test_particles_of_another_code_in_3d(tmp_path):
    """What had to be assumed is said; a part that has vanished counts as neither."""
    places = np.stack(np.meshgrid(*[np.arange(4.0)] * 3), axis=-1).reshape(1, -1, 3).repeat(3, axis=0)
    places[2, :16] = np.nan
    found = api.classify(places, release=0, mass=1.0)
    html = found._repr_html_()
    assert "25 % is no longer there" in html
    assert html.count("Assumed: ") == len(found.assumed) > 0
    assert "centre z" in html


@pytest.mark.parametrize("where", ["unit", "sweep", "state", "reason"])
def test_text_from_data_is_no_html(small_run, where):
    """Wherever it stands."""
    if where == "unit":
        data = small_run.copy()
        data["position"].attrs["units"] = EVIL
        html = api.classify(data)._repr_html_()
    else:
        row = {"pressure": [1, EVIL], "run_id": "a", "state": "failed", "reason": "", "lumps": 1.0}
        row[where if where != "sweep" else "run_id"] = EVIL
        html = api.show(pd.DataFrame(row)).html
    assert "<script>" not in html
    assert "&lt;script&gt;" in html


def test_what_is_no_run_is_refused(store, tmp_path):
    """By a message that says what there is."""
    with pytest.raises(ConfigError, match=r"no run 'nothing' .* there are: .*mine"):
        api.show("nothing", store=store)
    with pytest.raises(ConfigError, match="not of a sweep"):
        api.show(pd.DataFrame({"pressure": [1.0]}))
    with pytest.raises(ConfigError, match="no run of snowrepro"):
        api.show(xr.Dataset({"x": ("t", [1.0])}))


def test_a_plot_of_any_stored_frame(small_run, tmp_path):
    """The film's colours; a frame that is not stored, and a wrong name, are refused with the right ones."""
    plots = [api.plot(small_run, by=by, frame=20) for by in ("fragment", "snow", "density", "J_P", "damage")]
    contents = [plot.to_png() for plot in plots]
    assert len({*contents}) == 5
    assert contents[0] == api.plot(small_run, frame=20).to_png()
    assert contents[0] != api.plot(small_run).to_png()
    plots[2].save(tmp_path / "density.svg")
    assert "<svg" in (tmp_path / "density.svg").read_text(encoding="utf-8")
    with pytest.raises(ConfigError, match=r"frame: 21 is not stored; the nearest that is: 20"):
        api.plot(small_run, frame=21)
    with pytest.raises(ConfigError, match=r"by: should be snow, fragment.* \(got 'colour'\)"):
        api.plot(small_run, by="colour")
    with pytest.raises(ConfigError, match="x, y, colour, panel and log are for sweeps"):
        api.plot(small_run, x="pressure")
    with pytest.raises(ConfigError, match=r"should end in \.png"):
        plots[0].save(tmp_path / "plot.html")
    assert [path.name for path in tmp_path.iterdir()] == ["density.svg"]


def test_a_plot_of_a_sweep(store):
    """By its name and as a grid; columns that there are not, and what is for runs alone, are refused."""
    words = {"x": "pressure", "y": "lump_fraction", "colour": "sintering"}
    named = api.plot("mine", **words, store=store)
    assert named.to_png() == api.plot(api.open_sweep("mine", store), **words, store=store).to_png()
    assert named.to_png() != api.plot("mine", y="broken_bonds", store=store).to_png()
    assert named.description.startswith("lump_fraction over pressure of the sweep")
    with pytest.raises(ConfigError, match="has no column 'presure'; did you mean 'pressure'"):
        api.plot("mine", x="presure", store=store)
    with pytest.raises(ConfigError, match="by and frame are for runs"):
        api.plot("mine", by="density", store=store)


def test_a_film_of_a_run_in_memory(small_run, tmp_path, monkeypatch):
    """It is a gif inside the page and in the file, and leaves nothing else."""
    monkeypatch.chdir(tmp_path)
    film = api.animate(small_run, by="snow", width=200, start=48)
    (picture,) = pictures(film._repr_html_())
    assert picture.n_frames == 4 and picture.width == 200
    film.save("film.gif")
    assert [path.name for path in tmp_path.iterdir()] == ["film.gif"]
    assert (tmp_path / "film.gif").read_bytes() == film.content
    with pytest.raises(ConfigError, match=r"should end in \.gif"):
        film.save("film.mp4")


def test_films_of_several_runs(store, small_run):
    """A sweep by its name has a place for each run; a list has one for each of its own."""
    sweep = api.animate("mine", store=store, width=300, start=56)
    first = next(path.name for path in store.iterdir() if path.name.startswith("ball-L-500-paper"))
    both = api.animate([first, small_run], store=store, width=300, start=56)
    heights = [pictures(film._repr_html_())[0].height for film in (sweep, both)]
    assert heights[0] != heights[1]
    assert "ball on L" in both.description
    with pytest.raises(ConfigError, match=r"there are: .*mine"):
        api.animate("nothing", store=store)
    with pytest.raises(ConfigError, match="format: should be gif or mp4"):
        api.animate(small_run, format="webm")


def test_a_config_of_other_settings(small_run, small_config: Config, tmp_path):
    """The store that a run was kept in is of no matter to what is shown."""
    other = Run(changed(small_config, store=str(tmp_path)))
    path = other.save(small_run, wall_seconds=1.0)
    assert str(tmp_path) not in api.show(path).text
