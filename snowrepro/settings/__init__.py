"""What can be set: what is simulated (``case``), how (``execution``), and what is asked of it (``question``)."""
