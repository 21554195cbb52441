"""Identifies the load of a Gough-Stewart platform."""
