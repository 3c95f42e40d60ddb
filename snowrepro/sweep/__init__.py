"""Many runs: what a sweep consists of, and running it in processes of its own."""
