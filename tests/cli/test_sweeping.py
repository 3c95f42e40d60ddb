"""What a sweep of the user's own says at its end: its name, and commands that can be typed as they stand."""

import shlex

import pytest

from snowrepro.cli.sweeping import describe_sweep
from snowrepro.composition.overrides import override_folder
from snowrepro.sweep.plan import make_plan


@pytest.mark.parametrize(
    ("overrides", "drawn"),
    [
        (
            ["pressure=500,900", "sintering=paper,none", "seed=0,1"],
            ["x=pressure", "y=lump_fraction", "colour=sintering"],
        ),
        (
            ["sintering=paper,none", "reading.gravity=10,20"],
            ["x=reading_gravity", "y=lump_fraction", "colour=sintering"],
        ),
        (["shape=ball,star", "seed=0,1"], ["x=shape", "y=lump_fraction"]),
        (["seed=0,1"], ["x=seed", "y=lump_fraction"]),
        (["seed=0"], ["x=pressure", "y=lump_fraction"]),
        (["pressure=500,900", "indenter=disc"], ["x=pressure", "y=hardness"]),
    ],
)
def test_the_next_command_draws_what_varies(overrides, drawn):
    """A number along x, what else varies in colours, seeds as points."""
    last = describe_sweep(make_plan(overrides, multirun=True))[-1]
    assert shlex.split(last)[4:] == drawn


def test_commands_hold_whatever_a_name_has(tmp_path):
    """A store elsewhere is named too; the table only if it is there."""
    store = override_folder("store", str(tmp_path / "it's here"))
    lines = describe_sweep(make_plan(["pressure=range(500,700,100)", store], multirun=True))
    name = "pressure=range_500,700,100_"
    assert lines[0] == f"sweep: {name}"
    assert [shlex.split(line)[1:4] + shlex.split(line)[-1:] for line in lines[1:]] == [
        ["snowrepro", verb, name, store] for verb in ("report", "plot")
    ]
