"""Other ways to compute the same substep, to compare with."""
