"""Panels of several runs, and what their particles are coloured by."""

import numpy as np
import pytest

from snowrepro.composition.compose import compose
from snowrepro.report.drawing.colouring import PRESSED, colour_by_damage, colour_by_fragment, make_scale
from snowrepro.report.film.panels import arrange_panels, find_varied_keys, format_label, format_title
from snowrepro.store.run import Run
from snowrepro.summary.classify import classify
from snowrepro.sweep.plan import make_plan

ASPECT = 200 / 136  # of the L floor's domain


def test_figure_5_is_a_table():
    """Pressures rise to the right, sintered runs are above unsintered ones, and every panel says which it is."""
    runs = make_plan(["experiment=fig5", "pressure=340,530,3300"], False).runs
    keys = find_varied_keys(runs)
    assert keys == ["pressure", "sintering.name"]
    assert format_title(runs, keys) == "ball on L, pressure in kg cell⁻¹ s⁻²"
    assert format_title(runs[:1], []) == "ball on L, pressure 340 kg cell⁻¹ s⁻², sintering"
    shown = dict(zip(arrange_panels(runs, keys, ASPECT), [format_label(run, keys) for run in runs], strict=True))
    assert shown == {
        (row, column): f"pressure {pressure}, {arm}"
        for row, arm in enumerate(("sintering", "no sintering"))
        for column, pressure in enumerate((340, 530, 3300))
    }


@pytest.mark.parametrize(
    ("overrides", "keys", "label"),
    [
        (["pressure=7,8"], ["pressure"], "pressure 7"),
        (["seed=0,1"], ["seed"], "seed 0"),
        (["shape=star,ball", "floor=L,zigzag"], ["shape.name", "floor.name"], "star on L"),
        (["fidelity=preview,paper"], ["fidelity.name"], "fidelity preview"),
        (["solver.cfl=0.1,0.2"], ["solver.cfl"], "solver.cfl 0.1"),
        (["indenter=disc,none"], ["indenter.name"], "indented by disc"),
        (["pressure=7", "threads=1"], [], ""),
    ],
)
def test_labels_say_what_differs(overrides, keys, label):
    """A name stands for all that it sets."""
    runs = make_plan(overrides, multirun=True).runs
    assert find_varied_keys(runs) == keys
    assert format_label(runs[0], keys) == label


def test_any_number_of_runs_has_its_places():
    """Each its own; seven that are no table leave at most two places empty."""
    runs = [Run(compose([f"pressure={p}"])) for p in range(1, 8)]
    for count in range(1, 8):
        cells = arrange_panels(runs[:count], ["pressure"], ASPECT)
        assert len(set(cells)) == count
        rows, columns = 1 + np.max(cells, axis=0)
        assert rows * columns - count <= 2
    assert arrange_panels(runs[:3], ["pressure"], ASPECT) == [(0, 0), (0, 1), (0, 2)]


def test_damage_is_what_broke(small_run, small_config):
    """It never heals; over all particles, weighted by their bonds, it is the part of the bonds that broke."""
    frames = small_run["snapshot"].values.tolist()
    paint = colour_by_damage(small_run, Run(small_config), frames)
    found = classify(small_run, definition="damage")
    laid = np.bincount(found.state.bonds.pairs.ravel(), minlength=small_run.sizes["particle"])
    assert (np.diff(paint.values, axis=0) >= 0).all()
    mean = np.average(paint.values, axis=1, weights=laid)
    released = [frame >= 20 for frame in frames]
    assert mean[released] == pytest.approx(found.broken["both"].values, abs=1e-6)
    assert mean[-1] > 0.01
    assert (mean[~np.array(released)] == 0).all()
    assert make_scale([paint]).high == 1.0


def test_fragments_from_the_release_on(small_run, small_config):
    """Before, the snow is one; from then on the note says how much is in lumps."""
    paint = colour_by_fragment(small_run, Run(small_config), [16, 20, 60])
    last = classify(small_run).last
    shares = f"lump {last.lump_fraction:.2f}, crushed {last.crushed_fraction:.2f}, loose {last.loose_fraction:.2f}"
    assert paint.notes == [PRESSED, "lump 1.00, crushed 0.00, loose 0.00", shares]
    assert paint.is_of_states
    assert set(paint.values[0]) == {0}
    assert 0 not in paint.values[1:]
    assert make_scale([paint]) is None
