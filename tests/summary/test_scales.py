"""Numbers without units: what they are, and that no unit changes them."""

import pytest

from snowrepro.composition.compose import compose
from snowrepro.summary import row as rows
from snowrepro.summary.columns import SCALE_COLUMNS
from snowrepro.summary.scales import measure_scales, measure_size
from tests.conftest import SMALL


def scales_of(*overrides: str) -> dict[str, float]:
    return measure_scales(compose(overrides).case)


def test_the_numbers_of_the_default_reading():
    """By hand: 100 kg/cell^3, 10 cells/s^2, 60 cells, 1.4e5; a ball of 2 x 25.4686 cells."""
    size = 2 * 25.4686
    expected = {
        "impact_number": 100 * 10 * 60 / 1.4e5,
        "self_weight": 100 * 10 * size / 1.4e5,
        "drop_in_sizes": 60 / size,
        "press_number": 2900 / 1.4e5,
        "spacing_in_sizes": 1 / size,
    }
    assert scales_of("pressure=2900") == pytest.approx(expected, rel=1e-12)
    assert list(expected) == list(SCALE_COLUMNS)


def test_another_unit_of_length_changes_none():
    """Metres in place of cells, with gravity and modulus converted; density times length^3 is a mass."""
    plain = scales_of("pressure=2900")
    cell = 0.02
    metres = scales_of(
        "reading=si", f"reading.gravity={10 * cell}", f"material.E={1.4e5 / cell}", f"pressure={2900 / cell}",
        f"material.rho={100 / cell**3}", f"sintering.rho_max={700 / cell**3}", f"material.mass={0.01}",
        "solver.max_substeps=100000",
    )  # fmt: skip
    assert metres == pytest.approx(plain, rel=1e-12)


def test_the_size_is_the_height_before_pressing():
    """Of a body that is wider than high its height, wherever it lies."""
    points = "[[5,1],[45,1],[45,9],[5,9]]"
    outline = f"{{kind: polygon, points: {points}}}"
    case = compose(["shape=rectangle", f"shape.outline={outline}"]).case
    assert measure_size(case) == 8.0


def test_a_hardness_test_does_not_fall():
    falls, tested = scales_of(), scales_of("indenter=disc")
    none = dict.fromkeys(("impact_number", "self_weight", "drop_in_sizes"), 0.0)
    assert tested == {**falls, **none}


def test_rows_of_before_have_them_too(small_run, tmp_path):
    """A row that was stored without them gets them as it is read, and what is stored stays as it was."""
    config = compose([*SMALL, f"store={tmp_path}"])
    run = rows.Run(config)
    run.save(small_run)
    run.save_row(rows.make_key(config.question.analysis), {"run_id": run.id})
    assert rows.read_row(run) == {"run_id": run.id, **measure_scales(run.case)}
    assert run.row(rows.make_key(config.question.analysis)) == {"run_id": run.id}
