"""What an experiment's file says of its variants, without composing a run."""

import pytest

from snowrepro.composition.experiments import read_experiments, require_one_choice
from snowrepro.errors import ConfigError
from snowrepro.sweep.plan import make_plan

FILE = """# @package _global_
experiment:
  name: mine
  title: Mine
  picture: sweep
  variants:
    base: {}
    other: {VARIANT}
hydra:
  mode: MULTIRUN
  sweeper:
    params:
      sintering: paper
      reading.gravity: 5,10
"""


@pytest.mark.parametrize(
    ("variant", "params", "named"),
    [
        ({"defaults": [{"override /sintering": "none"}]}, {"sintering"}, "sintering"),
        ({"seed": 1}, {"seed", "pressure"}, "seed"),
        ({"reading": {"gravity": 20.0}}, {"reading.gravity"}, "reading.gravity"),
    ],
)
def test_a_variant_that_the_sweep_would_overrule_is_refused(variant, params, named):
    with pytest.raises(ConfigError, match=rf"variants\.other: {named} is chosen by hydra\.sweeper\.params too"):
        require_one_choice({"base": {}, "other": variant}, params)
    require_one_choice({"base": {}, "other": variant}, {"pressure"})
    require_one_choice({"no_C1": {"sintering": {"C1": 0.0}}}, {"sintering"})  # of the option that the sweep chooses


def test_a_file_of_ones_own_is_refused_before_any_run(tmp_path, monkeypatch):
    (tmp_path / "experiments").mkdir()
    (tmp_path / "experiments" / "mine.yaml").write_text(
        FILE.replace("{VARIANT}", "{defaults: [{override /sintering: none}]}")
    )
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigError, match=r"variants\.other: sintering is chosen by hydra\.sweeper\.params too"):
        make_plan(["experiment=mine"], multirun=True)


@pytest.mark.parametrize("name", [name for name, section in read_experiments().items() if section.get("variants")])
def test_no_variant_gives_the_runs_of_another(name):
    """Each variant of the program's own experiments changes something: the planned runs are all different."""
    plan = make_plan([f"experiment={name}"], multirun=True)
    assert len({run.id for run in plan.runs}) == len(plan.runs)
