"""A law is part of what a run is, unless it is the paper's: then ids are what they were before there was a choice."""

import pytest

from snowrepro.composition.compose import compose, config_from
from snowrepro.errors import ConfigError
from snowrepro.store.identity import is_id_of, run_id


def id_of(*overrides: str) -> str:
    return run_id(compose(list(overrides)).case)


def test_the_paper_s_laws_are_not_written_down():
    """Said or not, the run is the same, and a configuration that was stored before is read as theirs."""
    config = compose([])
    assert "law" not in config.settings()["material"] and "law" not in config.settings()["sintering"]
    assert id_of("+material.law.name=stomakhin", "+sintering.law.name=paper") == id_of()
    assert config_from(config.settings()).case.material.law.name == "stomakhin"


@pytest.mark.parametrize(
    "overrides",
    [
        ["material=cam_clay"], ["material=cam_clay", "material.law.slope=0.6"], ["material=sand"],
        ["sintering=constant"], ["sintering=maeno"], ["sintering=maeno", "sintering.law.temperature=250"],
    ],
)  # fmt: skip
def test_another_law_or_parameter_is_another_run(overrides):
    """Its id can be found again from what is stored of it."""
    config = compose(overrides)
    own = run_id(config.case)
    assert own != id_of()
    assert is_id_of(own, config.settings())
    if len(overrides) > 1:
        assert own != id_of(overrides[0])


def test_a_wrong_parameter_is_told_by_its_name():
    """Without the name of the law between, and with the parameters that there are."""
    with pytest.raises(ConfigError, match=r"material\.law\.slope: should be greater than 0 \(got -1"):
        compose(["material=cam_clay", "material.law.slope=-1"])
    with pytest.raises(ConfigError, match=r"no setting 'material\.law\.slop'; did you mean 'material\.law\.slope'"):
        compose(["material=cam_clay", "material.law.slop=1"])
