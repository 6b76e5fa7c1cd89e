"""What tables share: how they are declared, found and made, and columns that several have."""
