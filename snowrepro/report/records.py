"""The verdicts for other programs: claims.json with all that they rest on, claims.csv with a row a verdict."""

import hashlib
import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import pandas as pd

from ..analysis.calibration import Crossing
from ..analysis.claims import ARMS, Scene, Verdict, arm_of
from ..analysis.statistics import Estimate, estimate
from ..config import Claims
from ..store import runs
from ..store.files import published
from ..store.provenance import provenance
from .evidence import Evidence, opened


def write_records(
    evidence: Evidence,
    scenes: Sequence[Scene],
    over: Sequence[Verdict],
    halves: dict[str, Crossing],
    shown: dict[str, str],
) -> None:
    """Write claims.json and claims.csv into the report's folder.  ``halves``, ``shown``: P50 by scene, and in words."""
    claims = evidence.configs[0].claims
    content = claims.model_dump(mode="json")
    record = {
        "experiment": evidence.experiment.model_dump(mode="json"),
        "fidelity": evidence.configs[0].fidelity.name,
        "reading": evidence.configs[0].reading.name,
        "seeds": sorted({config.seed for config in evidence.configs}),
        "claims": {"sha256": digest(content), "content": content},
        "over_scenes": [_verdict(v) for v in over],
        "scenes": [
            {
                "shape": scene.shape,
                "floor": scene.floor,
                "calibrated": scene.calibrated,
                "verdicts": [_verdict(v) for v in scene.verdicts],
                "P50": {**asdict(halves[scene.name]), "shown": shown[scene.name]},
                "cells": _cells(scene, claims),
            }
            for scene in scenes
        ],
        "runs": _runs(evidence),
        "provenance": {"judged": provenance(), "runs": _makers(evidence)},
    }
    text = json.dumps(_finite(record), indent=1, allow_nan=False)
    with published(evidence.folder / "claims.json") as partial:
        partial.write_text(text + "\n", encoding="utf-8")
    rows = [_row(scene.shape, scene.floor, v) for scene in scenes for v in scene.verdicts]
    frame = pd.DataFrame([*(_row("", "", v) for v in over), *rows])
    with published(evidence.folder / "claims.csv") as partial:
        frame.to_csv(partial, index=False, float_format="%.6g", lineterminator="\n")


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
    found = set()
    for config in evidence.configs:
        if evidence.is_done(config):
            with opened(config) as dataset:
                found.add((dataset.attrs["versions"], dataset.attrs["git_state"]))
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
