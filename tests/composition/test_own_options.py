"""The user's folders: found wherever they lie, and one message for each file of them that cannot be read."""

from pathlib import Path

import pytest

from snowrepro.composition.compose import compose
from snowrepro.composition.experiments import find_own_experiments, read_experiments
from snowrepro.errors import ConfigError
from snowrepro.sweep.plan import make_plan

DISC = "name: disc\noutline: {kind: circle, radius: 20}\n"
BOMB = (
    "a: &a [1, 1, 1, 1, 1, 1, 1, 1]\nb: &b [*a, *a, *a, *a, *a, *a, *a, *a]\nc: &c [*b, *b, *b, *b, *b, *b, *b, *b]\n"
)
BROKEN = {
    "tab": (b"name: disc\noutline:\n\tkind: circle\n", "line 3: found character '.t' that cannot start any token"),
    "bracket": (b"name: disc\noutline: {kind: circle\n", r"line 3: .*got '<stream end>'"),
    "twice": (b"name: disc\noutline: {kind: circle, radius: 20}\nname: other\n", "line 3: found duplicate key name"),
    "latin": ("name: disc\n# f\u00fcr\n".encode("latin-1"), "line 2: is not in UTF-8; save it in that encoding"),
    "utf16": ("name: disc\n".encode("utf-16"), "line 1: is not in UTF-8"),
    "zero": (b"name: disc\0\n", "cannot be read: unacceptable character #x0000"),
    "python": (b"name: !!python/object/apply:os.getcwd []\n", "line 1: could not determine a constructor for the tag"),
    "reference": (b"name: ${disc\n", "cannot be read: .*"),
}


@pytest.fixture
def own(tmp_path, monkeypatch):
    """A function that writes a file of the user's and works where it counts."""

    def write(place: str, content: bytes | str, folder: str = "."):
        path = tmp_path / folder / "conf" / place
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        monkeypatch.chdir(tmp_path / folder)
        return path

    return write


@pytest.mark.parametrize("folder", ["\u00dcbung", "two words", "a [b], 'c'", "{d}=$x", "50%#?", "\u96ea", "x=y,z"])
def test_a_folder_of_any_name_has_options(own, folder):
    own("shape/disc.yaml", DISC, folder)
    assert compose(["shape=disc"]).case.shape.outline.radius == 20


def test_folders_of_a_search_path_come_beside_it(own, tmp_path):
    """Where both have an option of one name, that of the folder ``conf`` counts."""
    own("shape/disc.yaml", DISC)
    for name, radius in (("disc", 30), ("far", 25)):
        path = tmp_path / "more" / "shape" / f"{name}.yaml"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"name: {name}\noutline: {{kind: circle, radius: {radius}}}\n")
    search = f"hydra.searchpath=[file://{tmp_path}/more]"
    assert compose([search, "shape=far"]).case.shape.outline.radius == 25
    assert compose([search, "shape=disc"]).case.shape.outline.radius == 20


@pytest.mark.parametrize("kind", BROKEN)
def test_a_broken_file_is_named_with_the_place(own, kind):
    """Also where others are broken too; and where it is not asked for, nobody minds."""
    for other, (content, _) in BROKEN.items():
        own(f"shape/{other}.yaml", content)
    with pytest.raises(ConfigError, match=rf"^conf/shape/{kind}\.yaml(, |: ){BROKEN[kind][1]}") as caught:
        compose([f"shape={kind}"])
    assert "\n" not in str(caught.value)
    compose(["shape=ball"])


def test_an_experiment_with_a_relative_default_is_told_of_the_slash(own):
    own("experiment/relative.yaml", "# @package _global_\ndefaults:\n  - override shape: star\n")
    with pytest.raises(ConfigError, match=r"experiment/relative.yaml: .* begins with a slash: 'override /shape: ...'"):
        compose(["experiment=relative"])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (
            BOMB + "d: &d [*c, *c, *c, *c, *c, *c, *c, *c]\ne: [*d, *d, *d]\n",
            r"has 19,398 values with what its anchors",
        ),
        ("a: &a [*a]\n", "values with what its anchors repeat"),
        ("a: 1\n" + 1_000_000 * "#", "has 1,000,005 bytes, at most 1,000,000 are read"),
    ],
    ids=["many", "itself", "long"],
)
def test_a_file_that_would_never_end_is_refused(own, content, message):
    path = own("shape/bomb.yaml", content)
    with pytest.raises(ConfigError, match=message):
        compose(["shape=bomb"])
    path.write_text(DISC)
    compose(["shape=bomb"])


MINE = """# @package _global_
defaults:
  - fig5
  - _self_
experiment:
  name: mine
  title: Mine
hydra:
  sweeper:
    params:
      sintering: paper,none
      pressure: logspace(200,800,3)
"""


@pytest.fixture
def experiments(tmp_path, monkeypatch):
    """A folder ``experiments`` where one works; its path has letters that mean something elsewhere."""
    folder = tmp_path / "a [b], c" / "experiments"
    folder.mkdir(parents=True)
    monkeypatch.chdir(folder.parent)
    return folder


def test_experiments_are_found_in_a_folder_of_that_name(experiments):
    """Beside the built-in ones, which they may build on; a range that Hydra does not know may stand in the file."""
    (experiments / "mine.yaml").write_text(MINE)
    plan = make_plan(["experiment=mine", "fidelity=preview"], multirun=False)
    assert [run.case.pressure for run in plan.runs] == [200, 400, 800] * 2
    assert plan.experiment is not None and (plan.experiment.name, plan.experiment.picture) == ("mine", "strip")
    assert {"mine", "fig5"} <= read_experiments().keys()
    with pytest.raises(
        ConfigError, match=r"there is no experiment 'yours'; there are: ablation, audit, calibration, .*, mine, "
    ):
        make_plan(["experiment=yours"], multirun=False)


def test_other_files_in_that_folder_disturb_nobody(experiments):
    """They may be anything; one that begins as an experiment does, and cannot be read, is named."""
    (experiments / "other.yaml").write_text("{")
    (experiments / "large.yaml").write_bytes(b"a" * 2_000_000)
    (experiments / "fig5").mkdir()
    assert compose(["pressure=7"]).case.pressure == 7
    assert "other" not in read_experiments()
    (experiments / "mine.yaml").write_text("# @package _global_\nexperiment: {")
    with pytest.raises(ConfigError, match=r"experiments/mine.yaml, line 2: "):
        compose(["pressure=7"])


def test_the_built_in_one_counts_of_two_of_a_name(experiments):
    """As it does for any option: runs and picture are of one file."""
    (experiments / "fig5.yaml").write_text(MINE)
    assert read_experiments()["fig5"]["title"] == "Figure 5: ball snow on the L floor"
    assert make_plan(["experiment=fig5"], multirun=False).experiment.name == "fig5"


def test_the_programs_own_folder_is_not_taken_for_the_users(monkeypatch):
    """In a clone, where it is linked to from conf/."""
    monkeypatch.chdir(Path(__file__).parents[2])
    assert find_own_experiments() is None
