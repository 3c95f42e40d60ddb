"""The scene before the first frame: outlines, particles, the floor on the grid, the pressing force."""
