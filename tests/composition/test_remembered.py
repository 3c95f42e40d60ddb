"""What overrides a record may have, and which of a command's are kept."""

import pytest

from snowrepro.composition.remembered import keep_harmless, require_harmless
from snowrepro.errors import ConfigError

HARMLESS = [
    "pressure=500,2000", "seed=range(0,3)", "shape=ball,star", "shape=mine/disc", "+shape.outline.centre=[0,0]",
    "shape.outline={kind: circle, radius: 12}", "shape.outline={kind: svg, file: drawings/x.svg, width: 3}",
    "~analysis.definition", "+solver.flip=0.5", "++floor.width=100", "experiment=fig5", "experiment.frames=[0,20,60]",
    "scene=ball_on_L", "variant=base,fine", "indenter=none,disc", "threads=2", "rerun=[code]", "claims=paper",
    "reading.drop_height=6", "sintering.name='no'", "hydra.launcher.workers=4", "hydra/launcher=slurm",
    "hydra.launcher.time_limit_minutes=0.5", "shape=glob(*)", "pressure=shuffle(1,2)", "deterministic=false",
    "shape.outline.path='M0,0 L8,0 8,6 Z'",
]  # fmt: skip
HARMFUL = [
    "hydra.callbacks.x._target_=os.system", "+hydra.callbacks={x: {_target_: a.b}}", "++hydra.callbacks.x=1",
    "~hydra.callbacks", "hydra/callbacks=x", "hydra.launcher._target_=a.b", "hydra.launcher.setup=[touch x]",
    "hydra.searchpath=[file:///tmp]", "hydra.sweep.dir=/tmp/x", "hydra.run.dir=/tmp/x", "hydra.mode=MULTIRUN",
    "hydra.sweeper.params={a: b}", "hydra/launcher=joblib", "hydra/launcher=../../x", "hydra.launcher.workers=${x}",
    "hydra.job.chdir=true", "+hydra.job.env_set.PATH=/tmp", "hydra.launcher.workers=1\nx",
    "store=/tmp/x", "+store=x", "++store=x", "reports=/tmp/x", "++reports=..", " store=x", "store.x=1",
    "pressure=${oc.env:HOME}", "pressure=${seed}", "shape.name=${oc.env:HOME}", "shape.outline={_target_: os.system}",
    "shape=../../x", "shape=/etc/x", "experiment=../../outside/evil", "shape=[a,../b]", "shape={defaults: [../x]}",
    "shape@hydra.callbacks=ball", "+shape@_global_=ball", "@hydra=x", "nothing=1", "_target_=os.system", "+a.b.c=1",
    "shape.outline.file=/etc/passwd", "shape.outline={kind: image, file: ../x.png}", "shape.outline.file=~/x.svg",
    "", "=", "pressure=[", "pressure=" + "[" * 3000, "x=[" + "1," * 9000 + "1]", "pressure", "--multirun", "x y=1",
]  # fmt: skip


@pytest.mark.parametrize("override", HARMLESS)
def test_settings_and_options_of_ours_may_be_remembered(override):
    require_harmless([override])
    assert keep_harmless([override]) == ([] if override == "hydra/launcher=slurm" else [override])


@pytest.mark.parametrize("override", HARMFUL)
def test_nothing_else_may(override):
    with pytest.raises(ConfigError, match=r"the override '"):
        require_harmless(["pressure=1", override])


def test_what_is_of_whoever_asks_is_not_kept():
    """Where runs and reports are kept, and all of Hydra but the launcher on this machine."""
    words = [
        "experiment=fig5",
        "hydra/launcher=slurm",
        "store=/x",
        "reports=y",
        "hydra.launcher.partition=p",
        "hydra.launcher.workers=4",
    ]
    assert keep_harmless(words) == ["experiment=fig5", "hydra.launcher.workers=4"]
