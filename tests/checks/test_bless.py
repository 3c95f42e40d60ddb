"""What a renewed reference keeps of the old one."""

import pandas as pd

from snowrepro.checks.bless import _keep_other_rows

OLD = pd.DataFrame({"experiment": ["fig5", "fig6"], "lump_fraction": [0.2, 0.3]})


def test_rows_that_were_not_renewed_stay():
    renewed = pd.DataFrame({"experiment": ["fig5"], "lump_fraction": [0.4]})
    kept = _keep_other_rows(OLD, renewed, "experiment")
    assert dict(zip(kept["experiment"], kept["lump_fraction"], strict=True)) == {"fig6": 0.3, "fig5": 0.4}


def test_rows_of_other_columns_go_as_no_check_could_read_them():
    renewed = pd.DataFrame({"experiment": ["fig5"], "lump_fraction": [0.4], "loose_fraction": [0.0]})
    assert _keep_other_rows(OLD, renewed, "experiment").equals(renewed)
