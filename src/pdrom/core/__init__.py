"""What every room uses: errors, storage, configuration files, registries, logs."""
