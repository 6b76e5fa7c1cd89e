"""The method of the published code, one of its choices after the other, beside its own output."""
