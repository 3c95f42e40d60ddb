"""A report for other programs: report.json; claims.json with all that verdicts rest on, claims.csv with a row each."""

import hashlib
import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pandas as pd

from ..analysis.claims import ARMS, Scene, Verdict, arm_of
from ..analysis.statistics import Estimate, estimate
from ..config import Claims
from ..store import runs
from ..store.files import published
from .document import Block, Document, Fold, Heading, Pair, Picture, Section, Table
from .evidence import Evidence, made_by


def write_records(evidence: Evidence, shown: dict[str, str]) -> None:
    """Write claims.json and claims.csv into the report's folder.  ``shown``: P50 by scene, in words."""
    claims, scenes, over = evidence.configs[0].claims, evidence.scenes, evidence.over_scenes
    content = claims.model_dump(mode="json")
    record = {
        "experiment": evidence.experiment.model_dump(mode="json"),
        "fidelity": evidence.configs[0].fidelity.name,
        "reading": evidence.configs[0].reading.name,
        "seeds": evidence.seeds,
        "claims": {"sha256": digest(content), "content": content},
        "over_scenes": [_verdict(v) for v in over],
        "scenes": [
            {
                "shape": scene.shape,
                "floor": scene.floor,
                "calibrated": scene.calibrated,
                "verdicts": [_verdict(v) for v in scene.verdicts],
                "P50": {**asdict(evidence.halves[scene.name]), "shown": shown[scene.name]},
                "cells": _cells(scene, claims),
            }
            for scene in scenes
        ],
        "runs": _runs(evidence),
        "provenance": _makers(evidence),
    }
    _write_json(record, evidence.folder / "claims.json")
    rows = [_row(scene.shape, scene.floor, v) for scene in scenes for v in scene.verdicts]
    frame = pd.DataFrame([*(_row("", "", v) for v in over), *rows])
    with published(evidence.folder / "claims.csv") as partial:
        frame.to_csv(partial, index=False, float_format="%.6g", lineterminator="\n")


def write_document(document: Document, path: Path) -> None:
    """Write a report for other programs: its sections with their text, pictures and tables."""
    record = {
        "title": document.title,
        "sections": [_section(section) for section in document.sections],
    }
    _write_json(record, path)


def _section(section: Section) -> dict[str, Any]:
    about = {"anchor": section.anchor, "title": section.title, "paper": section.says, "redo": section.redo}
    return {**about, "blocks": [_block(block) for block in section.blocks]}


def _block(block: Block) -> dict[str, Any]:
    """A block as plain values; a table as its columns and data."""
    if isinstance(block, Picture):
        return {"picture": asdict(block)}
    if isinstance(block, Pair):
        return {"pictures": {name: asdict(p) for name, p in zip(block.names, block.pictures, strict=True)}}
    if isinstance(block, Table):
        told = {"columns": [*map(str, block.frame.columns)], "rows": block.frame.astype(object).values.tolist()}
        return {"table": told, "caption": block.caption, "file": block.data}
    if isinstance(block, Heading):
        return {"heading": block.text}
    if isinstance(block, Fold):
        return {"fold": block.summary, "blocks": [_block(inner) for inner in block.blocks]}
    return {"text": block}


def _write_json(record: dict[str, Any], path: Path) -> None:
    text = json.dumps(_finite(record), indent=1, allow_nan=False, ensure_ascii=False)
    with published(path) as partial:
        partial.write_text(text + "\n", encoding="utf-8")


def digest(content: dict) -> str:
    """SHA-256 of canonical JSON: sorted keys, no spaces."""
    return hashlib.sha256(json.dumps(content, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def _verdict(verdict: Verdict) -> dict[str, Any]:
    return {**asdict(verdict), "shown": verdict.shown}


def _cells(scene: Scene, claims: Claims) -> list[dict[str, Any]]:
    """Every number by measure, arm, pressure and seed, with mean and interval over seeds."""
    measures = dict.fromkeys(claim.measure for claim in claims.list)
    return [
        {"measure": measure, "arm": arm, "pressure": float(pressure)}
        | {"seeds": {str(seed): value for seed, value in column.items()}, **asdict(estimate(column, claims.alpha))}
        for measure in measures
        for arm in ARMS
        for pressure, values in arm_of(scene.table, arm, measure).items()
        if len(column := values.dropna())
    ]


def _runs(evidence: Evidence) -> list[dict[str, Any]]:
    return [
        {
            "run_id": runs.identify(config),
            "shape": config.shape.name,
            "floor": config.floor.name,
            "sintering": config.sintering.name,
            "pressure": config.pressure,
            "seed": config.seed,
            "done": evidence.is_done(config),
        }
        for config in evidence.configs
    ]


def _makers(evidence: Evidence) -> list[dict[str, str]]:
    """With which versions and code the runs were made, each pair once."""
    found = {made_by(config)[:2] for config in evidence.configs if evidence.is_done(config)}
    return [{"versions": versions, "git_state": state} for versions, state in sorted(found)]


def _row(shape: str, floor: str, verdict: Verdict) -> dict[str, Any]:
    """A verdict in one line of a table."""
    effect, tau = verdict.effect or Estimate(math.nan), verdict.tau or Estimate(math.nan)
    return {
        "shape": shape,
        "floor": floor,
        "claim": verdict.claim,
        "verdict": verdict.word,
        "calibrated": verdict.calibrated,
        "numbers": verdict.way,
        "effect": effect.mean,
        "low": effect.low,
        "high": effect.high,
        "effect_of": verdict.effect_of,
        "seeds": verdict.seeds,
        "p": verdict.p,
        "tau": tau.mean,
        "tau_low": tau.low,
        "tau_high": tau.high,
        "measured": verdict.measured,
        "against": "; ".join(verdict.disagrees),
        "note": verdict.note,
        "statement": verdict.statement,
    }


def _finite(value: Any) -> Any:
    """JSON has neither infinity nor NaN: null."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
