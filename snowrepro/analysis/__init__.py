"""Lumps and powder: what still holds together after the collision, and what the paper claims of it."""
