"""The identity of a run: a hash of its case, and of nothing else."""

import functools
import hashlib
import json
import weakref
from collections.abc import Mapping
from typing import Any

from ..settings.base import Settings
from ..settings.case import MODEL_VERSION, Case

OF_A_FALL = {"frames", "fall_time", "rest"}  # of the loading
_json = json.JSONEncoder(sort_keys=True, separators=(",", ":")).encode
# By the id of a section for as long as it lives, as many runs share it; not by its value: 0.0 equals -0.0.
_texts: dict[int, tuple[weakref.ref, str]] = {}


def run_id(case: Case, model_version: int = MODEL_VERSION) -> str:
    """A readable name that ends in a hash of the case; any spelling of the same case gives the same id."""
    digest = hashlib.sha256(canonical(case, model_version).encode()).hexdigest()[:10]
    return (
        f"{case.shape.name}-{case.floor.name}-{case.pressure:g}-{case.sintering.name}"
        f"-{case.fidelity.name}-{case.seed}{f'-{case.indenter.name}' if case.indenter else ''}-{digest}"
    )


def is_id_of(run_id_written: str, config: Mapping[str, Any]) -> bool:
    """Whether an id is that of the run whose configuration was written down so, as plain values of this version."""
    plain = {name: config[name] for name in Case.model_fields if name in config}
    if plain.get("indenter") and isinstance(plain.get("loading"), dict):
        plain["loading"] = {name: value for name, value in plain["loading"].items() if name not in OF_A_FALL}
    digest = hashlib.sha256(_json({**plain, "model_version": MODEL_VERSION}).encode()).hexdigest()[:10]
    if run_id_written.endswith(f"-{digest}"):  # in a tenth of the time that it takes to validate it
        return True
    try:
        return run_id_written == run_id(Case.model_validate(plain | {"loading": config.get("loading")}))
    except (ValueError, RecursionError, OverflowError):
        return False


def canonical(case: Case, model_version: int) -> str:
    """The case as JSON with sorted keys and no blanks; what is made of it must never change by a byte."""
    texts = {name: _text(getattr(case, name)) for name in Case.model_fields}
    texts["model_version"] = str(model_version)
    if case.indenter:  # it takes nothing of the fall
        texts["loading"] = _json(case.loading.model_dump(mode="json", exclude=OF_A_FALL))
    else:  # written as before there were any
        del texts["indenter"]
        if case.loading.fall_time:  # another spelling of the frames that it makes
            texts["loading"] = _text(case.own_loading)
    return "{" + ",".join([f'"{name}":{text}' for name, text in sorted(texts.items())]) + "}"


def _forget(texts: dict[int, tuple[weakref.ref, str]], key: int, _: weakref.ref) -> None:
    """Called when a section is gone; also while the interpreter ends, when a module has lost its names."""
    texts.pop(key, None)


def _text(value: Any) -> str:
    """The JSON of a value or of a section."""
    if type(value) in (int, float):  # as the encoder writes them, in a tenth of its time
        return repr(value)
    known = _texts.get(id(value))
    if known:
        return known[1]
    if not isinstance(value, Settings):
        return _json(value)
    text, key = _json(value.model_dump(mode="json")), id(value)
    _texts[key] = weakref.ref(value, functools.partial(_forget, _texts, key)), text
    return text
