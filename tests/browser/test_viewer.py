"""The viewer in a browser: what it counts is what Python counts, and hands and keys reach all of it."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from jinja2 import Environment, FileSystemLoader
from matplotlib.colors import to_rgb

from snowrepro.analysis.states import STATES
from snowrepro.report.drawing.common import FLOOR, SKY
from snowrepro.report.drawing.states import CRUSHED, LOOSE, LUMPS, colour_fragments
from snowrepro.report.viewer import scripts, viewer
from snowrepro.summary.classify import classify
from snowrepro.summary.row import read_row
from tests.report import small_runs

TEMPLATES = Path(viewer.__file__).parents[1] / "templates"
HARNESS = """<!doctype html><html lang="en"><head><meta charset="utf-8"><title>Viewer</title>
<meta name="viewport" content="width=device-width"><style>{{ css | safe }}</style></head>
<body><main><h1>Viewer</h1>{% include "viewer.html.j2" %}</main>
<script type="module">{{ js | safe }}</script></body></html>"""
# Time and pictures by hand: what was asked to be done with the next picture is done when time passes.
STEPPED = """
  const waiting = new Map();
  let [now, last] = [0, 0];
  performance.now = () => now;
  window.requestAnimationFrame = (act) => (waiting.set(++last, act), last);
  window.cancelAnimationFrame = (id) => waiting.delete(id);
  window.passTime = (milliseconds) => {
    now += milliseconds;
    for (const id of [...waiting.keys()]) {
      const act = waiting.get(id);
      waiting.delete(id);
      if (act) act(now);
    }
  };
"""
# Reads the numbers from the table of runs, or from the captions of the pictures.
NUMBERS = "cells => cells.map(cell => Number(cell.value))"
RUNS = "#viewer-runs data"


@pytest.fixture(scope="module")
def runs(small_run, tmp_path_factory):
    """Four finished runs: sintered and not at two pressures; of the last, particles vanish."""
    return small_runs.saved(small_run, tmp_path_factory.mktemp("store"))


@pytest.fixture(scope="module")
def shown(runs, tmp_path_factory):
    """A page with nothing but the viewer, and what it was given."""
    made = viewer.embed_runs(runs, 10**7)
    template = Environment(loader=FileSystemLoader(TEMPLATES), autoescape=True).from_string(HARNESS)
    text = template.render(viewer=made, css=(TEMPLATES / "viewer.css").read_text(), js=scripts.join_scripts())
    path = tmp_path_factory.mktemp("page") / "viewer.html"
    path.write_text(text, encoding="utf-8")
    return path, json.loads(made.data)


@pytest.fixture
def opened(page, shown):
    """The viewer, unpacked."""
    page.goto(shown[0].as_uri())
    page.wait_for_selector("#viewer-body", state="visible")
    return page


@pytest.fixture
def stepped(page, shown):
    """The viewer on a page whose time stands still but for ``passTime``, however busy the machine is."""
    page.add_init_script(STEPPED)
    page.goto(shown[0].as_uri())
    page.wait_for_selector("#viewer-body", state="visible")
    page.evaluate("passTime(50), passTime(50)")
    return page


def released(data: dict) -> list[int]:
    """The embedded frames from the release on."""
    return [frame for frame, shares in zip(data["frames"], data["runs"][0]["shares"], strict=True) if shares]


@pytest.fixture(scope="module")
def datasets(runs):
    """The runs' results."""
    return [run.open().load() for run in runs]


def put(page, name: str, place: int) -> None:
    """Move a slider by keys, from its start."""
    slider = page.locator(f"#viewer-{name}")
    slider.press("Home")
    for _ in range(place):
        slider.press("ArrowRight")


def numbers(page, selector: str = RUNS) -> list[float]:
    """Numbers shown, with all their digits."""
    return page.eval_on_selector_all(selector, NUMBERS)


def test_it_comes_up_as_the_report_has_it(opened, runs):
    """At the last frame, with the numbers of the report to the last digit; three digits are read."""
    rows = [read_row(run) for run in runs]
    expected = [row[f"{state}_fraction"] for row in rows for state in STATES]
    assert numbers(opened) == expected
    assert opened.eval_on_selector_all(RUNS, "all => all.map(one => one.textContent)") == [f"{v:.3f}" for v in expected]
    assert opened.locator("#viewer-runs td:last-child").all_inner_texts() == [str(row["lumps"]) for row in rows]


def test_frames_are_stepped_through_and_each_is_exact(opened, shown, datasets):
    """Arrows on a picture move both pictures by a frame; from the release on each shows Python's shares there."""
    data = shown[1]
    opened.select_option("#viewer-run-left", "0")
    opened.select_option("#viewer-run-right", "3")
    canvas = opened.locator("#viewer-canvas-left")
    canvas.press("Home")
    right = [classify(dataset, frames=released(data)).fragments for dataset in datasets]
    for frame in data["frames"]:
        opened.wait_for_function(f"document.getElementById('viewer-time-now').value.startsWith('frame {frame},')")
        here = [[share for f in found if f.frame == frame for share in f.shares.values()] for found in right]
        for side, run in (("left", 0), ("right", 3)):
            caption = opened.locator(f"#viewer-caption-{side}")
            assert caption.inner_text().startswith(f"Frame {frame}:")
            assert numbers(opened, f"#viewer-caption-{side} data") == here[run]
        assert numbers(opened) == [share for shares in here for share in shares]
        canvas.press("ArrowRight")


def test_it_plays_both_pictures_in_step(stepped):
    """Space on a picture plays from the start, and again stops; what stands below the pictures is one frame."""
    canvas = stepped.locator("#viewer-canvas-right")
    stepped.select_option("#viewer-speed", "0.2")
    canvas.press("Space")
    assert stepped.inner_text("#viewer-play") == "Stop"
    times = [pass_moment(stepped) for _ in range(10)]
    assert len(set(times)) == 10
    canvas.press("Space")
    assert stepped.inner_text("#viewer-play") == "Play"
    stopped = pass_moment(stepped)
    frames = [re.match(r"Frame (\d+)", stepped.inner_text(f"#viewer-caption-{side}"))[1] for side in ("left", "right")]
    assert frames[0] == frames[1]
    assert pass_moment(stepped) == stopped


def test_it_plays_to_the_end(opened, shown):
    """And stops there by itself."""
    put(opened, "time", len(shown[1]["frames"]) - 3)
    opened.click("#viewer-play")
    opened.wait_for_function("document.getElementById('viewer-play').textContent === 'Play'")
    last = len(shown[1]["frames"]) - 1
    opened.wait_for_function(f"document.getElementById('viewer-time').value === '{last}'")  # drawn a moment later


def pass_moment(page) -> str:
    """Let 90 ms pass on a ``stepped`` page, in two pictures, which ends at no frame; returns the time shown."""
    page.evaluate("passTime(45), passTime(45)")
    return page.inner_text("#viewer-time-now")


def played(page, moments: int) -> list[str]:
    """Play a ``stepped`` page, then stop; the time shown after each moment."""
    page.click("#viewer-play")
    assert page.inner_text("#viewer-play") == "Stop"
    seen = [pass_moment(page) for _ in range(moments)]
    page.click("#viewer-play")
    return seen


def test_where_motion_is_unwanted_frames_change_one_by_one(stepped, shown):
    """With reduced motion no picture lies between two frames."""
    data = shown[1]
    frames = [f"frame {frame}, {second:.2f} s" for frame, second in zip(data["frames"], data["seconds"], strict=True)]
    stepped.emulate_media(reduced_motion="reduce")
    stepwise = played(stepped, moments=25)
    assert list(dict.fromkeys(stepwise)) == frames[:4], "each frame in its turn and nothing between"
    assert min(stepwise.count(frame) for frame in frames[:3]) >= 6, "each stands for more than half a second"
    stepped.emulate_media(reduced_motion="no-preference")
    smooth = played(stepped, moments=5)
    assert len(set(smooth)) == 5 and not set(smooth) & set(frames), "else pictures do lie between two frames"


def colours_in(page, side: str) -> set[tuple[int, int, int]]:
    """Colours of at least a few pixels of a picture."""
    page.evaluate("() => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn)))")
    pixels = page.evaluate(
        """side => {
          const canvas = document.getElementById(`viewer-canvas-${side}`);
          const {data} = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
          const count = {};
          for (let i = 0; i < data.length; i += 4) {
            const key = data.slice(i, i + 3).join();
            count[key] = (count[key] || 0) + 1;
          }
          return Object.entries(count).filter(([, n]) => n > 20).map(([key]) => key);
        }""",
        side,
    )
    return {tuple(map(int, key.split(","))) for key in pixels}


def rgb(colour: str) -> tuple[int, ...]:
    """As a canvas gives it."""
    return tuple(round(255 * part) for part in to_rgb(colour))


def test_lumps_have_the_colours_of_the_pictures(opened, shown, datasets):
    """At the end the same colours are there as in Python's pictures of the same frames."""
    data = shown[1]
    opened.select_option("#viewer-run-left", "1")
    expected = colour_fragments(classify(datasets[1], frames=released(data)))[-1]
    common = {
        name for name, count in zip(*np.unique(expected.astype(str), return_counts=True), strict=True) if count > 40
    }
    found = colours_in(opened, "left")
    assert {rgb(name) for name in common} <= found
    assert {rgb(SKY), rgb(FLOOR)} <= found
    assert rgb(CRUSHED) in found
    unseen = set(LUMPS) - set(expected)
    assert not {rgb(name) for name in unseen} & found


def test_legends_name_states_and_units(opened, shown):
    """The three states in words; a field's scale with its unit, in shades that are not those of states."""
    assert opened.inner_text("#viewer-legend").split("\n")[0].startswith("lumps, a colour each")
    assert all(word in opened.inner_text("#viewer-legend") for word in ("crushed", "loose"))
    for colour, unit in (("density", "kg cell⁻³"), ("J_P", "J_P")):
        opened.select_option("#viewer-colour", colour)
        legend = opened.inner_text("#viewer-legend")
        assert unit in legend and len(re.findall(r"\d", legend)) >= 3
        assert not {rgb(name) for name in (*LUMPS, CRUSHED, LOOSE)} & colours_in(opened, "left")
        assert {rgb(name) for name in shown[1]["colours"]["shades"]} & colours_in(opened, "left")


def test_one_picture_alone(opened):
    """The right one can be put away."""
    opened.select_option("#viewer-run-right", "")
    opened.wait_for_selector("#viewer-canvas-right", state="hidden")
    assert opened.is_visible("#viewer-canvas-left")


def test_a_phone_has_room(opened):
    """At 360 pixels nothing sticks out, and the pictures stand one below the other."""
    opened.set_viewport_size({"width": 360, "height": 740})
    assert opened.evaluate("document.documentElement.scrollWidth") <= 360
    left, right = (opened.locator(f"#viewer-canvas-{side}").bounding_box() for side in ("left", "right"))
    assert right["y"] > left["y"] + left["height"] and left["width"] > 280


def test_without_javascript_a_sentence_stands_there(browser, shown):
    """And nothing that does not work."""
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(shown[0].as_uri())
    assert "needs JavaScript" in page.inner_text("main")
    assert not page.is_visible("#viewer")
    context.close()


def test_everybody_can_use_it(opened):
    """axe, which checks names, roles and contrast, finds nothing."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    for colour in ("state", "J_P"):
        opened.select_option("#viewer-colour", colour)
        found = axe.Axe().run(opened)
        assert not found.response["violations"], found.generate_report()
