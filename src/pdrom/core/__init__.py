"""Common ground of all rooms: errors, storage, configuration files, registries, logs."""
