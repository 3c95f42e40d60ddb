"""Write the report of an experiment: pictures, summary.csv and index.md with the verdict first."""

import shlex
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
import xarray as xr

from ..analysis import claims
from ..analysis.calibration import calibrate
from ..analysis.fragments import bond_histories, classify_frames, fragments_of
from ..analysis.summary import tidy
from ..config import Config, Experiment
from ..mpm.diagnostics import bounded
from ..store import runs
from .figures import Row, draw_calibration, draw_strip

SCAN_STRAINS = (0.2, 0.25, 0.3, 0.4, 0.5)
SCAN_CORES = (0.25, 0.3333, 0.5)

# Columns of the summary that the page shows, and their heads.
SHOWN = {
    "pressure": "pressure",
    "sintering": "sintering",
    "seed": "seed",
    "lump_fraction": "lumps [mass]",
    "lumps": "lumps [count]",
    "largest_fragment": "largest",
    "broken_bonds": "bonds broken",
    "settled": "settled",
    "density_at_release": "density",
    "hardening_at_release": "xi",
    "factor_at_release": "hardening factor",
    "poisson_capped": "nu capped",
    "hardening_capped": "Eq. 1 capped",
    "hardening_floored": "Eq. 1 floored",
    "seconds": "seconds",
}


@dataclass(frozen=True)
class Report:
    """Where a report was written and the sentence it comes to."""

    folder: Path
    verdict: str


def write_report(configs: Sequence[Config], overrides: Sequence[str]) -> Report:
    """Report on an experiment from the store alone; runs that are missing are shown as missing."""
    experiment = configs[0].experiment
    assert experiment is not None, "only an experiment has a report"
    folder = report_folder(configs[0], experiment)
    runs.require_writable(folder)
    found = {runs.identify(config): _load(config) for config in configs}
    table = tidy([dataset for dataset in found.values() if dataset is not None], configs[0].analysis)
    table.to_csv(folder / "summary.csv", index=False, float_format="%.6g", lineterminator="\n")
    draw = {"strip": _strip_report, "calibration": _calibration_report}[experiment.picture]
    lines, verdict = draw(experiment, configs, found, table, folder)
    page = [f"# {experiment.title}", "", *lines, "", *_about_the_runs(configs, found, table, overrides)]
    (folder / "index.md").write_text("\n".join(page) + "\n", encoding="utf-8")
    return Report(folder, verdict)


def report_folder(config: Config, experiment: Experiment) -> Path:
    """reports/<experiment>, with the fidelity behind it unless it is the paper's."""
    suffix = "" if config.fidelity.name == "paper" else f"-{config.fidelity.name}"
    return Path(config.reports) / f"{experiment.name}{suffix}"


def _load(config: Config) -> xr.Dataset | None:
    if not runs.is_done(config):
        return None
    with runs.open_run(runs.result_path(config)) as dataset:
        return dataset.load()


def _strip_report(
    experiment: Experiment,
    configs: Sequence[Config],
    found: dict[str, xr.Dataset | None],
    table: pd.DataFrame,
    folder: Path,
) -> tuple[list[str], str]:
    """The paper's figure, the same by fragment, and the verdict on the claims."""
    frames = experiment.frames
    rows = [_row(config, found[runs.identify(config)], frames) for config in _in_paper_order(configs)]
    draw_strip(rows, frames, configs[0], folder / "strip.png", by_fragment=False)
    draw_strip(rows, frames, configs[0], folder / "fragments.png", by_fragment=True)
    verdicts = claims.judge(table, calibrated=experiment.calibrated)
    verdict = claims.sentence(table, verdicts)
    lines = [
        f"**Verdict.** {verdict}",
        "",
        '"More lumps than powder" is read as: more than half of the mass is in lumps. '
        "Means over seeds; the numbers are the mass fraction in lumps.",
        "",
        "| claim | statement | measured | verdict |",
        "|---|---|---|---|",
        *(f"| {v.claim} | {v.statement} | {v.measured} | {v.word} |" for v in verdicts),
        "",
        "![Snow at six times, a row for each pressure, first with and then without sintering](strip.png)",
        "",
        "The runs in the paper's order and colours: pressure rises downwards, first with sintering, then without.",
        "",
        "![The same, coloured by fragment: lumps in colours, powder in grey](fragments.png)",
        "",
        "The same by fragment, from release on: each lump has a colour and keeps it, powder is grey.",
        "",
        "## Does the verdict hang on what counts as broken?",
        "",
        "Mass fraction in lumps by run (pressure, sintering, seed) for other break strains and core fractions; the "
        f"verdict uses {configs[0].analysis.break_strain:g} / {configs[0].analysis.core_fraction:.2g} and both signs. "
        "Stretch only, crush only: with bonds that break by one sign alone.",
        "",
        *_scan(configs, found),
    ]
    return lines, verdict


def _calibration_report(
    experiment: Experiment,
    configs: Sequence[Config],
    found: dict[str, xr.Dataset | None],
    table: pd.DataFrame,
    folder: Path,
) -> tuple[list[str], str]:
    """The chosen pressures and the curve that they were read from."""
    targets = experiment.targets
    chosen = calibrate(table, targets) if len(table) > 1 else [None] * len(targets)
    draw_calibration(table, targets, chosen, folder / "curve.png")
    shown = ", ".join("not reached" if p is None else f"{p:g}" for p in chosen)
    verdict = f"Pressures for lump fractions {', '.join(f'{t:g}' for t in targets)}: {shown}."
    lines = [
        f"**Result.** {verdict}",
        "",
        "![Mass fraction in lumps over pressure](curve.png)",
        "",
        "A rising curve is fitted over log pressure (isotonic regression) and read off at the targets. "
        "Only the sintered runs of this scene are used; rows without sintering and all other scenes are not.",
    ]
    return lines, verdict


def _row(config: Config, dataset: xr.Dataset | None, frames: Sequence[int]) -> Row:
    arm = "no sintering" if not config.sintering.enabled else "sintering"
    label = f"pressure {config.pressure:g}\n{arm}"
    if dataset is None:
        return Row(label, None, {})
    later = [frame for frame in frames if frame >= config.loading.press_frames]
    fragments = classify_frames(dataset, later, config.analysis) if later else []
    return Row(label, dataset, {f.frame: f for f in fragments})


def _name(config: Config) -> str:
    """A run of an experiment in a few words."""
    return f"{config.pressure:g}, {config.sintering.name}, seed {config.seed}"


def _in_paper_order(configs: Sequence[Config]) -> list[Config]:
    """Sintered rows first, pressure rising."""
    return sorted(configs, key=lambda c: (not c.sintering.enabled, c.pressure, c.seed))


def _scan(configs: Sequence[Config], found: dict[str, xr.Dataset | None]) -> list[str]:
    """Lump fraction of every run for other definitions of a broken bond, and the claims that then hold."""
    settings = {f"{s:g} / {c:.2g}": {"break_strain": s, "core_fraction": c} for s in SCAN_STRAINS for c in SCAN_CORES}
    settings |= {f"{sign} only": {"break_by": sign} for sign in ("stretch", "crush")}
    ordered = _in_paper_order(configs)
    by_run = [_lumps(found[runs.identify(config)], config, settings.values()) for config in ordered]
    rows, held_by = [], Counter()
    for name, fractions in zip(settings, zip(*by_run, strict=True), strict=True):
        known = [
            {"sintering": c.sintering.name, "pressure": c.pressure, "lump_fraction": fraction}
            for c, fraction in zip(ordered, fractions, strict=True)
            if fraction is not None
        ]
        verdicts = claims.judge(pd.DataFrame(known), calibrated=False)
        held = [v.claim for v in verdicts if v.word == claims.REPRODUCED]
        held_by.update(held)
        shown = ["missing" if fraction is None else f"{fraction:.2f}" for fraction in fractions]
        rows.append([name, *shown, " ".join(held) or "none"])
    heads = ["break strain / core fraction", *map(_name, ordered), "claims that hold"]
    counts = ", ".join(f"{claim} in {count}" for claim, count in sorted(held_by.items())) or "no claim in any"
    return [*_markdown(pd.DataFrame(rows, columns=heads)), "", f"Of these {len(settings)} definitions: {counts}."]


def _lumps(dataset: xr.Dataset | None, config: Config, changes: Iterable[dict[str, Any]]) -> list[float | None]:
    """Lump fraction of a run under each change of the analysis's settings; None if the run is missing."""
    settings = [config.analysis.model_copy(update=change) for change in changes]
    if dataset is None:
        return [None for _ in settings]
    end = int(dataset["snapshot"][-1])
    bonds, histories = bond_histories(dataset, [end], config.analysis.link_length)
    return [fragments_of(dataset, end, bonds, histories[end], analysis).lump_fraction for analysis in settings]


def _about_the_runs(
    configs: Sequence[Config], found: dict[str, xr.Dataset | None], table: pd.DataFrame, overrides: Sequence[str]
) -> list[str]:
    """Numbers of each run, what is missing, the reading, and where all this comes from."""
    lines = ["## Runs", ""]
    if len(table):
        lines += _markdown(table[list(SHOWN)].rename(columns=SHOWN))
        lines += [
            "",
            "Density, xi and hardening factor (geometric mean) are at release, means over particles. nu capped, "
            "Eq. 1 capped and floored: the most particles at a bound in any frame. All columns: summary.csv.",
            "",
            "What was bounded, on how many particles at most, and since when:",
            "",
        ]
        for config in _in_paper_order(configs):
            dataset = found[runs.identify(config)]
            text = "; ".join(bounded(dataset)) if dataset is not None else "missing"
            lines.append(f"- {_name(config)}: {text or 'nothing'}")
    missing = [config for config in configs if found[runs.identify(config)] is None]
    for config in missing:
        reason = runs.failure(config) or "not run"
        lines += ["", f"- **missing**: {_name(config)}: {reason}"]
    config = configs[0]
    lines += [
        "", "## What the paper leaves open, as read here", "",
        f"Reading `{config.reading.name}`, fidelity `{config.fidelity.name}`, seed {config.seed}. "
        "Each switch is explained in conf/reading/grid_units.yaml.", "",
        *_markdown(pd.DataFrame(config.reading.model_dump().items(), columns=["choice", "value"]).astype(str)),
        "", "## Where this comes from", "",
        f"Redo: `snowrepro run {shlex.join(overrides)}`", "",
    ]  # fmt: skip
    done = [dataset for dataset in found.values() if dataset is not None]
    if done:
        lines += [f"- {key}: {done[0].attrs[key]}" for key in ("versions", "git_state", "machine", "created")]
    return lines


def _markdown(table: pd.DataFrame) -> list[str]:
    """A Markdown table; floats with three significant digits, or whole from 1000 on."""

    def show(value: object) -> str:
        if not isinstance(value, float):
            return str(value)
        return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}"

    header = [str(column) for column in table.columns]
    rows = [[show(value) for value in row] for row in table.itertuples(index=False)]
    return ["| " + " | ".join(cells) + " |" for cells in (header, ["---"] * len(header), *rows)]
