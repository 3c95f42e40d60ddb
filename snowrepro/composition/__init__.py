"""From overrides and drawings to a validated configuration; Hydra is known here."""
