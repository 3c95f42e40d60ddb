"""Two columns of a sweep against each other: what is drawn, and what is refused with which words."""

import numpy as np
import pytest

from snowrepro.errors import ConfigError
from snowrepro.evidence.collect import collect_sweep
from snowrepro.report.drawing import columns, plot
from snowrepro.sweep import record
from snowrepro.sweep.plan import make_plan
from tests.report.reports import fill


def rising(run) -> float | None:
    """Lumps that rise with pressure and a little with the seed, but only with sintering; one run has no result."""
    if (run.case.pressure, run.case.sintering.name, run.case.seed) == (2000, "none", 1):
        return None
    return (run.case.pressure / 4000 + 0.02 * run.case.seed) * run.case.sintering.enabled


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """A remembered sweep over pressure, sintering, gravity and two seeds; its name and store."""
    store = tmp_path_factory.mktemp("store")
    varied = ["pressure=500,2000", "sintering=paper,none", "reading.gravity=10,20", "seed=0,1"]
    plan = fill(make_plan([*varied, f"store={store}"], multirun=True), rising)
    record.write_record(plan)
    return record.name_sweep(plan.overrides), store


@pytest.fixture(scope="module")
def sweep(swept):
    """Its table."""
    return plot.collect_remembered(*swept)


def points_of(ax) -> np.ndarray:
    """All points of a panel (n, 2)."""
    return np.concatenate([np.asarray(dots.get_offsets()) for dots in ax.collections])


def test_seeds_are_points_and_their_means_lines(swept):
    """A line for each gravity and sintering, through means over seeds; runs without a result are said."""
    collected = plot.collect_remembered(swept[0], swept[1])
    figure = plot.draw_columns(collected, plot.assign_roles(collected, "pressure", "lump_fraction", "sintering"))
    (ax,) = figure.axes
    assert len(points_of(ax)) == 14  # of 16
    assert len(ax.lines) == 4
    sintered = [line for line in ax.lines if line.get_color() == plot.PALETTE[0]]
    assert len(sintered) == 2
    for line in sintered:
        np.testing.assert_allclose(line.get_xydata(), [[500, 0.135], [2000, 0.51]])
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["paper", "none"]
    assert figure.get_supylabel() == "mass in lumps"
    label, note = figure.get_supxlabel().split("\n")
    assert label == "nominal pressure [kg cell⁻¹ s⁻²]"
    assert note == "points: runs; lines: means over 2 seeds; 2 of 16 runs have no result"


def test_no_line_goes_over_what_has_no_result(tmp_path):
    """As if it had been measured there."""
    plan = make_plan(["pressure=500,1000,2000", "sintering=paper", f"store={tmp_path}"], multirun=True)
    sweep = collect_sweep(fill(plan, lambda run: None if run.case.pressure == 1000 else 0.5))
    (ax,) = plot.draw_columns(sweep, plot.assign_roles(sweep)).axes
    np.testing.assert_equal(ax.lines[0].get_ydata(), [0.5, np.nan, 0.5])
    assert len(points_of(ax)) == 2


def test_what_is_not_named_is_chosen(sweep):
    """The first setting that varies in numbers, the lumps, and sintering."""
    assert plot.assign_roles(sweep) == plot.Roles("pressure", "lump_fraction", "sintering")
    assert plot.assign_roles(sweep, panel="sintering").colour == "reading_gravity"
    assert columns.list_steered(sweep) == ["pressure", "reading_gravity"]


def test_a_setting_is_named_as_it_is_typed(sweep):
    """Its values are numbers although they were written as text."""
    roles = plot.assign_roles(sweep, x="reading.gravity", colour="pressure")
    assert roles.x == "reading_gravity"
    figure = plot.draw_columns(sweep, roles)
    assert set(points_of(figure.axes[0])[:, 0]) == {10.0, 20.0}
    assert figure.get_supxlabel().startswith("reading.gravity\n")


def test_panels_and_names_along_the_axis(sweep):
    """A panel for each gravity with the same axes; names have ticks, and means that are not joined."""
    figure = plot.draw_columns(
        sweep, plot.assign_roles(sweep, x="sintering", colour="pressure", panel="reading.gravity")
    )
    assert [ax.get_title() for ax in figure.axes] == ["reading.gravity 10", "reading.gravity 20"]
    for ax in figure.axes:
        assert [tick.get_text() for tick in ax.get_xticklabels()] == ["paper", "none"]
        assert {line.get_linestyle() for line in ax.lines} == {"None"}
    assert "dashes: means over 2 seeds" in figure.get_supxlabel()


def test_seeds_that_are_drawn_are_not_averaged(sweep):
    """Each has lines of its own."""
    (ax,) = plot.draw_columns(sweep, plot.assign_roles(sweep, colour="seed")).axes
    assert len(ax.lines) == 8 and len({line.get_color() for line in ax.lines}) == 2


def test_what_was_measured_is_joined_by_no_line(sweep):
    """Lumps over seconds, coloured by lumps."""
    figure = plot.draw_columns(sweep, plot.assign_roles(sweep, x="seconds", colour="lump_fraction"))
    assert not figure.axes[0].lines and len(points_of(figure.axes[0])) == 14
    assert figure.get_supxlabel().startswith("wall time of the run [s]\npoints: runs; 2 of 16")


def test_many_numbers_have_a_scale(tmp_path):
    """More than a legend can name."""
    pressures = ",".join(str(100 * number) for number in range(1, 10))
    plan = fill(make_plan([f"pressure={pressures}", f"store={tmp_path}"], True), lambda run: 0.5)
    sweep = collect_sweep(plan)
    figure = plot.draw_columns(sweep, plot.assign_roles(sweep, x="seed", colour="pressure"))
    assert not figure.legends
    assert figure.axes[-1].get_ylabel() == "nominal pressure [kg cell⁻¹ s⁻²]"


def test_axes_can_be_logarithmic(sweep):
    """Values that cannot be on one are said."""
    figure = plot.draw_columns(sweep, plot.assign_roles(sweep, log="x"))
    assert figure.axes[0].get_xscale() == "log" and figure.axes[0].get_yscale() == "linear"
    with pytest.raises(ConfigError, match="'lump_fraction' has values that are not above zero"):
        plot.draw_columns(sweep, plot.assign_roles(sweep, log="xy"))


@pytest.mark.parametrize(
    ("roles", "told"),
    [
        ({"x": "presure"}, r"has no column 'presure'; did you mean 'pressure'\? There are:\n  pressure, shape, floor,"),
        ({"y": "reading.gravty"}, r"has no column 'reading.gravty'; did you mean 'reading.gravity'\?"),
        ({"colour": "run_id"}, "has no column 'run_id'"),
        ({"y": "definition"}, "'definition' holds words, and the upright axis needs numbers"),
        ({"y": "rebound"}, "nothing to draw: 2 of 16 runs have no result, 14 of 16 runs have no 'rebound'"),
        ({"log": "z"}, r"log: should be x, y or xy \(got 'z'\)"),
    ],
)
def test_what_cannot_be_drawn_is_said(sweep, roles, told):
    """A column that is not there with the one that is near, words where numbers are needed, and no value at all."""
    with pytest.raises(ConfigError, match=told):
        plot.draw_columns(sweep, plot.assign_roles(sweep, **roles))


@pytest.mark.parametrize(("kind", "first"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("PDF", b"%PDF")])
def test_files_by_their_endings(sweep, tmp_path, kind, first):
    """The same drawing gives the same bytes, and leaves nothing beside the file."""
    paths = [tmp_path / f"{name}.{kind}" for name in "ab"]
    for path in paths:
        plot.save_plot(plot.draw_columns(sweep, plot.assign_roles(sweep)), path)
    a, b = [path.read_bytes() for path in paths]
    assert a == b and a.startswith(first)
    assert sorted(tmp_path.iterdir()) == paths


def test_another_ending_is_refused(tmp_path):
    with pytest.raises(ConfigError, match=r"a plot is a \.png, \.svg or \.pdf file"):
        plot.read_format(tmp_path / "plot.jpg")


def test_text_from_data_is_no_formula():
    """Dollars are shown, and letters that act on a terminal are not."""
    assert columns.escape_label("$x$\x1b") == r"\$x\$\x1b"
