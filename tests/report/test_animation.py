"""Panels of several runs, and what their particles are coloured by."""

import numpy as np
import pytest

from snowrepro.analysis.classify import classify
from snowrepro.composition import compose
from snowrepro.report.paint import PRESSED, by_damage, by_fragment, scale_of
from snowrepro.report.panels import arrange, label_of, title_of, varied
from snowrepro.sweep.plan import make_plan

ASPECT = 200 / 136  # of the L floor's domain


def test_figure_5_is_a_table():
    """Pressures rise to the right, sintered runs are above unsintered ones, and every panel says which it is."""
    configs = make_plan(["experiment=fig5"], False).configs
    keys = varied(configs)
    assert keys == ["pressure", "sintering.name"]
    assert title_of(configs, keys) == "ball on L"
    shown = dict(zip(arrange(configs, keys, ASPECT), [label_of(config, keys) for config in configs], strict=True))
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
    configs = make_plan(overrides, multirun=True).configs
    assert varied(configs) == keys
    assert label_of(configs[0], keys) == label


def test_any_number_of_runs_has_its_places():
    """Each its own; seven that are no table leave at most two places empty."""
    configs = [compose([f"pressure={p}"]) for p in range(1, 8)]
    for count in range(1, 8):
        cells = arrange(configs[:count], ["pressure"], ASPECT)
        assert len(set(cells)) == count
        rows, columns = 1 + np.max(cells, axis=0)
        assert rows * columns - count <= 2
    assert arrange(configs[:3], ["pressure"], ASPECT) == [(0, 0), (0, 1), (0, 2)]


def test_damage_is_what_broke(small_run, small_config):
    """It never heals; over all particles, weighted by their bonds, it is the part of the bonds that broke."""
    frames = small_run["snapshot"].values.tolist()
    paint = by_damage(small_run, small_config, frames)
    found = classify(small_run)
    laid = np.bincount(found.bonds.pairs.ravel(), minlength=small_run.sizes["particle"])
    assert (np.diff(paint.values, axis=0) >= 0).all()
    mean = np.average(paint.values, axis=1, weights=laid)
    released = [frame >= 20 for frame in frames]
    assert mean[released] == pytest.approx(found.broken["both"].values, abs=1e-6)
    assert mean[-1] > 0.01
    assert (mean[~np.array(released)] == 0).all()
    assert scale_of([paint]).high == 1.0


def test_fragments_from_the_release_on(small_run, small_config):
    """Before, the snow is one; from then on the note says how much is in lumps."""
    paint = by_fragment(small_run, small_config, [16, 20, 60])
    assert paint.notes == [PRESSED, "in lumps 1.00", f"in lumps {classify(small_run).lump_fraction:.2f}"]
    assert set(paint.values[0]) == {0}
    assert 0 not in paint.values[1:]
    assert scale_of([paint]) is None
