"""What is used of Hydra beyond what it promises: this fails first when the next version has moved it."""

import ast
import re
from pathlib import Path

import pytest
from hydra import compose, initialize_config_dir
from hydra.core.config_store import ConfigStore
from hydra.core.global_hydra import GlobalHydra
from hydra.core.plugins import Plugins
from hydra.core.utils import JobReturn, JobStatus
from hydra.types import RunMode
from omegaconf import OmegaConf

import hydra_plugins
import snowrepro
from snowrepro.composition import hydra_private
from snowrepro.composition.compose import CONF_DIR, quiet_about_schemas

PACKAGE = Path(snowrepro.__file__).parent
PLUGINS = Path(next(iter(hydra_plugins.__path__))) / "snowrepro_launcher"
HOME = PACKAGE / "composition" / "hydra_private.py"
EXERCISED = {
    "as_text", "context_of", "forget_hydra", "has_list_in_list", "initialised_hydra", "is_range", "is_sampled",
    "jobs_of", "loader_of_options", "make_parser", "offer_options", "option_repository", "result_of",
}  # fmt: skip


@pytest.fixture
def hydra():
    """Hydra as a command starts it."""
    hydra_private.forget_hydra()
    with initialize_config_dir(version_base="1.3", config_dir=str(CONF_DIR)):
        yield hydra_private.initialised_hydra()


def parsed(*overrides: str) -> list[hydra_private.Override]:
    return hydra_private.OverridesParser.create().parse_overrides(list(overrides))


def test_every_function_is_tried_here():
    """A new one has to be, too."""
    tree = ast.parse(HOME.read_text(encoding="utf-8"))
    assert {node.name for node in tree.body if isinstance(node, ast.FunctionDef)} == EXERCISED
    assert EXERCISED <= set(hydra_private.__all__)
    assert all(hasattr(hydra_private, name) for name in hydra_private.__all__)


def test_hydra_is_forgotten_and_initialised_again():
    """Twice in a row, as each composition does; without it there is none to be had."""
    for _ in range(2):
        hydra_private.forget_hydra()
        assert not GlobalHydra.instance().is_initialized()
        with pytest.raises(AssertionError, match="Hydra is initialised"):
            hydra_private.initialised_hydra()
        with initialize_config_dir(version_base="1.3", config_dir=str(CONF_DIR)):
            loader = hydra_private.loader_of_options()
            assert isinstance(loader, hydra_private.ConfigLoaderImpl)
            assert loader is hydra_private.initialised_hydra().config_loader


def test_the_files_of_options_are_found_also_in_folders_that_are_added(hydra, tmp_path):
    """Groups, options, their headers and the defaults that they build on."""
    (tmp_path / "shape").mkdir()
    (tmp_path / "shape" / "own.yaml").write_text("defaults: [ball, _self_]\nname: own\n")
    files = hydra_private.option_repository(
        hydra_private.loader_of_options(), "config", [f"hydra.searchpath=[file://{tmp_path}]", "pressure=7"]
    )
    assert isinstance(files, hydra_private.CachingConfigRepository)
    assert files.group_exists("shape") and not files.group_exists("pressure")
    assert files.load_config("shape/ball").header["package"] is None
    assert files.load_config("shape/none") is None
    first, last = files.load_config("shape/own").defaults_list
    assert isinstance(first, hydra_private.ConfigDefault)
    assert (first.path, last.path) == ("ball", "_self_")
    assert str(tmp_path) in " ".join(source.path for source in files.get_sources())


def test_the_jobs_are_those_of_hydras_own_sweeper():
    """Each combination once, the last key fastest; a text is written as it can be read again."""
    jobs = hydra_private.jobs_of(parsed("shape=ball,star", "pressure=range(1,3)", "seed=7"))
    assert jobs == [[f"shape={shape}", f"pressure={p}", "seed=7"] for shape in ("ball", "star") for p in (1, 2)]


def test_functions_can_be_added_to_the_grammar():
    """Each parser has them once; what they give is a sweep that can be gone through."""
    for _ in range(2):
        (override,) = hydra_private.make_parser().parse_overrides(["pressure=logspace(1,100,3)"])
    assert override.is_sweep_override() and override.is_discrete_sweep()
    assert list(override.sweep_iterator()) == [1, 10, 100]


def test_ranges_are_told_from_lists():
    """Also the one list that Hydra reads like another: choice(a,b) and a,b."""
    words = ["a=log(1,100)", "a=whole(0,20)", "a=interval(0,1)", "a=choice(x,y)", "a=x,y", "a=linspace(0,1,3)", "a=1"]
    read = hydra_private.make_parser().parse_overrides(words)
    assert [hydra_private.is_range(each) for each in read] == [True] * 3 + [False] * 4
    assert [hydra_private.is_sampled(each) for each in read] == [True] * 4 + [False] * 3
    listed = hydra_private.make_parser().parse_overrides(["a=log(1,100),3", "a=3,range(0,5)", "a=1,3", *words])
    assert [hydra_private.has_list_in_list(each) for each in listed] == [True] * 2 + [False] * 8
    assert [each.value().tags for each in read[:2]] == [{"log"}, {"whole"}]
    assert (read[0].value().start, read[0].value().end) == (1.0, 100.0)


def test_overrides_say_what_kind_they_are():
    """Setting, adding, deleting; one value or several."""
    change, add, delete = parsed("pressure=1,2", "+shape.outline.width=3", "~sintering.C3")
    kinds = hydra_private.OverrideType
    assert (change.type, add.type, delete.type) == (kinds.CHANGE, kinds.ADD, kinds.DEL)
    assert change.is_sweep_override() and change.is_discrete_sweep() and not add.is_sweep_override()
    assert (change.get_key_element(), change.key_or_group, change.package) == ("pressure", "pressure", None)
    assert list(change.sweep_iterator()) == [1, 2] and add.value() == 3
    assert parsed("hydra.launcher.workers=2")[0].is_hydra_override()


@pytest.mark.parametrize("value", [1, 2.5, "word", "a b", [1, 2], {"a": 1}, None, True])
def test_a_value_as_text_is_read_back(value):
    """As it stood in an override; what is quoted there stays quoted."""
    (override,) = parsed(f"key={hydra_private.as_text(value)}")
    assert override.value() == value


def test_a_launcher_is_set_up(hydra):
    """With the context that Hydra itself would make, it is instantiated from the configuration of a sweep."""
    with quiet_about_schemas():
        config = hydra.compose_config("config", [], RunMode.MULTIRUN, with_log_configuration=False)
    context = hydra_private.context_of(hydra, config)
    assert context.config_loader is hydra.config_loader
    context.callbacks.on_multirun_start(config=config)
    launcher = Plugins.instance().instantiate_launcher(
        hydra_context=context, task_function=lambda _: None, config=config
    )
    assert type(launcher).__name__ == "LocalLauncher"


def test_what_a_job_raised_is_told_and_not_raised():
    """Asking plainly raises; what it returned comes back as it was."""
    failed, done = JobReturn(status=JobStatus.FAILED), JobReturn(status=JobStatus.COMPLETED)
    failed.return_value, done.return_value = ValueError("no snow"), "path"
    with pytest.raises(ValueError, match="no snow"):
        _ = failed.return_value
    assert str(hydra_private.result_of(failed)) == "no snow"
    assert hydra_private.result_of(done) == "path"


def test_options_can_be_offered_that_no_file_has():
    """They go into the whole configuration, win over it, and may choose other options."""
    hydra_private.offer_options(
        "variant",
        {"windy": {"reading": {"gravity": 77.0}}, "metric": {"defaults": [{"override /reading": "si"}], "seed": 5}},
    )
    try:
        hydra_private.forget_hydra()
        with initialize_config_dir(version_base="1.3", config_dir=str(CONF_DIR)), quiet_about_schemas():
            windy, metric = (compose("config", [f"variant={name}"]) for name in ("windy", "metric"))
    finally:
        for name in ("windy", "metric"):
            del ConfigStore.instance().repo["variant"][f"{name}.yaml"]
    assert (windy.reading.gravity, windy.seed) == (77.0, 0)
    assert (metric.reading.name, metric.seed) == ("si", 5)
    assert "variant" not in OmegaConf.to_container(windy)


def test_what_is_offered_again_counts_as_it_is_now():
    """Other content, and the same once Hydra has forgotten it."""
    kept = ConfigStore.instance().repo.setdefault("variant", {})
    for gravity in (77.0, 78.0, 78.0):
        hydra_private.offer_options("variant", {"windy": {"reading": {"gravity": gravity}}})
        assert kept["windy.yaml"].node.reading.gravity == gravity
    del kept["windy.yaml"]
    hydra_private.offer_options("variant", {"windy": {"reading": {"gravity": 78.0}}})
    assert kept.pop("windy.yaml").node.reading.gravity == 78.0


@pytest.mark.parametrize(
    ("what", "pattern"),
    [
        ("imports what is Hydra's own", r"^\s*(from|import)\s+hydra\._internal"),
        ("reads what a job holds inside", r"\._return_value"),
        ("parses overrides by the loader's inside", r"_parse_overrides_and_create"),
    ],
)
def test_nobody_else_uses_it(what, pattern):
    """Of the package and the plug-in, this one module alone."""
    files = [*PACKAGE.rglob("*.py"), *PLUGINS.rglob("*.py")]
    assert len(files) > 100
    users = [path for path in files if re.search(pattern, path.read_text(encoding="utf-8"), re.MULTILINE)]
    assert users == [HOME], what
