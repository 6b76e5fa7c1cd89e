"""Model order reduction: snapshots, bases, samplings and reduced runs."""
