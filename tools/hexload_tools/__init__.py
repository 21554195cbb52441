"""Command line, log reader and report of hexload."""
