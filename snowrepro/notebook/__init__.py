"""What Python, and notebooks above all, are offered beside numbers: views, pictures and films, and whole sweeps."""
