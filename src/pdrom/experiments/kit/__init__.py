"""What experiments share: settings, measurement, runs that only experiments make."""
