"""The numbers of one run: its row, what the columns mean, and its lumps, crushed and loose snow."""
