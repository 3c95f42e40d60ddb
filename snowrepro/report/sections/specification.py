"""The section on definitions of a lump: whether verdicts depend on the definition."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...evidence import claims
from ...evidence.calibration import HALF
from ...evidence.gather import Evidence
from ...evidence.sensitivity import CHOICES, measure_lump_curve, scan_definitions
from ...quantities import add_unit
from ...settings.question import Claim
from ...store.run import Run
from ...text import make_cells
from ..document import Block, Heading, Picture, Table, format_list
from ..drawing.common import save_figure
from .broken import assign_colours

STRAINS_TO = 0.8  # where the curves over the break strain end
HOLDS, LOST, USUAL = "#0072B2", "#bbbbbb", "#D55E00"
NAMES = {
    "definition": "definition",
    "break_by": "bonds break by",
    "break_strain": "break strain",
    "core_fraction": "core rule",
    "link_length": "longest bond",
    "lump_mass": "least lump",
}
SPECIFICATION = Picture(
    "specification.png",
    "Specification curve: every definition, sorted by what pressure does to the lumps under it, and below what each "
    "chose.",
    "Top: lumps at the highest less those at the lowest pressure, sintered; blue where all claims hold, grey where one "
    "is lost, the definition used here in orange. Below: what each definition chose. This shows how much hangs on the "
    "choices; it is not one better test, and its definitions are no independent trials.",
    data="sensitivity.csv",
)
BREAK_STRAINS = Picture(
    "strains.png",
    "Mass in lumps over the strain at which a bond breaks, a curve for each run, falling with pressure.",
    "Mass in lumps over the break strain, all else as used here; each curve is one run and comes from one tree. The "
    "upright line is the strain used.",
    data="strains.csv",
)


def make_blocks(evidence: Evidence) -> list[Block]:
    """Scan all definitions and show under how many of them the claims hold, or say why there is no scan."""
    runs = list(evidence.runs)
    obstacle = _explain_no_scan(evidence)
    if obstacle:
        return [Heading("Does it hang on the definition of a lump?"), f"Not scanned: {obstacle}."]
    choices, lumps = _scan_runs(runs)
    holds = pd.DataFrame({claim.name: claims.check_agreement(claim, lumps) for claim in _choose_claims(runs)})
    _write_scan(choices, lumps, holds, evidence)
    usual = _find_usual(choices, runs[0])
    draw_specifications(choices, lumps, holds, usual, evidence)
    draw_strains(runs, evidence)
    return [
        Heading("Does it hang on the definition of a lump?"),
        (
            f"All runs under {len(choices)} definitions. {(choices['definition'] == 'bonds').sum()} of them are one "
            "rule, bonds, with its choices in all combinations; the others are three other rules of what holds "
            "together. So a share of them is no share of opinions. By the means over seeds the claims hold in this "
            "part of them:"
        ),
        Table(_tabulate_by_choice(choices, holds), data="sensitivity.csv"),
        *_list_exceptions(choices, holds, usual),
        SPECIFICATION,
        BREAK_STRAINS,
    ]


def _choose_claims(runs: Sequence[Run]) -> list[Claim]:
    """Choose the claims on the mass in lumps of one scene, for whose arms there are runs."""
    arms = {run.case.arm for run in runs}
    all_claims = runs[0].config.question.claims.list
    by_lumps = [claim for claim in all_claims if claim.test != "scenes" and claim.measure == "lump_fraction"]
    return [claim for claim in by_lumps if set(claims.ARMS_OF[claim.of]) <= arms]


def search_other_pressures(evidence: Evidence) -> list[Block]:
    """Search each definition's own three pressures, among those of a ladder, at which claims on sintered snow hold.

    ``make_blocks`` is unfair to definitions that were not used to choose the pressures; this is not.
    """
    runs = [run for run in evidence.runs if run.case.sintering.enabled]
    pressures = {run.case.pressure for run in runs}
    if len(pressures) < 3 or not all(evidence.is_done(run) for run in runs):
        return []
    choices, lumps = _scan_runs(runs)
    has_three = pd.DataFrame({"three such pressures": _has_rising_three(lumps["sintered"].to_numpy())})
    return [
        Heading("Would other definitions of a lump find such pressures?"),
        (
            f"For each of {len(choices)} definitions: are there three of the {len(pressures)} pressures at which, by "
            "means over seeds, lumps grow, the lowest gives more powder and the highest more lumps? There the "
            "definition is not the one by which the pressures were chosen, but each has its own."
        ),
        Table(_tabulate_by_choice(choices, has_three).drop(columns="all claims")),
    ]


def _has_rising_three(values: np.ndarray) -> np.ndarray:
    """Find rows that have three values which rise from below to above one half.

    ``values`` (definitions, rising pressures); returns (definitions,), true where there are three.
    """
    has_three = np.zeros(len(values), dtype=bool)
    for low, middle, high in combinations(values.T, 3):
        has_three |= (low < middle) & (middle < high) & (low < HALF) & (high > HALF)
    return has_three


def _explain_no_scan(evidence: Evidence) -> str:
    """Explain why there is nothing to scan; empty if there is."""
    if not all(evidence.is_done(run) for run in evidence.runs):
        return "runs are missing"
    if len({(run.case.shape.name, run.case.floor.name) for run in evidence.runs}) > 1:
        return "these are several scenes"
    if len({run.case.pressure for run in evidence.runs if run.case.sintering.enabled}) < 2:
        return "there is no second pressure with sintering"
    if not _choose_claims(evidence.runs):
        return "no claim is about the mass in lumps of these runs"
    return ""


def _scan_runs(runs: Sequence[Run]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Compute the lumps under all definitions.

    Returns the definitions, one row each with columns CHOICES, and the mass in lumps by arm and pressure, mean over
    seeds.
    """
    by_run: dict[tuple[str, float], list[pd.Series]] = {}
    for run in runs:
        definitions = scan_definitions(run)
        key = run.case.arm, run.case.pressure
        by_run.setdefault(key, []).append(definitions["lump_fraction"])
    lumps = pd.DataFrame({key: pd.concat(by_run[key], axis=1).mean(axis=1) for key in sorted(by_run)})
    lumps.columns = pd.MultiIndex.from_tuples(lumps.columns, names=["arm", "pressure"])
    return definitions[list(CHOICES)], lumps


def _find_usual(choices: pd.DataFrame, run: Run) -> int:
    """Find the row of the definition that the reports use; -1 if it is not among them."""
    analysis = run.config.question.analysis.model_dump()
    same = np.ones(len(choices), dtype=bool)
    for name in CHOICES:
        same &= (choices[name] == analysis[name]).to_numpy()
    return int(np.argmax(same)) if same.any() else -1


def _write_scan(choices: pd.DataFrame, lumps: pd.DataFrame, holds: pd.DataFrame, evidence: Evidence) -> None:
    """Write the scan as sensitivity.csv."""
    flat = lumps.set_axis([f"{arm} {pressure:g}" for arm, pressure in lumps.columns], axis=1)
    table = pd.concat([choices, flat, holds], axis=1)
    make_cells(table).to_csv(evidence.folder / "sensitivity.csv", index=False, float_format="%.4g", lineterminator="\n")


def _tabulate_by_choice(choices: pd.DataFrame, holds: pd.DataFrame) -> pd.DataFrame:
    """Tabulate, for each value of each choice, in which part of its definitions each claim holds."""
    rows = [{"choice": "all", "value": "", "definitions": len(holds), **_format_shares(holds)}]
    bonds = choices["definition"] == "bonds"
    for name in CHOICES:
        varied = choices if name == "definition" else choices[bonds]
        for value, members in varied.groupby(name, sort=True).groups.items():
            part = holds.loc[members]
            label = f"{value:g}" if isinstance(value, float) else str(value)
            rows.append({"choice": NAMES[name], "value": label, "definitions": len(part), **_format_shares(part)})
    return pd.DataFrame(rows)


def _format_shares(values: pd.DataFrame) -> dict[str, str]:
    """Format the share of rows in which each column is true, and in which all are."""
    return {name: f"{100 * column.mean():.0f} %" for name, column in values.items()} | {
        "all claims": f"{100 * values.all(axis=1).mean():.0f} %"
    }


def _list_exceptions(choices: pd.DataFrame, holds: pd.DataFrame, usual: int) -> list[str]:
    """List the single changes of the usual definition that lose a claim."""
    if usual < 0:
        return ["The definition used here is not among them."]
    if not holds.iloc[usual].any():
        return ["By the definition used here none of these claims holds: no change of it can lose one."]
    base = choices.iloc[usual]
    lines = []
    for row in range(len(choices)):
        changed = [name for name in CHOICES if choices.iloc[row][name] != base[name]]
        other_rule = choices.iloc[row]["definition"] != base["definition"]
        if other_rule and choices.iloc[row]["lump_mass"] != base["lump_mass"]:
            continue
        if len(changed) == 1 or other_rule:
            lost = [name for name in holds if holds[name].iloc[usual] and not holds[name].iloc[row]]
            if lost:
                lines.append(f"{_describe_definition(choices.iloc[row], changed)}: {', '.join(lost)}")
    head = "Changed one at a time from the definition used here, these lose a claim:"
    return [head, format_list(lines)] if lines else ["No single change of the definition used here loses a claim."]


def _describe_definition(choice: pd.Series, changed: Sequence[str]) -> str:
    """Describe in words what a definition changes."""
    if "definition" in changed:
        detail = {"proximity": "link_length", "damage": "core_fraction"}.get(choice["definition"])
        return f"{choice['definition']} {choice[detail]:g}" if detail else str(choice["definition"])
    return ", ".join(f"{NAMES[name]} {choice[name]}" for name in changed)


def draw_specifications(
    choices: pd.DataFrame, lumps: pd.DataFrame, holds: pd.DataFrame, usual: int, evidence: Evidence
) -> None:
    """Draw the effect of pressure under every definition, sorted, and below it what each definition chose."""
    sintered = lumps["sintered"]
    effect = (sintered.iloc[:, -1] - sintered.iloc[:, 0]).to_numpy()
    order = np.argsort(effect, kind="stable")
    holds_all = holds.all(axis=1).to_numpy()[order]
    choices = choices.iloc[order]
    levels = [(name, value) for name in CHOICES for value in _list_levels(choices, name)]
    figure = Figure(figsize=(9.2, 2.6 + 0.17 * len(levels)), layout="constrained")
    top, below = figure.subplots(2, 1, sharex=True, height_ratios=[2.2, 0.17 * len(levels)])
    places = np.arange(len(order))
    top.axhline(0, color="0.6", lw=0.8)
    top.scatter(places, effect[order], s=5, c=np.where(holds_all, HOLDS, LOST))
    rank = int(np.argmax(order == usual))
    if usual >= 0:
        top.plot([rank], [effect[usual]], "D", color=USUAL, ms=6)
        below.axvline(rank, color=USUAL, lw=0.8)
    top.set_ylabel("lumps, highest less\nlowest pressure", fontsize=9)
    top.set_title(f"all claims hold under {holds_all.sum()} of {len(holds_all)} definitions", fontsize=10, loc="left")
    _draw_choices(below, choices, levels, holds_all)
    below.set_xlabel("definitions, by rising effect", fontsize=9)
    save_figure(figure, evidence.folder / "specification.png")


def _list_levels(choices: pd.DataFrame, name: str) -> list:
    """List the values of one choice; empty text and NaN mean that it does not apply."""
    return [value for value in sorted(choices[name].dropna().unique()) if value != ""]


def _draw_choices(ax: Axes, choices: pd.DataFrame, levels: list[tuple], holds_all: np.ndarray) -> None:
    """Draw a row of marks for each value of each choice."""
    labels = []
    for row, (name, value) in enumerate(levels):
        places = np.flatnonzero((choices[name] == value).to_numpy())
        ax.scatter(
            places, np.full(len(places), row), s=9, marker="|", c=np.where(holds_all[places], HOLDS, LOST), lw=0.7
        )
        label = f"{value:g}" if isinstance(value, float) else str(value)
        first = row == 0 or levels[row - 1][0] != name
        labels.append(f"{NAMES[name]}   {label}" if first else label)
    ax.set(yticks=range(len(levels)), ylim=(len(levels) - 0.3, -0.7))
    ax.set_yticklabels(labels, fontsize=7.5)
    ax.tick_params(axis="y", length=0)


def draw_strains(runs: Sequence[Run], evidence: Evidence) -> None:
    """Draw the mass in lumps over the break strain, from each run's tree."""
    figure = Figure(figsize=(5.2, 4.4), layout="constrained")
    ax = figure.subplots()
    colours = assign_colours(runs)
    curves, steps = {}, np.linspace(0, STRAINS_TO, 161)
    for run in runs:
        strain, lumps = measure_lump_curve(run)
        lumps_at_steps = lumps[np.searchsorted(strain, steps, side="right") - 1]
        curves[f"{run.case.arm} {run.case.pressure:g} seed {run.case.seed}"] = lumps_at_steps
        style = "-" if run.case.sintering.enabled else ":"
        label = f"{run.case.pressure:g}, {'sintered' if run.case.sintering.enabled else 'not sintered'}"
        ax.step(strain, lumps, style, where="post", color=colours[run.case.pressure], lw=1.2, label=label)
    ax.axvline(runs[0].config.question.analysis.break_strain, color=USUAL, lw=0.8)
    ax.axhline(0.5, color="0.6", lw=0.8, ls=":")
    ax.set(xlim=(0, STRAINS_TO), ylim=(-0.02, 1.02), xlabel="break strain", ylabel="mass in lumps")
    handles, labels = ax.get_legend_handles_labels()
    handle_of = dict(zip(labels, handles, strict=True))
    figure.legend(
        handle_of.values(), handle_of.keys(), loc="outside lower center", ncols=3, frameon=False, fontsize=8,
        title=add_unit("pressure", evidence.pressure_unit), title_fontsize=8,
    )  # fmt: skip
    save_figure(figure, evidence.folder / "strains.png")
    table = pd.DataFrame(curves, index=pd.Index(steps, name="break_strain"))
    make_cells(table).to_csv(evidence.folder / "strains.csv", float_format="%.4g", lineterminator="\n")
