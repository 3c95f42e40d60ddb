"""What tests of reports share."""

import pytest

from snowrepro.store.provenance import provenance

MADE_BY = provenance()


@pytest.fixture(autouse=True)
def _no_git(monkeypatch):
    """One look at the clone is enough."""
    monkeypatch.setattr("snowrepro.store.run.provenance", lambda: MADE_BY)
