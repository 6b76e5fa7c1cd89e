"""What people read: figures, manuscript and verdicts."""
