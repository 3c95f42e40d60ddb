"""One condition of the snow beside another, such as its material or temperature: claims, measures, and the snow."""

import math
from collections.abc import Iterator, Sequence

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...evidence.ablation import STATES
from ...evidence.claims import ARMS, JudgedScene, select_arm
from ...evidence.conditions import (
    Condition,
    Standing,
    find_where_claims_hold,
    is_mostly_settled,
    list_arms,
    split_conditions,
)
from ...evidence.gather import Evidence, sort_as_in_paper
from ...quantities import add_unit
from ...store.run import Run
from ...text import make_cells
from ..document import NO_RESULT, Block, FigureContent, Heading, Picture, Table, escape, format_code, join_names
from ..drawing.columns import escape_label, format_value, is_number
from ..drawing.common import SINTERED, choose_font, save_figure
from ..drawing.ends import draw_ends, read_end
from ..drawing.states import CRUSHED, LOOSE
from ..sections.claims import P50, SHORT, tabulate_by_scene
from .kinds import FigureKind

CSV, CURVES = "conditions.csv", "conditions.png"
PANEL = 1.5  # width of a panel of snow [inches]
COLOURS = dict(zip(STATES, (SINTERED, CRUSHED, LOOSE), strict=True))
NAMES = dict(zip(STATES, ("lumps", "crushed", "loose"), strict=True))
LINES = dict(zip(ARMS, ("-", ":"), strict=True))


def report(evidence: Evidence) -> FigureContent:
    """Show under which conditions claims hold, the three states over pressure under each, and the snow at the end."""
    if evidence.table.empty:
        return NO_RESULT
    conditions = split_conditions(evidence)
    table = pd.DataFrame(list(_list_rows(conditions)))
    make_cells(table).to_csv(evidence.folder / CSV, index=False, float_format="%.6g", lineterminator="\n")
    draw_curves(conditions, evidence)
    names = join_names([format_code(evidence.sweep.key_of(name)) for name in conditions[0].values], "and")
    blocks: list[Block] = [
        Table(
            pd.concat([_tabulate_claims(condition) for condition in conditions]).map(escape),
            f"Claims by {names} and scene. yes: reproduced; no: contradicted; open: inconclusive; \\* by calibration, "
            f"no test; - the numbers disagree. {P50.format(unit=evidence.pressure_unit)}. Settled: runs at whose end "
            "hardly any snow comes apart or is crushed any more. Rebound: speed after the impact over that before.",
        ),
        Picture(
            CURVES,
            f"Parts of the mass in lumps, crushed and loose over pressure: a column for each {names}, a row a scene.",
            "Parts of the mass at the end over the nominal pressure: points are seeds, lines join their means; dotted "
            "without sintering.",
            data=CSV,
        ),
        Heading("The snow at the end"),
        *(_draw_ends(conditions, scene.shape, scene.floor, evidence) for scene in conditions[0].evidence.scenes),
    ]
    return FigureContent(blocks, _summarise(conditions))


def _list_rows(conditions: Sequence[Condition]) -> Iterator[dict[str, object]]:
    """List the measures at the end: means over seeds by condition, scene, arm and pressure."""
    for condition in conditions:
        for scene in condition.evidence.scenes:
            for arm in list_arms(conditions):
                means = pd.DataFrame({state: select_arm(scene.table, arm, state).mean() for state in STATES})
                for pressure, row in means.iterrows():
                    yield {**condition.values, "scene": scene.name, "arm": arm, "pressure": pressure, **row}


def name_condition(condition: Condition) -> str:
    """Name a condition by the values of its settings: "cam_clay"; numbers with what they are: "temperature 263.15"."""
    if not condition.values:
        return "all runs"
    sweep = condition.evidence.sweep
    return ", ".join(
        f"{sweep.key_of(name).rpartition('.')[2]} {format_value(value)}" if is_number(sweep, name) else str(value)
        for name, value in condition.values.items()
    )


def _tabulate_claims(condition: Condition) -> pd.DataFrame:
    """Tabulate the verdicts under one condition, a row for each scene; and whether its snow came to rest."""
    evidence = condition.evidence
    heads = {evidence.sweep.key_of(name): format_value(value) for name, value in condition.values.items()}
    rows = tabulate_by_scene(evidence, SHORT).to_dict("records")
    return pd.DataFrame(
        [{**heads, **row, **_describe_rest(s.table)} for row, s in zip(rows, evidence.scenes, strict=True)]
    )


def _describe_rest(table: pd.DataFrame) -> dict[str, str]:
    """Describe in how many runs the snow settled, and how far it sprang back from the floor."""
    if table.empty:
        return {"settled": "-", "rebound": "-"}
    settled, rebound = table["settled"].astype(float), table["rebound"].astype(float)
    return {"settled": f"{settled.sum():.0f} of {len(table)}", "rebound": f"{rebound.min():.2f} to {rebound.max():.2f}"}


def _summarise(conditions: Sequence[Condition]) -> str:
    """Say for each scene which claims hold under all conditions, which under some, and which under none."""
    sentences = []
    for scene, claims in find_where_claims_hold(conditions).items():
        groups: dict[str, list[str]] = {}
        for claim, standing in claims.items():
            groups.setdefault(_describe_where(standing), []).append(claim)
        parts = [f"{where}: {join_names(names, 'and')}" for where, names in groups.items()]
        sentences.append(f"{scene[0].upper()}{scene[1:]}: reproduced {'; '.join(parts)}.")
    sentences += [_describe_lumps(number, conditions) for number in range(len(conditions[0].evidence.scenes))]
    if any("*" in sentence for sentence in sentences):
        sentences.append(f"(* with {name_condition(conditions[0])} by calibration, no test.)")
    restless = [name_condition(each) for each in conditions if not is_mostly_settled(each)]
    if restless:
        sentences.append(f"With {join_names(restless, 'and')} most runs have not settled at their end.")
    return " ".join(filter(None, sentences))


def _describe_lumps(number: int, conditions: Sequence[Condition]) -> str:
    """Describe the mass in lumps of a scene under each condition, at the highest pressure with sintering."""
    highest = max(run.case.pressure for run in conditions[0].evidence.runs)
    scenes = [condition.evidence.scenes[number] for condition in conditions]
    lumps = [select_arm(scene.table, ARMS[0], STATES[0]).mean().get(highest, math.nan) for scene in scenes]
    known = [
        f"{value:.2f} with {name_condition(condition)}"
        for condition, value in zip(conditions, lumps, strict=True)
        if not math.isnan(value)
    ]
    return f"In lumps at {highest:g} with sintering, {scenes[0].name}: {join_names(known, 'and')}." if known else ""


def _describe_where(standing: Standing) -> str:
    """Describe under which conditions a claim is reproduced, and under which it could not be judged."""
    holding, against, unjudged = standing.holding, standing.against, standing.unjudged
    if not holding:
        where = "under none"
    elif against:
        where = f"with {join_names([name_condition(each) for each in holding], 'and')} alone"
    else:
        where = "under every condition"
    names = join_names([name_condition(each) for each in unjudged], "and")
    return f"{where} (not judged with {names})" if unjudged else where


def draw_curves(conditions: Sequence[Condition], evidence: Evidence) -> None:
    """Draw the states over pressure: a row for each scene, a column for each condition."""
    scenes = [condition.evidence.scenes for condition in conditions]
    rows, columns = len(scenes[0]), len(conditions)
    size = (2.1 * columns + 0.8, 1.9 * rows + 1.2)
    letters = choose_font(size[0], 10.0)
    figure = Figure(figsize=size, layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    pressures = sorted({run.case.pressure for run in evidence.runs})
    for column, condition in enumerate(conditions):
        grid[0, column].set_title(escape_label(name_condition(condition)), fontsize=letters)
        for ax, scene in zip(grid[:, column], scenes[column], strict=True):
            _draw_states(ax, scene, list_arms(conditions))
            ax.set(xscale="log", ylim=(-0.04, 1.04))
            ax.set_xticks(pressures, [f"{pressure:g}" for pressure in pressures], rotation=90)
            ax.minorticks_off()
            ax.tick_params(labelsize=letters)
    for ax, scene in zip(grid[:, 0], scenes[0], strict=True):
        ax.set_ylabel(escape_label(scene.name), fontsize=letters)
    figure.supxlabel(add_unit("nominal pressure", evidence.pressure_unit), fontsize=letters)
    figure.supylabel("part of the mass", fontsize=letters)
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3, frameon=False, fontsize=letters)
    save_figure(figure, evidence.folder / CURVES)


def _draw_states(ax: Axes, scene: JudgedScene, arms: Sequence[str]) -> None:
    """Draw the states of one scene over pressure: seeds as points, and lines that join their means."""
    ax.set_facecolor("0.88")  # the colours of the three states are seen on it
    for arm in arms:
        for state in STATES:
            values = select_arm(scene.table, arm, state)
            for _, seed in values.iterrows():
                ax.plot(seed.index, seed, ".", color=COLOURS[state], ms=4)
            means = values.mean()
            label = NAMES[state] if arm == arms[0] else None
            ax.plot(means.index, means, LINES[arm], color=COLOURS[state], lw=1.8, label=label)


def _draw_ends(conditions: Sequence[Condition], shape: str, floor: str, evidence: Evidence) -> Picture:
    """Draw the last frames on one scene: a row for each condition, a column for each arm and pressure."""
    shown = {
        (escape_label(name_condition(condition)), _name_cell(run)): read_end(run, evidence.is_done(run))
        for condition in conditions
        for run in sort_as_in_paper(condition.evidence.first_seed_runs)
        if (run.case.shape.name, run.case.floor.name) == (shape, floor)
    }
    rows, columns = (list(dict.fromkeys(names)) for names in zip(*shown, strict=True))
    file = f"ends-{shape}-{floor}.png"
    draw_ends(shown, rows, columns, PANEL, evidence.folder / file)
    return Picture(
        file,
        f"Last frames of {shape} on {floor}: a row for each condition, a column for each pressure.",
        f"{shape} on {floor}, last frame, seed {evidence.seeds[0]}. Each lump in a colour, crushed snow dark, loose "
        "snow the colour of sand.",
        data="summary.csv",
    )


def _name_cell(run: Run) -> str:
    """Name a run by its pressure and arm."""
    return f"{run.case.pressure:g}\n{run.case.arm}"


FIGURE = FigureKind(report)
