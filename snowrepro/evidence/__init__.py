"""What the results of many runs show: tables, verdicts on claims, comparisons."""
