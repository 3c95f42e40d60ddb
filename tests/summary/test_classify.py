"""How a run is classified: by its own settings, or by those that are given."""

import pytest

from snowrepro.errors import ConfigError, DataError
from snowrepro.summary.classify import classify


def test_frames_that_are_not_there_are_refused(small_run):
    """There are no bonds before release, and no fragments of frames that were not kept."""
    for frame in (8, 21):
        with pytest.raises(DataError, match="not stored at or after the release"):
            classify(small_run, frames=[frame])


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
