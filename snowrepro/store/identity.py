"""The identity of a run: what its result depends on, and nothing else."""

import hashlib
import json

from ..config import Config

NOT_PHYSICS = {"analysis", "claims", "store", "reports", "experiment", "threads", "deterministic", "checkpoint_seconds"}


def run_id(config: Config, model_version: int) -> str:
    """A readable name that ends in a hash of the physics; any spelling of the same run gives the same id."""
    physics = config.model_dump(mode="json", exclude=NOT_PHYSICS)
    if config.indenter:
        del physics["loading"]["frames"]  # those of the fall, which it does not take
    canonical = json.dumps({"model_version": model_version, **physics}, sort_keys=True, separators=(",", ":"))
    digest = hashlib.sha256(canonical.encode()).hexdigest()[:10]
    return (
        f"{config.shape.name}-{config.floor.name}-{config.pressure:g}-{config.sintering.name}"
        f"-{config.fidelity.name}-{config.seed}{f'-{config.indenter.name}' if config.indenter else ''}-{digest}"
    )
