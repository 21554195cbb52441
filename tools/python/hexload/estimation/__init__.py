"""The firmware's estimators over logs: replay, tare, and what is said of their results."""
