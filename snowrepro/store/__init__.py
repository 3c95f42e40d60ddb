"""Runs on disk: identity, one folder a run, files that are whole or absent, provenance."""
