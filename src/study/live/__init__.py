"""Web page on which reduced models run, with the scripts that draw their motion."""
