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
from ...evidence.sensitivity import CHOICES, HALF_CHANGES, measure_lump_curve, scan_definitions
from ...quantities import add_unit
from ...settings.analysis import Analysis
from ...settings.question import Claim
from ...store.run import Run
from ...text import make_cells
from ..document import Block, Heading, Picture, Table, format_list
from ..drawing.common import save_figure
from .broken import assign_colours

HOLDS, LOST, USUAL = "#0072B2", "#bbbbbb", "#D55E00"
NAMES = {
    "definition": "rule",
    "strain_radius": "neighbourhood [cells]",
    "part_stretch": "stretch that parts",
    "half_change": "half change of volume",
    "break_by": "bonds break by",
    "break_strain": "break strain",
    "core_fraction": "core rule",
    "link_length": "longest bond",
    "lump_mass": "least lump",
}
SCANNED = ("strain", "bonds")  # rules of which more than one choice is varied
OTHERS = "other rules"
SPECIFICATION = Picture(
    "specification.png",
    "Specification curve: every setting of every rule, sorted by what pressure does to the lumps under it, and below "
    "what each chose.",
    "Top: lumps at the highest less those at the lowest pressure, sintered; blue where all claims hold, grey where one "
    "is lost, the setting used here in orange. Below: what each chose. Each rule has the same width, however many "
    "settings of it were tried. This shows how much hangs on the choices; it is not one better test, and settings of "
    "a rule are no independent trials.",
    data="sensitivity.csv",
)
STRAINS = Picture(
    "strains.png",
    "Mass in lumps over the change of volume at which snow is half crushed or half loose, a curve for each run.",
    "Mass in lumps, on clusters, over the change of volume at which snow is half crushed or half loose, |ln|; all else "
    "as used here. Each curve is one run: solid with sintering, dotted without. The upright line is the change used.",
    data="strains.csv",
)


def make_blocks(evidence: Evidence) -> list[Block]:
    """Scan settings of all rules and show under how many of them the claims hold, or say why there is no scan.

    One seed is scanned: seeds differ by far less than settings, and a scan takes longer than all else of a report.
    """
    runs = evidence.first_seed_runs
    obstacle = _explain_no_scan(evidence)
    if obstacle:
        return [Heading("Does it hang on the definition of a lump?"), f"Not scanned: {obstacle}."]
    choices, lumps = _scan_runs(runs)
    holds = pd.DataFrame({claim.name: claims.check_agreement(claim, lumps) for claim in _choose_claims(runs)})
    _write_scan(choices, lumps, holds, evidence)
    analysis = runs[0].config.question.analysis
    draw_specifications(choices, lumps, holds, find_usual(choices, analysis), evidence)
    draw_strains(runs, evidence)
    return [
        Heading("Does it hang on the definition of a lump?"),
        (
            f"The runs of seed {evidence.seeds[0]} by {describe_rules(choices, analysis)}. Settings of one rule are "
            "much alike: read each rule by itself, and no number over all of them. The numbers agree with the claims "
            "in this part of each:"
        ),
        Table(_tabulate_by_choice(choices, holds), data="sensitivity.csv"),
        *list_exceptions(choices, holds, analysis),
        SPECIFICATION,
        STRAINS,
    ]


def describe_rules(choices: pd.DataFrame, analysis: Analysis) -> str:
    """Say how many rules of what holds snow together there are, and how many settings of each were tried."""
    counts = choices["definition"].value_counts(sort=False)
    used = {analysis.definition: ", the rule used here"}
    parts = [f"{rule} ({count}{used.get(rule, '')})" for rule, count in counts.items()]
    return f"{len(counts)} rules of what holds snow together, each under many settings: {', '.join(parts)}"


def _choose_claims(runs: Sequence[Run]) -> list[Claim]:
    """Choose the claims on the mass in lumps of one scene, for whose arms there are runs."""
    arms = {run.case.arm for run in runs}
    all_claims = runs[0].config.question.claims.list
    by_lumps = [claim for claim in all_claims if claim.test != "scenes" and claim.measure == "lump_fraction"]
    return [claim for claim in by_lumps if set(claims.ARMS_OF[claim.of]) <= arms]


def search_other_pressures(evidence: Evidence) -> list[Block]:
    """Search each setting's own three pressures of a ladder, at which the claims on sintered snow hold.

    ``make_blocks`` is unfair to settings that were not used to choose the pressures; this is not.
    """
    runs = [run for run in evidence.first_seed_runs if run.case.sintering.enabled]
    pressures = {run.case.pressure for run in runs}
    if len(pressures) < 3 or not all(evidence.is_done(run) for run in runs):
        return []
    choices, lumps = _scan_runs(runs)
    has_three = pd.DataFrame({"three such pressures": _has_rising_three(lumps["sintered"].to_numpy())})
    return [
        Heading("Would other definitions of a lump find such pressures?"),
        (
            f"By {describe_rules(choices, runs[0].config.question.analysis)}. Are there three of the {len(pressures)} "
            f"pressures at which lumps of seed {evidence.seeds[0]} grow from less than half of the mass to more? Here "
            "each setting has pressures of its own, and not those that were chosen by the setting used here."
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
    """Compute the lumps under all settings of all rules.

    Returns the settings, one row each with columns CHOICES, and the mass in lumps by arm and pressure, mean over
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


def list_own_choices(analysis: Analysis) -> dict[str, str | float]:
    """List what an analysis chooses of CHOICES, as far as it matters to its rule."""
    values = {**analysis.model_dump(), "half_change": float(np.mean(analysis.volume_change))}
    own = {
        "strain": ("strain_radius", "part_stretch", "half_change"),
        "bonds": ("break_by", "break_strain", "core_fraction", "link_length"),
    }.get(analysis.definition, ())
    others = {"proximity": {"link_length": analysis.proximity}, "damage": {"core_fraction": analysis.damage}}
    chosen = {name: values[name] for name in ("definition", "lump_mass", *own)}
    return chosen | others.get(analysis.definition, {})


def find_usual(choices: pd.DataFrame, analysis: Analysis) -> int:
    """Find the row of the settings of an analysis; -1 if it is not among them."""
    same = np.ones(len(choices), dtype=bool)
    for name, value in list_own_choices(analysis).items():
        same &= (choices[name] == value).to_numpy()
    return int(np.argmax(same)) if same.any() else -1


def _write_scan(choices: pd.DataFrame, lumps: pd.DataFrame, holds: pd.DataFrame, evidence: Evidence) -> None:
    """Write the scan as sensitivity.csv."""
    flat = lumps.set_axis([f"{arm} {pressure:g}" for arm, pressure in lumps.columns], axis=1)
    table = pd.concat([choices, flat, holds], axis=1)
    make_cells(table).to_csv(evidence.folder / "sensitivity.csv", index=False, float_format="%.4g", lineterminator="\n")


def _tabulate_by_choice(choices: pd.DataFrame, holds: pd.DataFrame) -> pd.DataFrame:
    """Tabulate, for each rule and each value of each of its choices, in which part of its settings each claim holds."""
    rows = []
    for rule, own in choices.groupby("definition", sort=False):
        rows.append({"rule": rule, "choice": "all", "value": "", **_count_holding(holds.loc[own.index])})
        varied = [name for name in CHOICES[1:] if rule in SCANNED and len(own[name].dropna().unique()) > 1]
        for name in varied:
            for value, members in own.groupby(name, sort=True).groups.items():
                label = {"rule": rule, "choice": NAMES[name], "value": _format_value(value)}
                rows.append({**label, **_count_holding(holds.loc[members])})
    return pd.DataFrame(rows)


def _count_holding(holds: pd.DataFrame) -> dict[str, int | str]:
    """Count settings, and in which part of them each claim holds."""
    return {"settings": len(holds), **_format_shares(holds)}


def _format_value(value: object) -> str:
    """Format the value of a choice."""
    return f"{value:g}" if isinstance(value, float) else str(value)


def _format_shares(values: pd.DataFrame) -> dict[str, str]:
    """Format the share of rows in which each column is true, and in which all are."""
    return {name: f"{100 * column.mean():.0f} %" for name, column in values.items()} | {
        "all claims": f"{100 * values.all(axis=1).mean():.0f} %"
    }


def list_exceptions(choices: pd.DataFrame, holds: pd.DataFrame, analysis: Analysis) -> list[str]:
    """List the single changes of the analysis that lose a claim: of one choice, or of the rule."""
    usual, own = find_usual(choices, analysis), list_own_choices(analysis)
    if usual < 0:
        return ["The definition used here is not among them."]
    if not holds.iloc[usual].any():
        return ["By the definition used here none of these claims holds: no change of it can lose one."]
    changes = {}
    for row in np.flatnonzero(choices["definition"] == analysis.definition).tolist():
        changed = [name for name in own if choices.iloc[row][name] != own[name]]
        if len(changed) == 1:
            changes[row] = f"{NAMES[changed[0]]} {_format_value(choices.iloc[row][changed[0]])}"
    for rule in set(choices["definition"]) - {analysis.definition}:
        row = find_usual(choices, analysis.model_copy(update={"definition": rule}))
        changes |= {row: f"the rule {rule}"} if row >= 0 else {}
    lost = {row: [name for name in holds if holds[name].iloc[usual] and not holds[name].iloc[row]] for row in changes}
    lines = [f"{changes[row]}: {', '.join(lost[row])}" for row in sorted(changes) if lost[row]]
    head = "Changed one at a time from the definition used here, these lose a claim:"
    return [head, format_list(lines)] if lines else ["No single change of the definition used here loses a claim."]


def draw_specifications(
    choices: pd.DataFrame, lumps: pd.DataFrame, holds: pd.DataFrame, usual: int, evidence: Evidence
) -> None:
    """Draw the effect of pressure under every setting, sorted within each rule, and below it what each chose."""
    sintered = lumps["sintered"]
    effect = (sintered.iloc[:, -1] - sintered.iloc[:, 0]).to_numpy()
    holds_all = holds.all(axis=1).to_numpy()
    places, groups = _place_settings(choices, effect)
    levels = [(name, value) for name in CHOICES for value in _list_levels(choices, name)]
    figure = Figure(figsize=(9.2, 2.8 + 0.17 * len(levels)), layout="constrained")
    top, below = figure.subplots(2, 1, sharex=True, height_ratios=[2.2, 0.17 * len(levels)])
    top.axhline(0, color="0.6", lw=0.8)
    top.scatter(places, effect, s=5, c=np.where(holds_all, HOLDS, LOST))
    for ax in (top, below):
        for border in range(1, len(groups)):
            ax.axvline(border, color="0.4", lw=0.8)
    if usual >= 0:
        top.plot([places[usual]], [effect[usual]], "D", color=USUAL, ms=6)
        below.axvline(places[usual], color=USUAL, lw=0.8)
    top.set_ylabel("lumps, highest less\nlowest pressure", fontsize=9)
    parts = [f"{holds_all[rows].sum()} of {len(rows)} ({name})" for name, rows in groups.items()]
    top.set_title(f"all claims hold under: {', '.join(parts)}", fontsize=10, loc="left")
    _draw_choices(below, choices, levels, places, holds_all)
    below.set_xlim(0, len(groups))
    below.set_xticks(np.arange(len(groups)) + 0.5, [f"{name}: {len(rows)} settings" for name, rows in groups.items()])
    below.tick_params(axis="x", length=0, labelsize=9)
    below.set_xlabel("settings of each rule, by rising effect", fontsize=9)
    save_figure(figure, evidence.folder / "specification.png")


def _place_settings(choices: pd.DataFrame, effect: np.ndarray) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Place the settings of each rule, by rising effect, on a stretch of length 1: places (n,), and rows by rule."""
    rule = choices["definition"].where(choices["definition"].isin(SCANNED), OTHERS).to_numpy()
    groups = {name: np.flatnonzero(rule == name) for name in dict.fromkeys(rule)}
    places = np.empty(len(choices))
    for start, rows in enumerate(groups.values()):
        places[rows[np.argsort(effect[rows], kind="stable")]] = start + (np.arange(len(rows)) + 0.5) / len(rows)
    return places, groups


def _list_levels(choices: pd.DataFrame, name: str) -> list:
    """List the values of one choice; empty text and NaN mean that it does not apply."""
    return [value for value in sorted(choices[name].dropna().unique()) if value != ""]


def _draw_choices(
    ax: Axes, choices: pd.DataFrame, levels: list[tuple], places: np.ndarray, holds_all: np.ndarray
) -> None:
    """Draw a row of marks for each value of each choice."""
    labels = []
    for row, (name, value) in enumerate(levels):
        chosen = (choices[name] == value).to_numpy()
        colours = np.where(holds_all[chosen], HOLDS, LOST)
        ax.scatter(places[chosen], np.full(chosen.sum(), row), s=9, marker="|", c=colours, lw=0.7)
        label = _format_value(value)
        first = row == 0 or levels[row - 1][0] != name
        labels.append(f"{NAMES[name]}   {label}" if first else label)
    ax.set(yticks=range(len(levels)), ylim=(len(levels) - 0.3, -0.7))
    ax.set_yticklabels(labels, fontsize=7.5)
    ax.tick_params(axis="y", length=0)


def draw_strains(runs: Sequence[Run], evidence: Evidence) -> None:
    """Draw the mass in lumps over the change of volume at which snow is half crushed or loose."""
    figure = Figure(figsize=(5.2, 4.4), layout="constrained")
    ax = figure.subplots()
    colours = assign_colours(runs)
    curves = {}
    for run in runs:
        lumps = measure_lump_curve(run)
        curves[f"{run.case.arm} {run.case.pressure:g} seed {run.case.seed}"] = lumps
        style = "-" if run.case.sintering.enabled else ":"
        label = f"{run.case.pressure:g}, {'sintered' if run.case.sintering.enabled else 'not sintered'}"
        ax.plot(HALF_CHANGES, lumps, style, color=colours[run.case.pressure], lw=1.2, label=label)
    ax.axvline(sum(runs[0].config.question.analysis.volume_change) / 2, color=USUAL, lw=0.8)
    ax.axhline(0.5, color="0.6", lw=0.8, ls=":")
    ax.set(ylim=(-0.02, 1.02), xlabel="half change of volume, |ln|", ylabel="mass in lumps")
    handles, labels = ax.get_legend_handles_labels()
    handle_of = dict(zip(labels, handles, strict=True))
    figure.legend(
        handle_of.values(), handle_of.keys(), loc="outside lower center", ncols=3, frameon=False, fontsize=8,
        title=add_unit("pressure", evidence.pressure_unit), title_fontsize=8,
    )  # fmt: skip
    save_figure(figure, evidence.folder / "strains.png")
    table = pd.DataFrame(curves, index=pd.Index(HALF_CHANGES, name="half_change"))
    make_cells(table).to_csv(evidence.folder / "strains.csv", float_format="%.4g", lineterminator="\n")
