"""How a run is classified: by its own settings, or by those that are given."""

import pytest

from snowrepro.errors import ConfigError, DataError
from snowrepro.summary.classify import change_settings, classify, compose_analysis


def test_frames_that_are_not_there_are_refused(small_run):
    """There are no bonds before release, and no fragments of frames that were not kept."""
    for frame in (8, 21):
        with pytest.raises(DataError, match="not stored at or after the release"):
            classify(small_run, frames=[frame])


def test_one_frame_needs_no_list(small_run):
    """Of a frame alone come the fragments that a list of it has."""
    last = int(small_run["frame"][-1])
    assert classify(small_run, frames=last).table().equals(classify(small_run, frames=[last]).table())


def test_a_definition_is_no_analysis(small_run):
    """As docs and commands name it otherwise."""
    with pytest.raises(ConfigError, match=r"analysis should be an Analysis, not 'bonds'.* definition=\.\.\."):
        classify(small_run, analysis="bonds")
    with pytest.raises(ConfigError, match=r"no setting 'analysis' of the analysis; a definition is named by"):
        change_settings(compose_analysis(), {"analysis": "bonds"})


def test_settings_travel_with_the_run_and_can_be_changed(small_run, small_config):
    """A run says of itself how it is to be classified; a wrong name lists the right ones."""
    assert classify(small_run, frames=[20]).analysis == small_config.question.analysis
    assert classify(small_run, frames=[20]).last.largest > 0.999
    assert classify(small_run, frames=[20], definition="grid").analysis.definition == "grid"
    with pytest.raises(ConfigError, match=r"no setting 'brake_strain'.*break_strain"):
        classify(small_run, brake_strain=0.2)
    with pytest.raises(ConfigError, match=r"break_strain.*greater than 0"):
        classify(small_run, break_strain=-1)
    with pytest.raises(ConfigError, match="'bonds', 'proximity', 'grid' or 'damage'"):
        classify(small_run, definition="colour")
