"""Two laws of one's own: ``plastic``, a yield surface, and ``power_law``, Young's modulus over density."""
