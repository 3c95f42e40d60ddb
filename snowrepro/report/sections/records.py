"""A report for other programs.

report.json has the whole report; claims.json all that verdicts rest on; claims.csv one row for each verdict.
"""

import hashlib
import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pandas as pd

from ...analysis.statistics import Estimate, estimate_mean
from ...evidence.claims import ARMS, JudgedScene, Verdict, find_limits, select_arm
from ...evidence.gather import Evidence, read_origin
from ...settings.question import HOW_USED, Claims
from ...store.files import published
from ...text import make_cells
from ..document import Block, Document, Fold, Heading, Pair, Picture, Section, Table


def write_claims(evidence: Evidence, half_pressures: dict[str, str]) -> None:
    """Write claims.json and claims.csv into the report's folder.  ``half_pressures``: P50 by scene, in words."""
    claims, scenes, over_scenes = evidence.runs[0].config.question.claims, evidence.scenes, evidence.over_scenes
    content = claims.model_dump(mode="json")
    record = {
        "experiment": evidence.experiment.model_dump(mode="json", exclude=HOW_USED),
        "fidelity": evidence.runs[0].case.fidelity.name,
        "reading": evidence.runs[0].case.reading.name,
        "seeds": evidence.seeds,
        "claims": {"sha256": hash_content(content), "content": content},
        "over_scenes": [_record_verdict(v) for v in over_scenes],
        "scenes": [
            {
                "shape": scene.shape,
                "floor": scene.floor,
                "calibrated": scene.calibrated,
                "verdicts": [_record_verdict(v) for v in scene.verdicts],
                "P50": {**asdict(evidence.half_pressures[scene.name]), "shown": half_pressures[scene.name]},
                "cells": _record_cells(scene, claims),
            }
            for scene in scenes
        ],
        "runs": _record_runs(evidence),
        "provenance": _record_makers(evidence),
    }
    _write_json(record, evidence.folder / "claims.json")
    rows = [_make_row(scene.shape, scene.floor, v) for scene in scenes for v in scene.verdicts]
    frame = pd.DataFrame([*(_make_row("", "", v) for v in over_scenes), *rows])
    with published(evidence.folder / "claims.csv") as partial:
        make_cells(frame).to_csv(partial, index=False, float_format="%.6g", lineterminator="\n")


def write_json(document: Document, path: Path) -> None:
    """Write a report as JSON: its sections with their text, pictures and tables."""
    record = {
        "title": document.title,
        "sections": [_record_section(section) for section in document.sections],
    }
    _write_json(record, path)


def _record_section(section: Section) -> dict[str, Any]:
    """Convert a section to plain values."""
    record = {"anchor": section.anchor, "title": section.title, "paper": section.paper_text, "redo": section.command}
    return {**record, "blocks": [_record_block(block) for block in section.blocks]}


def _record_block(block: Block) -> dict[str, Any]:
    """Convert a block to plain values; a table becomes its columns and rows."""
    if isinstance(block, Picture):
        return {"picture": asdict(block)}
    if isinstance(block, Pair):
        return {"pictures": {name: asdict(p) for name, p in zip(block.names, block.pictures, strict=True)}}
    if isinstance(block, Table):
        record = {"columns": [*map(str, block.frame.columns)], "rows": block.frame.astype(object).values.tolist()}
        return {"table": record, "caption": block.caption, "file": block.data}
    if isinstance(block, Heading):
        return {"heading": block.text}
    if isinstance(block, Fold):
        return {"fold": block.summary, "blocks": [_record_block(inner) for inner in block.blocks]}
    return {"text": block}


def _write_json(record: dict[str, Any], path: Path) -> None:
    """Write a record; numbers that are not finite become null."""
    text = json.dumps(_replace_non_finite(record), indent=1, allow_nan=False, ensure_ascii=False)
    with published(path) as partial:
        partial.write_text(text + "\n", encoding="utf-8")


def hash_content(content: dict) -> str:
    """Compute the SHA-256 of canonical JSON: sorted keys, no spaces."""
    return hashlib.sha256(json.dumps(content, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def _record_verdict(verdict: Verdict) -> dict[str, Any]:
    """Convert a verdict to plain values."""
    return {**asdict(verdict), "shown": verdict.label}


def _record_cells(scene: JudgedScene, claims: Claims) -> list[dict[str, Any]]:
    """List every measured number by measure, arm and pressure, with mean and interval over seeds."""
    measures = dict.fromkeys(claim.measure for claim in claims.list)
    return [
        {"measure": measure, "arm": arm, "pressure": float(pressure)}
        | {"seeds": {str(seed): value for seed, value in column.items()}}
        | asdict(estimate_mean(column, claims.alpha, find_limits(measure)))
        for measure in measures
        for arm in ARMS
        for pressure, values in select_arm(scene.table, arm, measure).items()
        if len(column := values.dropna())
    ]


def _record_runs(evidence: Evidence) -> list[dict[str, Any]]:
    """List the runs with what tells them apart, and whether they are done."""
    return [
        {
            "run_id": run.id,
            "shape": run.case.shape.name,
            "floor": run.case.floor.name,
            "sintering": run.case.sintering.name,
            "pressure": run.case.pressure,
            "seed": run.case.seed,
            "done": evidence.is_done(run),
        }
        for run in evidence.runs
    ]


def _record_makers(evidence: Evidence) -> list[dict[str, str]]:
    """List the versions and code that made the runs, each pair once."""
    makers = {read_origin(run)[:2] for run in evidence.runs if evidence.is_done(run)}
    return [{"versions": versions, "git_state": state} for versions, state in sorted(makers)]


def _make_row(shape: str, floor: str, verdict: Verdict) -> dict[str, Any]:
    """Make the row of a verdict for claims.csv."""
    effect = verdict.effect or Estimate(math.nan)
    return {
        "shape": shape,
        "floor": floor,
        "claim": verdict.claim,
        "verdict": verdict.word,
        "calibrated": verdict.calibrated,
        "numbers": verdict.direction,
        "effect": effect.mean,
        "low": effect.low,
        "high": effect.high,
        "effect_of": verdict.effect_of,
        "margin": verdict.margin,
        "seeds": verdict.seeds,
        "same_as": verdict.same_as,
        "measured": verdict.measured,
        "beside": verdict.beside,
        "against": "; ".join(verdict.disagrees),
        "left_out": "; ".join(verdict.left_out),
        "note": verdict.note,
        "statement": verdict.statement,
    }


def _replace_non_finite(value: Any) -> Any:
    """Replace infinity and NaN by None, at any depth: JSON has neither."""
    if isinstance(value, dict):
        return {key: _replace_non_finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_replace_non_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
