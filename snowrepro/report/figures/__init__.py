"""One module for each figure or study: which runs it needs, and what its report shows."""
