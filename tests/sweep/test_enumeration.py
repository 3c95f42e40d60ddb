"""A sweep's runs are what Hydra would compose, one by one; few are composed."""

import subprocess
import sys
from pathlib import Path

import pytest
from hydra._internal.core_plugins.basic_sweeper import BasicSweeper
from hydra.core.override_parser.overrides_parser import OverridesParser
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from omegaconf import OmegaConf

from snowrepro.composition.compose import compose, compose_raw, config_loader
from snowrepro.errors import ConfigError
from snowrepro.report.figures.kinds import needs_runs
from snowrepro.settings.config import PARTS, Config
from snowrepro.store.run import Run
from snowrepro.sweep import enumeration
from snowrepro.sweep.plan import Plan, make_plan, read_part

MOST_JOBS = 6  # that a test composes one by one


def jobs_of(overrides: list[str]) -> list[tuple[str, ...]]:
    """The overrides of each job as Hydra's sweeper hands them to a launcher."""
    parse = OverridesParser.create(config_loader()).parse_overrides
    task = [o.input_line for o in parse(overrides) if not o.is_hydra_override()]
    fixed = [o.input_line for o in parse(overrides) if not o.is_sweep_override()]
    params = compose_raw(fixed, hydra_node=True).hydra.sweeper.params or {}
    [jobs] = BasicSweeper.split_arguments(parse([*(f"{key}={value}" for key, value in params.items()), *task]), None)
    return [tuple(job) for job in jobs]


def one_by_one(overrides: list[str]) -> list[tuple[Config, tuple[str, ...]]] | str:
    """Each job composed by Hydra, or what is wrong with the first that is wrong."""
    try:
        return [(compose(job), job) for job in jobs_of(overrides)]
    except ConfigError as error:
        return str(error)


def enumerated(overrides: list[str]) -> list[tuple[Config, tuple[str, ...]]] | str:
    """The same by the plan."""
    try:
        return configs_of(make_plan(overrides, True))
    except ConfigError as error:
        return str(error)


def configs_of(plan: Plan) -> list[tuple[Config, tuple[str, ...]]]:
    """Each run of a plan."""
    return [(planned.run.config, planned.overrides) for planned in plan.planned]


def fields_set(config: Config) -> dict[str, set[str]]:
    """Which settings were given, part by part."""
    return {"config": config.model_fields_set, **{name: getattr(config, name).model_fields_set for name in PARTS}}


def require_equal(overrides: list[str]) -> None:
    expected, found = one_by_one(overrides), enumerated(overrides)
    assert found == expected
    if isinstance(expected, list):
        assert [Run(config).id for config, _ in found] == [Run(config).id for config, _ in expected]
        # Equality does not tell 0.0 from -0.0, nor what was given from what is so by default.
        assert [repr(config) for config, _ in found] == [repr(config) for config, _ in expected]
        assert [fields_set(config) for config, _ in found] == [fields_set(config) for config, _ in expected]


@pytest.fixture
def own(tmp_path: Path, monkeypatch):
    """A user's folder; call it with a path in ``conf`` and a text to write an option."""
    monkeypatch.chdir(tmp_path)

    def write(path: str, text: str) -> None:
        (tmp_path / "conf" / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "conf" / path).write_text(text)

    return write


@pytest.fixture
def composed(monkeypatch) -> list[list[str]]:
    """The jobs that Hydra composes while a sweep is enumerated."""
    jobs: list[list[str]] = []

    def count(overrides):
        jobs.append(list(overrides))
        return compose_raw(overrides)

    monkeypatch.setattr(enumeration, "compose_raw", count)
    return jobs


AXES = [
    "shape=ball,star", "floor=square,stair1", "sintering=paper,none", "solver=apic,mls", "reading=grid_units,si",
    "scene=ball_on_L,star_on_square", "variant=base,seed_1", "variant=cfl_half,mls", "indenter=none,disc",
    "experiment=fig4", "experiment=energy", "floor=glob(stair*, exclude=stair3)", "fidelity=choice(paper,preview)",
    "pressure=340,5e2", "pressure=-1,3", "pressure=7,-3", "seed=range(2)", "seed=3", "++seed=5,6", "solver.cfl=0.1,0.2",
    "solver.cfl=0.3", "solver.spline='quadratic','cubic'", "reading.gravity=range(9,10,0.5)", "sintering.C3=0.0,-0.0",
    "sintering.rho_max=700,50", "+shape.outline.centre=[0,0],[1,2]", "shape.outline.radius=20,30",
    "floor.drop_x=null,60", "floor.drop_x=50,60", "reading.hardening_exponent=[-1,1],[-2,2]",
    "threads=1,2", "solver={cfl:0.3}", "~sintering.C3", "loading.frames=600,50",
    "solver.splin=cubic,quadratic", "floor=L,bogus", "deterministic=true,false", "claims.alpha=0.01,0.05",
    "seed=sort(2,1)", "pressure=tag(t,choice(2,1))", "hydra.launcher.workers=2",
]  # fmt: skip


def require_equal_if_few(overrides: list[str]) -> None:
    try:
        assume(len(jobs_of(overrides)) <= MOST_JOBS)
    except ConfigError:  # the plan should say the same
        pass
    require_equal(overrides)


@pytest.mark.parametrize("examples", [2, pytest.param(60, marks=pytest.mark.nightly)])
def test_enumerating_is_composing(examples):
    """Whatever the axes, and whatever is wrong with them."""
    sweeps = st.lists(st.sampled_from(AXES), min_size=2, max_size=4)
    check = given(sweeps)(require_equal_if_few)
    settings(max_examples=examples, deadline=None, suppress_health_check=list(HealthCheck))(check)()


@pytest.mark.parametrize(
    "overrides",
    [
        ["shape=ball,star", "floor=L,square", "floor.drop_x=50,60"],
        ["solver=apic,mls", "solver.cfl=0.1,0.2", "solver.spline=quadratic,cubic"],
        ["experiment=fig5", "sintering=none", "pressure=5e2,1", "variant=base,cfl_half"],
        ["fidelity=preview,paper", "variant=base,coarse_grid"],
        ["seed=1,2", "++seed=7"],
        ["solver.cfl=0.2,0.3", "solver={cfl:0.2}"],
        ["shape.name=x,str(1)"],
        ["sintering.C3=0.0,-0.0", "seed=1,2"],
        ["indenter=none,disc", "pressure=1,2", "seed=1,2"],
        ["hydra.launcher.workers=2", "seed=1", "pressure=1,2", "seed=3,4"],
        ["pressure=1,2,-3"],
        ["shape=ball,star", "shape.outline.radius=20,30"],
        ["floor=L,bogus", "seed=1,2"],
        ["material.rho=400,800", "sintering=paper,none"],
        ["threads=1,2", "seed=1,2"],
    ],
    ids=" ".join,
)
def test_what_could_go_wrong(overrides):
    """Options and values of one section, keys named twice, what reads back as another type, wrong runs behind good."""
    require_equal(overrides)


@pytest.mark.nightly
def test_an_option_may_reach_beyond_its_section(own):
    """By being written for the whole config, or by choosing another option."""
    own(
        "fidelity/wide.yaml",
        "# @package _global_\nfidelity: {name: wide, dx: 2.0, particles_per_cell: 4}\nfloor: {drop_x: 60}\n",
    )
    own("fidelity/more.yaml", "defaults: [paper, /extra@_global_: far, _self_]\nname: more\n")
    own("extra/far.yaml", "floor: {drop_x: 70}\n")
    for option, place in (("wide", 60), ("more", 70)):
        require_equal(["floor=L,square", f"fidelity=paper,{option}"])
        assert make_plan(["floor=square,L", f"fidelity=paper,{option}"], True).runs[3].case.floor.drop_x == place


@pytest.mark.nightly
def test_interpolations_are_followed(own, composed):
    """To a value that varies, to an option, and where only one of the options has one."""
    own("shape/echo.yaml", "name: echo\noutline: {kind: circle, radius: '${pressure}'}\n")
    own("experiment/plain.yaml", "# @package _global_\n")
    own("experiment/tied.yaml", "# @package _global_\nreading: {friction: '${fidelity.dx}', press_ramp: '${seed}'}\n")
    require_equal(["shape=ball,echo", "pressure=20,30"])
    require_equal(["experiment=tied", "seed=3,4", "pressure=1,2"])
    require_equal(["experiment=tied", "fidelity=paper,preview", "pressure=1,2"])
    composed.clear()
    assert len(make_plan(["experiment=tied", "fidelity=paper,preview", "pressure=1,2"], True).runs) == 4
    assert len(composed) == 2
    require_equal(["experiment=plain,tied", "fidelity=paper,preview", "pressure=1,2"])


def test_interpolations_need_not_say_what_they_follow(own):
    """A name that is put together, and a resolver that looks where it likes."""
    OmegaConf.register_new_resolver("ramp", lambda *, _root_: _root_["se" + "ed"], replace=True)
    own("shape/seed.yaml", "name: seed\noutline: {kind: circle, radius: 20}\n")
    for text in ("${${shape.name}}", "${ramp:}"):
        own("experiment/tied.yaml", f"# @package _global_\nreading: {{press_ramp: '{text}'}}\n")
        require_equal(["experiment=tied", "shape=seed", "seed=3,4"])
    OmegaConf.clear_resolver("ramp")


@pytest.mark.nightly
def test_a_choice_may_follow_from_two_others(own):
    """By an interpolation in a defaults list, which shows for one pair of options only."""
    own("shape/chooser.yaml", "defaults:\n  - ball\n  - optional /pair: ${fidelity}_${solver}\n")
    own("pair/preview_mls.yaml", "# @package _global_\nshape: {name: chosen}\n")
    overrides = ["shape=chooser", "fidelity=paper,preview", "solver=apic,mls"]
    require_equal(overrides)
    assert [run.case.shape.name for run in make_plan(overrides, True).runs] == ["ball", "ball", "ball", "chosen"]


def test_a_drawing_is_traced_for_each_run(own):
    """An outline's settings are not what it becomes."""
    own("shape/drop.yaml", "name: drop\noutline: {kind: svg, path: 'M 0 0 L 10 0 L 5 9 Z', width: 50}\n")
    require_equal(["shape=drop", "shape.outline.width=40,50"])
    require_equal(["shape=drop", "shape.outline.kind=svg,polygon"])


def test_few_runs_are_composed(composed):
    """The first one, and one for each option that it does not have; sections are shared."""
    plan = make_plan(
        ["shape=ball,star", "floor=L,square,stair1", "solver=mls", "solver.cfl=0.2,0.3", "seed=range(50)"], True
    )
    assert len(plan.runs) == 600
    assert len(composed) == 4
    made = [planned.run.config for planned in plan.planned if list(planned.overrides) not in composed]
    assert len({id(config.case.shape) for config in made}) == 2
    assert len({id(config.case.solver) for config in made}) == 2
    assert len({id(config.case.reading) for config in made}) == 1
    assert len({id(config.case.model_fields_set) for config in made}) == 1
    assert len({id(config.question) for config in made}) == len({id(config.execution) for config in made}) == 1


def test_structures_are_composed_one_by_one(composed):
    """Options are seen anew with each variant."""
    assert len(make_plan(["variant=cfl_half,mls", "sintering=paper,none", "seed=range(9)"], True).runs) == 36
    assert len(composed) == 4


def test_parts_hold_every_run_once(composed):
    """In turn, and what a part does not need is not composed for it."""
    overrides = ["floor=L,square,stair1", "seed=1,2,3"]
    whole = configs_of(make_plan(overrides, True))
    parts = [configs_of(make_plan(overrides, True, part=(i, 2))) for i in (1, 2)]
    assert parts == [whole[::2], whole[1::2]]
    composed.clear()
    assert configs_of(make_plan(overrides, True, part=(4, 5))) == [whole[3], whole[8]]
    assert [job[0] for job in composed] == ["floor=square", "floor=stair1"]
    nothing = make_plan(overrides, True, part=(10, 10))
    assert nothing.runs == ()
    assert not needs_runs(nothing.runs)


def test_a_part_does_not_see_what_is_wrong_elsewhere():
    assert len(make_plan(["pressure=1,-2,3"], True, part=(1, 2)).runs) == 2
    with pytest.raises(ConfigError, match="pressure: should be greater"):
        make_plan(["pressure=1,-2,3"], True, part=(2, 2))


def test_one_run_is_the_first_part():
    assert make_plan(["pressure=7"], False, part=(1, 2)).runs[0].case.pressure == 7
    assert make_plan(["pressure=7"], False, part=(2, 2)).runs == ()


@pytest.mark.parametrize("text", ["0/3", "4/3", "1", "1/", "a/b", "-1/3", "1/2/3", "1.0/2", "", "²/3"])
def test_a_wrong_part_is_refused(text):
    with pytest.raises(ConfigError, match="part: should be I/N with 1 <= I <= N .got " + text.replace(".", r"\.")):
        read_part(text)


def test_a_part_is_read_and_checked():
    assert read_part("2/10") == (2, 10)
    for wrong in ("3/2", "0/2", "1/0", "-1/2", "1/2/3", "half", ""):
        with pytest.raises(ConfigError, match=rf"part: should be I/N with 1 <= I <= N .got {wrong}."):
            read_part(wrong)


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["seed=range(0)", "pressure=1,2"], r"'seed=range\(0\)' names no run"),
        (["floor=glob(x*)"], r"names no run"),
        (["pressure=interval(1,2)"], "is a range, which only a design makes values of"),
        (["hydra.launcher.workers=1,2"], "cannot vary Hydra's own settings: hydra.launcher.workers=1,2"),
    ],
)
def test_a_sweep_that_cannot_be_is_refused(overrides, message):
    with pytest.raises(ConfigError, match=message):
        make_plan(overrides, True)


ENUMERATE = """
import sys
from snowrepro.sweep.plan import make_plan
plan = make_plan(sys.argv[1:], True)
print(len({run.id for run in plan.runs}))
print(*sorted({"taichi", "matplotlib", "xarray", "numpy", "scipy"} & set(sys.modules)))
from snowrepro.store.provenance import peak_memory_mb
print(peak_memory_mb())
"""


@pytest.mark.parametrize(("seeds", "seconds"), [(1, 60), pytest.param(595, 30, marks=pytest.mark.nightly)])
def test_a_large_sweep_is_lean(seeds, seconds):
    """Almost as many runs as are allowed, in a fresh process; nothing is imported that only running them needs."""
    overrides = ["experiment=grid", f"seed=range({seeds})"]
    done = subprocess.run(
        [sys.executable, "-c", ENUMERATE, *overrides], capture_output=True, text=True, check=True, timeout=seconds
    )
    count, heavy, megabytes = done.stdout.split("\n")[:3]
    assert int(count) == 168 * seeds
    assert heavy == ""
    assert float(megabytes) < 350
