"""Files: leg logs of every kind, run directories, TOML."""
