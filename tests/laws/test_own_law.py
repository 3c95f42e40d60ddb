"""Laws of somebody else: chosen by name, part of a run, refused where they break a rule, stale when they change."""

import json
import shutil
import subprocess
import sys
from dataclasses import dataclass, replace

import pytest

from snowrepro import rules
from snowrepro.compiler import COMPILERS, name_compiler, ti
from snowrepro.composition.compose import compose, config_from
from snowrepro.errors import ConfigError
from snowrepro.laws.choose import make_material, make_sintering
from snowrepro.laws.hencky import HenckyMaterial
from snowrepro.laws.stomakhin import make_stomakhin
from snowrepro.own_law import OwnLaw, make_own_law, pass_law
from snowrepro.physics import hencky
from snowrepro.run import simulate
from snowrepro.settings.base import Settings
from snowrepro.store import manifest
from snowrepro.store.find import open_run
from snowrepro.store.identity import is_id_of, run_id
from snowrepro.sweep.plan import make_plan
from tests import command_line
from tests.conftest import SMALL
from tests.laws.packages import ENTRY_POINTS, TEMPLATE, forget_packages, place_template

TINY = [*SMALL, "loading.press_frames=1", "loading.frames=2", "loading=whole", "fidelity.dx=3"]


@pytest.fixture
def packages(tmp_path, monkeypatch):
    """A folder of installed packages that has the template."""
    folder = tmp_path / "packages"
    monkeypatch.syspath_prepend(str(folder))
    place_template(folder)
    yield folder
    forget_packages()


def id_of(*overrides: str) -> str:
    return run_id(compose(list(overrides)).case)


def test_a_law_is_chosen_by_its_name(packages):
    """Package, version and digest are found; parameters have the defaults that they are declared with."""
    config = compose(["material=plastic", "sintering=power_law"])
    law = config.case.material.law
    assert (law.name, law.package, law.version) == ("plastic", "snow-template", "1.0")
    assert law.parameters == {"strength": 500.0}
    assert config.case.sintering.name == "power_law" and config.case.sintering.rho_max == 700
    assert make_material(config.case).strength == 500
    assert make_sintering(config.case).exponent == config.case.sintering.law.parameters["exponent"]
    assert is_id_of(run_id(config.case), config.settings())
    assert config_from(config.settings()) == config


def test_no_code_is_run_of_a_law_that_is_not_chosen(packages):
    """What is installed is listed all the same."""
    (packages / "snow_template" / "__init__.py").write_text("raise RuntimeError('was run')")
    forget_packages()
    with pytest.raises(ConfigError, match=r"there is no material 'nix'; there are: .*plastic"):
        compose(["material=nix"])
    compose(["material=sand"])
    with pytest.raises(
        ConfigError, match=r"material law 'plastic' of the package snow-template cannot be loaded: .*run"
    ):
        compose(["material=plastic"])


def test_what_is_not_installed_is_not_run():
    with pytest.raises(ConfigError, match="there is no material 'plastic'"):
        compose(["material=plastic"])
    law = "{name: plastic, package: snow-template, version: '1.0', digest: 0123456789abcdef}"
    with pytest.raises(ConfigError, match="no installed package offers a material law 'plastic'"):
        compose([f"+material.law={law}"])


def test_parameters_are_part_of_a_run_in_any_spelling(packages):
    assert id_of("material=plastic") == id_of("material=plastic", "material.law.parameters.strength=500")
    assert id_of("material=plastic") == id_of("material=plastic", "material.law.parameters.strength=5e2")
    assert id_of("material=plastic") != id_of("material=plastic", "material.law.parameters.strength=501")


def test_a_sweep_over_a_parameter_is_that_of_its_runs(packages):
    """Also where a run is put together, and not composed; a value out of bounds is refused before any run."""
    swept = make_plan(["material=plastic,sand", "pressure=300,740"], True).runs
    assert {run.id for run in swept} == {
        id_of(f"material={name}", f"pressure={pressure}") for name in ("plastic", "sand") for pressure in (300, 740)
    }
    words = ["material=plastic", "material.law.parameters.strength=400.0,500.0,600"]
    ids = [id_of("material=plastic", f"material.law.parameters.strength={value}") for value in (400, 500, 600)]
    assert [run.id for run in make_plan(words, True).runs] == ids
    with pytest.raises(ConfigError, match="should be greater than 0"):
        make_plan([*words[:1], "material.law.parameters.strength=400.0,-1.0"], True)


@pytest.mark.parametrize(
    ("override", "message"),
    [
        (
            "material.law.parameters.strength=-1",
            r"material\.law\.parameters\.strength: should be greater than 0 \(got -1",
        ),
        ("+material.law.parameters.weight=1", r"parameters\.weight: .*; plastic has the parameters: strength"),
        ("material.law.version='2.0'", r"version 2.0 -> 1.0; choose it by material=plastic"),
        ("material.law.package=other", "it is of the package snow-template now"),
        ("material.law.digest=no", r"material\.law\.digest: "),
    ],
)
def test_what_a_law_did_not_declare_is_refused(packages, override, message):
    with pytest.raises(ConfigError, match=message):
        compose(["material=plastic", override])


def test_another_version_or_source_is_another_run_and_makes_those_before_stale(packages):
    first = compose(["material=plastic"])
    made = {"config": first.record()}
    assert "law" not in manifest.stale(made, first.execution)
    place_template(packages, version="1.1")
    assert run_id(compose(["material=plastic"]).case) != run_id(first.case)
    said = "material law plastic of snow-template: version 1.0 -> 1.1"
    assert manifest.stale(made, first.execution)["law"] == said
    with pytest.raises(ConfigError, match=r"version 1.0 -> 1.1; this run needs it as it was"):
        make_material(first.case)
    place_template(packages)
    with (packages / "snow_template" / "plastic.py").open("a") as file:
        file.write("\n# another source\n")
    forget_packages()
    assert "its source changed" in manifest.stale(made, first.execution)["law"]
    shutil.rmtree(packages)
    forget_packages()
    assert "no installed package offers" in manifest.stale(made, first.execution)["law"]


def test_a_name_that_two_packages_offer_is_refused(packages):
    place_template(packages, name="snow-double")
    with pytest.raises(
        ConfigError, match="several packages offer a material law 'plastic': snow-double, snow-template"
    ):
        compose(["material=plastic"])


def test_what_an_entry_point_names_is_a_law(packages):
    place_template(packages, entry_points=ENTRY_POINTS.replace("plastic:LAW", "plastic:Parameters"))
    with pytest.raises(ConfigError, match="is no OwnLaw"):
        compose(["material=plastic"])


@pytest.mark.parametrize("left", [".DS_Store", "plastic.py~", ".idea/x.xml", "__pycache__/x.pyc"])
def test_what_is_left_behind_in_a_package_is_no_part_of_it(packages, left):
    first = id_of("material=plastic")
    for name in (left, "data.csv"):
        file = packages / "snow_template" / name
        file.parent.mkdir(exist_ok=True)
        file.write_text("left")
        forget_packages()
        assert (id_of("material=plastic") == first) == (name == left)


def test_a_parameter_is_a_number_a_text_true_or_false(packages):
    """One line says so."""
    file = packages / "snow_template" / "plastic.py"
    declared, listed = "float = Field(500.0, gt=0,", "tuple[float, ...] = Field((1.0,),"
    file.write_text(file.read_text().replace(declared, listed))
    forget_packages()
    with pytest.raises(ConfigError) as error:
        compose(["material=plastic"])
    said = "material.law.parameters.strength: a parameter is a number, a text, true or false (got [1.0])"
    assert str(error.value) == said


def test_a_name_that_cannot_be_chosen_is_told(packages, caplog):
    """One that is no word, and one that an own option has."""
    names = "my-law = snow_template.plastic:LAW\ntable1 = snow_template.plastic:LAW\n"
    place_template(packages, entry_points=f"[snowrepro.material]\n{names}")
    with pytest.raises(ConfigError, match=r"there is no material 'my-law'; .* has letters from A to Z, digits and _"):
        compose(["material='my-law'"])
    assert compose(["material=table1"]).case.material.law.name == "stomakhin"
    said = [record.getMessage() for record in caplog.records]
    assert said == [
        "material=table1 is the program's own; the law that snow-template offers by this name cannot be chosen"
    ]


@ti.data_oriented
@dataclass(frozen=True)
class Wrong(HenckyMaterial):
    """Elastic, and one mistake."""

    mistake: str
    STATE = ()

    @ti.func
    def relax(self, F, R, state, mu, lam, xi):
        new = F
        if ti.static(self.mistake == "energy"):
            new = F + 0.01 * (F - ti.Matrix([[1.0, 0.0], [0.0, 1.0]]))
        if ti.static(self.mistake == "name"):
            new = undefined_name  # noqa: F821
        elif ti.static(self.mistake == "arguments"):
            new = self.stress(F)
        return new, state

    @ti.func
    def stress(self, F_E, R, mu, lam):
        tau = hencky.kirchhoff_stress(F_E, R, mu, lam)
        if ti.static(self.mistake == "observer"):
            tau[0, 0] *= 2.0
        elif ti.static(self.mistake == "nan"):
            tau /= 0.0 * lam
        return tau


class Foreign:
    """A sintering whose function another compiler than ours has decorated."""

    def advance(self, rho, xi, sigma_m, b_norm, time_step, weight):
        return rho, 1e5, 0.2, xi


def test_a_law_that_is_made_for_another_compiler_is_refused(monkeypatch):
    """Ours could not call its functions."""
    (other,) = COMPILERS.keys() - {name_compiler()}
    monkeypatch.setattr(Foreign.advance, f"_is_{other}_function", True, raising=False)
    with pytest.raises(ConfigError, match=f"'Foreign' is made for another compiler than {name_compiler()}"):
        simulate(compose(TINY), sintering=Foreign())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mistake", "rule"),
    [
        ("observer", "no work out of nothing|no matter who looks"),
        ("energy", "no energy by plastic flow"),
        ("nan", "symmetric stress"),
    ],
)
def test_a_run_with_a_law_that_breaks_a_rule_is_refused_with_the_point(mistake, rule):
    """Before its first frame."""
    frames = []
    with pytest.raises(ConfigError, match=rf"material law 'Wrong' .* is refused: .*({rule}).* F_E = \["):
        simulate(compose(TINY), frames.append, material=Wrong(mistake))
    assert frames == []


@ti.data_oriented
class Lightens:
    """A sintering that takes density away."""

    @ti.func
    def advance(self, rho, xi, sigma_m, b_norm, time_step, weight):
        return 0.9 * rho, 1e5, 0.2, xi


@pytest.mark.slow
def test_a_sintering_that_breaks_a_rule_is_refused():
    with pytest.raises(
        ConfigError, match=r"sintering law 'Lightens' .* refused: snow does not become lighter.* density of 100"
    ):
        simulate(compose(TINY), sintering=Lightens())


@pytest.mark.slow
def test_a_law_can_be_passed_as_a_function():
    """The paper's own, passed, gives the paper's run; that it was passed is in the configuration."""
    config = compose(TINY)
    run = simulate(config, material=make_stomakhin)
    assert run.position.equals(simulate(config).position)
    law = json.loads(run.attrs["config"])["material"]["law"]
    assert (law["name"], law["package"]) == ("make_stomakhin", "passed in Python")


def test_a_law_can_be_passed_as_an_object_or_with_parameters():
    """With other numbers it is another law; another process does not have it."""
    case = compose(TINY).case
    law = make_stomakhin(case)
    passed = pass_law("material", law)
    assert passed.parameters["highest_stretch"] == 1.005
    assert make_own_law("material", case, passed) is law
    assert pass_law("material", replace(law, highest_stretch=1.006)).digest != passed.digest
    whole = pass_law("material", OwnLaw(lambda case, _: make_stomakhin(case)))
    assert make_own_law("material", case, whole) == law
    unknown = passed.model_copy(update={"digest": "0" * 16})
    with pytest.raises(ConfigError, match="was passed in Python, by another process"):
        make_own_law("material", case, unknown)


def make_nothing(case):
    return None


def make_broken(case):
    raise KeyError("strength")


@dataclass(frozen=True)
class Listed(Wrong):
    values: list | None = None


class Needs(Settings):
    strength: float


class Many(Settings):
    strengths: tuple[float, ...] = (1.0, 2.0)


@ti.data_oriented
class FailingSintering:
    @ti.func
    def advance(self, rho, xi, sigma_m, b_norm, time_step, weight):
        return rho, E, 0.2, xi  # noqa: F821


@pytest.mark.parametrize(
    ("laws", "message"),
    [
        (
            {"material": make_broken},
            "material law 'make_broken' of passed in Python cannot be made: KeyError: 'strength'",
        ),
        (
            {"material": Wrong("name")},
            r"'Wrong' .* fails: test_own_law.py, line \d+, in relax: Name \"undefined_name\" is",
        ),
        (
            {"material": Wrong("arguments")},
            r"material law 'Wrong' .* fails: test_own_law.py, line \d+, in relax: Parameter `R` missing",
        ),
        (
            {"sintering": FailingSintering()},
            r"sintering law 'FailingSintering' .* fails: test_own_law.py, .* \"E\" is not",
        ),
        ({"material": Listed("", [1.0])}, "unhashable type: 'list': a law is a frozen dataclass of numbers"),
        ({"material": OwnLaw(make_nothing, Needs)}, "needs a default for each parameter: strength"),
        ({"material": OwnLaw(make_nothing, Many)}, "parameters.strengths: a parameter is a number, a text"),
    ],
)
def test_code_that_fails_is_told_in_one_line(laws, message):
    with pytest.raises(ConfigError, match=message) as error:
        simulate(compose(TINY), **laws)
    assert "\n" not in str(error.value)


def test_a_law_is_tried_again_where_its_points_are_others(monkeypatch):
    """By density, reading or frames too; and once for what is the same."""
    tried = []
    monkeypatch.setattr(rules, "_lawful", set())
    monkeypatch.setattr(rules, "try_material", lambda case: tried.append(case) or ())
    law = pass_law("material", Wrong(""))
    others = ("material.rho=120", "reading.plane=stress_zz_zero", "loading.frame_time=0.01")
    for word in ("seed=0", "seed=7", *others, "seed=0"):
        case = compose([*TINY, word]).case
        material = case.material.model_copy(update={"law": law})
        rules.require_lawful(case.model_copy(update={"material": material}))
    assert len(tried) == 4


def test_what_is_no_law_is_refused():
    with pytest.raises(ConfigError, match="material: 3 is no law"):
        simulate(compose(TINY), material=3)
    with pytest.raises(ConfigError, match=r"material: .*Wrong.* is no law"):
        simulate(compose(TINY), material=Wrong)
    with pytest.raises(ConfigError, match="'make_nothing' has no STATE, relax, factor"):
        simulate(compose(TINY), material=make_nothing)


@pytest.mark.nightly
def test_the_template_installs_and_runs(tmp_path):
    """By pip, without a network: its name in the manifest, and of another version the result is stale and says why."""
    pytest.importorskip("setuptools")
    source, target = tmp_path / "source", tmp_path / "target"
    shutil.copytree(TEMPLATE, source, ignore=shutil.ignore_patterns("__pycache__"))
    pip = ["-m", "pip", "install", "--quiet", "--no-index", "--no-build-isolation", "--no-deps", "--upgrade"]
    environment = {**command_line.ENVIRONMENT, "PYTHONPATH": f"{target}:{command_line.ROOT}"}

    def install() -> None:
        subprocess.run([sys.executable, *pip, "--target", str(target), str(source)], check=True)

    def call(*words: str) -> subprocess.CompletedProcess:
        return command_line.run_new(*words, cwd=tmp_path, env=environment)

    install()
    checked = call("point", "material=plastic", "sintering=power_law", "--check")
    assert checked.returncode == 0 and checked.stdout.count("0  ok  ") == 10, checked.stdout + checked.stderr
    asked = ("run", "material=plastic", "sintering=power_law", *TINY)
    done = call(*asked)
    assert done.returncode == 0, done.stderr
    (first,) = (tmp_path / "runs").glob("ball-*")
    versions = json.loads((first / "manifest.json").read_text())["versions"]
    assert versions.endswith("snow-template 1.0 (material law plastic, sintering law power_law)")
    run = open_run(str(first))
    assert run.slipped.attrs["long_name"] == "plastic strain in shear" and float(run.mean_density[-1]) > 100
    assert "plastic of snow-template 1.0, power_law of snow-template 1.0" in run.attrs["title"]
    project = source / "pyproject.toml"
    project.write_text(project.read_text().replace('version = "1.0"', 'version = "1.1"'))
    install()
    told = call("explain", first.name)
    assert "stale by law: material law plastic of snow-template: version 1.0 -> 1.1" in told.stdout
    assert call(*asked).returncode == 0
    assert len(list((tmp_path / "runs").glob("ball-*"))) == 2
