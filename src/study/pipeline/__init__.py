"""Planning and running of a study: configuration, workflow rules, jobs and result folders."""
