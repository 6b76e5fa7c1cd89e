"""Pages for readers that are made from declarations."""
