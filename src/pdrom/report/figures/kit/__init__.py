"""What figures share: how they are declared, what they read, and tools that draw."""
