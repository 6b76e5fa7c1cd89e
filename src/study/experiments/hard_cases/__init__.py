"""Run reductions in hard cases, which are scenes with extreme input."""
