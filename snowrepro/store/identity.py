"""The identity of a run: what its result depends on, and nothing else."""

import hashlib
import json
import weakref
from typing import Any

from ..config import MODEL_VERSION, Config, Section

NOT_PHYSICS = {
    "analysis", "checkpoint_seconds", "claims", "deterministic", "experiment", "reports", "rerun", "store", "threads",
}  # fmt: skip
PHYSICS = tuple(sorted(set(Config.model_fields) - NOT_PHYSICS))
PHYSICS_OF_A_FALL = tuple(name for name in PHYSICS if name != "indenter")
_json = json.JSONEncoder(sort_keys=True, separators=(",", ":")).encode
_last: tuple[Config, str] | None = None
# By the id of a section for as long as it lives, as many runs share it; not by its value: 0.0 equals -0.0.
_texts: dict[int, tuple[weakref.ref, str]] = {}


def identify(config: Config) -> str:
    """The run's id under this version of the model."""
    global _last  # most are asked for several times in a row
    last = _last
    if last is None or last[0] is not config:
        _last = last = config, run_id(config, MODEL_VERSION)
    return last[1]


def run_id(config: Config, model_version: int) -> str:
    """A readable name that ends in a hash of the physics; any spelling of the same run gives the same id."""
    digest = hashlib.sha256(canonical(config, model_version).encode()).hexdigest()[:10]
    return (
        f"{config.shape.name}-{config.floor.name}-{config.pressure:g}-{config.sintering.name}"
        f"-{config.fidelity.name}-{config.seed}{f'-{config.indenter.name}' if config.indenter else ''}-{digest}"
    )


def canonical(config: Config, model_version: int) -> str:
    """The physics as JSON with sorted keys and no blanks; what is made of it must never change by a byte."""
    texts = {name: _text(getattr(config, name)) for name in (PHYSICS if config.indenter else PHYSICS_OF_A_FALL)}
    texts["model_version"] = str(model_version)
    if config.indenter:  # it does not take the frames of the fall
        texts["loading"] = _json(config.loading.model_dump(mode="json", exclude={"frames"}))
    return "{" + ",".join([f'"{name}":{text}' for name, text in sorted(texts.items())]) + "}"


def _text(value: Any) -> str:
    """The JSON of a value or of a section."""
    if type(value) in (int, float):  # as the encoder writes them, in a tenth of its time
        return repr(value)
    kept = _texts.get(id(value))
    if kept:
        return kept[1]
    if not isinstance(value, Section):
        return _json(value)
    text, key = _json(value.model_dump(mode="json")), id(value)
    # The callback also runs while the interpreter ends, when a module has lost its names.
    _texts[key] = weakref.ref(value, lambda _, forget=_texts.pop: forget(key, None)), text
    return text
