"""Whether lumps follow hardness, on snows whose answer is known."""

import numpy as np
import pandas as pd
import pytest

from snowrepro.evidence import hardness
from snowrepro.settings.case import ARMS


def snows(hardness_of, lumps_of):
    """Sintered and unsintered snow at six pressures, with hardness and lumps by pressure and arm."""
    pressures = (100, 200, 400, 800, 1600, 3200)
    index = pd.MultiIndex.from_tuples([(arm, "any", p, 0) for arm in ARMS for p in pressures], names=hardness.KEYS)
    rows = [{"hardness": hardness_of(arm, p), "lump_fraction": lumps_of(arm, p)} for arm, _, p, _ in index]
    return pd.DataFrame(rows, index=index)


def sintered_alone(arm, pressure):
    return pressure / 4000 * (arm == "sintered")


@pytest.mark.parametrize(
    ("hardness_of", "lumps_of", "start"),
    [
        (lambda arm, p: p * (3 if arm == "sintered" else 0.01), sintered_alone, "Lumps follow hardness: "),
        (lambda arm, p: p * (1 if arm == "sintered" else 0.6), sintered_alone, "Lumps follow hardness only in part: "),
        (lambda arm, p: p * (1 if arm == "sintered" else 9), sintered_alone, "Lumps follow hardness only in part: "),
        (lambda arm, p: p, lambda arm, p: [0.3, 0.1, 0.4, 0.4, 0.1, 0.2][p // 100 % 6], "Lumps do not follow"),
    ],
)
def test_the_verdict_on_lumps_and_hardness_can_go_each_way(hardness_of, lumps_of, start):
    """They rise together; together, but not at equal hardness; in one arm alone; not at all."""
    sentence = hardness.write_sentence(snows(hardness_of, lumps_of))
    assert sentence.startswith(start), sentence


def test_snows_of_equal_hardness_are_set_side_by_side():
    """Unsintered snow at twice the pressure is as hard: 400 stands beside sintered 200, 100 beside none."""
    alike = hardness.find_equal_hardness(snows(lambda arm, p: p * (1 if arm == "sintered" else 0.5), sintered_alone))
    assert alike["pressure"].tolist() == [200, 400, 800, 1600, 3200]
    np.testing.assert_allclose(alike["sintered"], alike["hardness"] / 4000)
    assert (alike["unsintered"] == 0).all()


def test_snow_that_pressing_left_alike_has_one_rank():
    """Round-off makes no order."""
    same = pd.Series(1000.0 + 1e-4 * np.arange(6))
    assert np.isnan(hardness.correlate_ranks(pd.Series(np.arange(6.0)), same).rho)
    assert hardness.correlate_ranks(pd.Series(np.arange(6.0)), 10.0 ** pd.Series(np.arange(6.0))).rho == pytest.approx(
        1.0
    )
