"""The expanded material point method of the paper (Fig. 1, Sec. 3.4); knows no files and no Hydra."""
