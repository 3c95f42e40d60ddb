"""Runs to be played with in a page."""
