"""The viewer in a browser: what it counts is what Python counts, and hands and keys reach all of it."""

import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from jinja2 import Environment, FileSystemLoader
from matplotlib.colors import to_rgb

from snowrepro.evidence import claims
from snowrepro.report.drawing.common import FLOOR, SKY
from snowrepro.report.drawing.states import LUMPS, colour_fragments
from snowrepro.report.viewer import scripts, viewer
from snowrepro.summary.classify import classify
from tests.report import small_runs

TEMPLATES = Path(viewer.__file__).parents[1] / "templates"
HARNESS = """<!doctype html><html lang="en"><head><meta charset="utf-8"><title>Viewer</title>
<meta name="viewport" content="width=device-width"><style>{{ css | safe }}</style></head>
<body><main><h1>Viewer</h1>{% include "viewer.html.j2" %}</main>
<script type="module">{{ js | safe }}</script></body></html>"""
CLOSE = 1e-12  # two ways to add the same masses up
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
# Reads a number from each row of the table of runs, or from the captions of the pictures.
NUMBERS = "cells => cells.map(cell => Number(cell.value))"
NOW = "#viewer-runs td:nth-child(2) data"


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


def numbers(page, selector: str = NOW) -> list[float]:
    """Numbers shown, with all their digits."""
    return page.eval_on_selector_all(selector, NUMBERS)


def told(page) -> dict[str, str]:
    """What is said of each claim under the present settings."""
    rows = page.eval_on_selector_all("#viewer-claims tr", "rows => rows.map(r => [...r.cells].map(c => c.textContent))")
    return {text.split(":")[0]: now for text, now, _ in rows}


def pointing(runs, data, fractions) -> dict[str, str]:
    """The same by Python."""
    columns = pd.MultiIndex.from_tuples([(run.case.arm, run.case.pressure) for run in runs])
    means = pd.DataFrame([fractions], columns=columns)
    judged = [claim for claim in runs[0].config.question.claims.list if claim.test != "scenes"]
    return {c.name: "agree" if claims.check_agreement(c, means).iloc[0] else "disagree" for c in judged}


def test_it_comes_up_as_the_report_has_it(opened, shown, runs, datasets):
    """Without a touch the numbers are the report's, and the claims are judged by them."""
    usual = [classify(dataset).lump_fraction for dataset in datasets]
    assert numbers(opened) == pytest.approx(usual, abs=CLOSE)
    assert numbers(opened, "#viewer-runs td:nth-child(3) data") == pytest.approx(usual, abs=CLOSE)
    assert told(opened) == pointing(runs, shown[1], usual)
    assert "(the report's)" in opened.inner_text("#viewer-strain-now")


@pytest.mark.parametrize(
    ("sign", "core", "step", "mass"),
    [("both", 0.3333, 3, 5), ("both", 0.25, 30, 0), ("stretch", 0.5, 20, 30), ("crush", 0.3333, 41, 12),
     ("stretch", 0.25, 60, 5), ("crush", 1.0, 10, 20), ("both", 0.5, 80, 40)],
)  # fmt: skip
def test_lumps_are_those_of_python(opened, shown, datasets, sign, core, step, mass):
    """Any setting, chosen by keys, gives what classify gives: with vanished particles and unequal masses too."""
    data = shown[1]
    opened.select_option("#viewer-sign", str(data["signs"].index(sign)))
    opened.select_option("#viewer-core", str(data["cores"].index(core)))
    put(opened, "strain", step)
    put(opened, "mass", mass)
    settings = {"break_by": sign, "core_fraction": core, "lump_mass": data["lump_masses"][mass]}
    right = [classify(dataset, break_strain=data["ladder"][step], **settings).lump_fraction for dataset in datasets]
    assert numbers(opened) == pytest.approx(right, abs=CLOSE)


def test_the_settings_matter(shown, datasets):
    """The runs of these tests tell settings apart, so that agreement says something."""
    found = {
        classify(datasets[0], break_strain=strain, break_by=sign, core_fraction=core).lump_fraction
        for strain in shown[1]["ladder"][::20]
        for sign in shown[1]["signs"]
        for core in shown[1]["cores"]
    }
    assert len(found) > 20


def test_the_mouse_moves_the_threshold_and_claims_turn(opened, shown, runs, datasets):
    """Dragged from end to end, numbers and claims follow Python's; some claim turns; reset brings the report back."""
    usual, seen = numbers(opened), set()
    box = opened.locator("#viewer-strain").bounding_box()
    y = box["y"] + box["height"] / 2
    opened.mouse.move(box["x"] + box["width"] * 0.5, y)
    opened.mouse.down()
    for part in (0.02, 0.2, 0.4, 0.6, 0.8, 0.98):
        opened.mouse.move(box["x"] + box["width"] * part, y)
        strain = shown[1]["ladder"][int(opened.input_value("#viewer-strain"))]
        right = [classify(dataset, break_strain=strain).lump_fraction for dataset in datasets]
        assert numbers(opened) == pytest.approx(right, abs=CLOSE)
        assert told(opened) == pointing(runs, shown[1], right)
        seen.add(tuple(told(opened).values()))
    opened.mouse.up()
    assert len(seen) > 1
    opened.click("#viewer-reset")
    assert numbers(opened) == usual


def test_a_change_is_said_aloud(opened):
    """The live region tells settings and claims, after a pause."""
    put(opened, "strain", 70)
    told_aloud = opened.locator("#viewer-status[aria-live=polite]")
    opened.wait_for_function("document.getElementById('viewer-status').textContent.includes('disagree with: C')")
    assert "Break strain" in told_aloud.inner_text()


def test_frames_are_stepped_through_and_each_is_exact(opened, shown, datasets):
    """Arrows on a picture move both pictures by a frame; from the release on each shows Python's lumps there."""
    data = shown[1]
    opened.select_option("#viewer-run-left", "0")
    opened.select_option("#viewer-run-right", "3")
    canvas = opened.locator("#viewer-canvas-left")
    canvas.press("Home")
    bonded = data["frames"][data["release"] :]
    right = [classify(datasets[run], frames=bonded).fragments for run in (0, 3)]
    for frame in data["frames"]:
        opened.wait_for_function(f"document.getElementById('viewer-time-now').value.startsWith('frame {frame},')")
        for side, found in zip(("left", "right"), right, strict=True):
            caption = opened.locator(f"#viewer-caption-{side}")
            assert caption.inner_text().startswith(f"Frame {frame}:")
            here = [f.lump_fraction for f in found if f.frame == frame]
            assert numbers(opened, f"#viewer-caption-{side} data") == pytest.approx(here, abs=CLOSE)
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
    assert opened.input_value("#viewer-time") == str(len(shown[1]["frames"]) - 1)


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
    bonded = data["frames"][data["release"] :]
    expected = colour_fragments(classify(datasets[1], frames=bonded).fragments)[-1]
    common = {
        name for name, count in zip(*np.unique(expected.astype(str), return_counts=True), strict=True) if count > 40
    }
    found = colours_in(opened, "left")
    assert {rgb(name) for name in common} <= found
    assert {rgb(SKY), rgb(FLOOR)} <= found
    unseen = set(LUMPS) - set(expected)
    assert not {rgb(name) for name in unseen} & found


def test_damage_follows_the_threshold_and_legends_have_units(opened, shown):
    """Where hardly any strain breaks a bond, nearly all snow is damaged; where much does not, none is."""
    shades = shown[1]["colours"]["shades"]
    opened.select_option("#viewer-colour", "damage")
    put(opened, "strain", 0)
    assert rgb(shades[-1]) in colours_in(opened, "right")
    put(opened, "strain", 80)
    assert rgb(shades[0]) in colours_in(opened, "left")
    for colour, unit in (("density", "kg cell⁻³"), ("J_P", "J_P"), ("damage", "part of")):
        opened.select_option("#viewer-colour", colour)
        legend = opened.inner_text("#viewer-legend")
        assert unit in legend and len(re.findall(r"\d", legend)) >= 3


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
    for colour in ("fragment", "J_P"):
        opened.select_option("#viewer-colour", colour)
        found = axe.Axe().run(opened)
        assert not found.response["violations"], found.generate_report()
