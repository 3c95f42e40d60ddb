"""Computations on arrays: which particles hold together in lumps, how hard snow is, and the statistics of claims."""
