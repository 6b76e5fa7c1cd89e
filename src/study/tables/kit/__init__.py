"""Tools of the tables: their declaration, and columns that several of them have."""
