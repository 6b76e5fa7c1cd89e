"""Words of users and captions: what can be typeset, and the light mark-up."""
